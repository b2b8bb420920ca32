"""What each stage's artifact holds: results to datasets and back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator.arrays import Floats, Ints
from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.updates import FIELDS, Kept
from pipeline.store import artifact, vtkhdf
from pipeline.store.artifact import Dataset
from stages.domains import DOMAINS

if TYPE_CHECKING:
    import stages.mirror
    import stages.optimize
    import stages.refine
    import stages.simulate
    from actuator.domains.interface import Domain
    from stages.response import Response

Content = tuple[dict[str, Dataset], vtkhdf.GridPaths]

#: Units of the history's columns, in the order of a table; others are numbers without a unit and come after them.
HISTORY = {
    **dict.fromkeys(("update", "evaluations", "C", "C0", "C_chi", "C_A", "C_i", "C_p", "C_psi"), "1"),
    **{"T1": "mm", "T3": "mm", "theta2": "rad"},
    **dict.fromkeys(("dt", "stationarity", "energy_ratio", "steepest"), "1"),
    **dict.fromkeys(("newton", "krylov", "products", "factorisations", "inner"), "1"),
    **dict.fromkeys(("seconds_state", "seconds_adjoint", "seconds_inner", "seconds"), "s"),
}


def of_optimize(result: stages.optimize.Result, kept: Kept | None = None) -> Content:
    """Design, state and history.

    Args:
        result: of the optimisation.
        kept: fields of the design updates that VTK readers shall find as time steps.
    """
    from scipy.special import expit  # slow to load: only where there is a design to store

    domain = result.domain
    chi = vtkhdf.on_nodes(domain, result.chi)
    pressure = vtkhdf.on_nodes(domain, result.pressure)
    datasets = {
        "vertices/chi": Dataset(result.chi, "1", "design field chi at the vertices"),
        "vertices/pressure": Dataset(result.pressure, "N/mm^2", "pressure p at the vertices"),
        "nodes/points": Dataset(domain.nodes, "mm", "undeformed nodes of the 20-node cells, the vertices first"),
        "nodes/connectivity": Dataset(
            domain.node_cells[:, vtkhdf.vtk_order()].ravel(), "1", "nodes of the cells, 20 each, in VTK's order"
        ),
        "nodes/chi": Dataset(chi, "1", "design field chi; on edges the mean of the ends"),
        "nodes/density": Dataset(expit(chi), "1", "density rho = 1 / (1 + exp(-chi)), Eq. (1)"),
        "nodes/pressure": Dataset(pressure, "N/mm^2", "pressure p; on edges the mean of the ends"),
        "nodes/displacement": Dataset(result.displacement, "mm", "displacement u"),
        "arm": Dataset(result.arm, "mm, mm, rad", "rigid motion T1, T3, theta2 of the arm's root"),
        **_domain(domain),
        **{
            f"history/{name}": Dataset(column, HISTORY.get(name, "1"), f"{name} after every design update")
            for name, column in result.history.items()
        },
    }
    names = ("chi", "density", "pressure", "displacement")
    grid = vtkhdf.GridPaths(
        "/nodes/points",
        "/nodes/connectivity",
        vtkhdf.QUADRATIC_HEXAHEDRON,
        {name: f"/nodes/{name}" for name in names},
    )
    if not kept:
        return datasets, grid
    series = vtkhdf.GridPaths(
        "/nodes/points",
        "/updates/connectivity",
        vtkhdf.HEXAHEDRON,
        {name: f"/updates/{name}" for name in names},
        times=tuple(map(float, kept)),
        n_points=len(domain.points),
    )
    return datasets | _updates(domain, kept), replace(grid, series=series)


def _updates(domain: Domain, kept: Kept) -> dict[str, Dataset]:
    """Fields of the vertices, one update after the other, as VTK reads them."""
    from scipy.special import expit  # as in of_optimize

    flat = {name: np.concatenate([fields[name] for fields in kept.values()]) for name in FIELDS}
    meanings = FIELDS | {"density": ("1", "density rho = 1 / (1 + exp(-chi)), Eq. (1), at the vertices")}
    flat["density"] = expit(flat["chi"])
    return {
        "updates/number": Dataset(np.array(list(kept), dtype=np.int64), "1", "numbers of the design updates kept"),
        "updates/connectivity": _corners(domain),
        **{
            f"updates/{name}": Dataset(values, meanings[name][0], f"{meanings[name][1]}, one update after the other")
            for name, values in flat.items()
        },
    }


def _corners(domain: Domain) -> Dataset:
    cells = domain.cells[:, vtkhdf.vtk_order()[:8]].astype(np.int64)
    return Dataset(cells.ravel(), "1", "vertices of the cells, 8 each, in VTK's order")


def of_refine(result: stages.refine.Result) -> Content:
    """The finer mesh and the filtered design."""
    from scipy.special import expit  # as in of_optimize

    domain = result.domain
    datasets = {
        "vertices/points": Dataset(domain.points, "mm", "vertices of the finer mesh"),
        "vertices/connectivity": _corners(domain),
        "vertices/chi": Dataset(result.chi, "1", "filtered design field at the vertices"),
        "vertices/density": Dataset(expit(result.chi), "1", "density rho = 1 / (1 + exp(-chi)), Eq. (1)"),
        **_domain(domain),
    }
    fields_ = {name: f"/vertices/{name}" for name in ("chi", "density")}
    return datasets, vtkhdf.GridPaths("/vertices/points", "/vertices/connectivity", vtkhdf.HEXAHEDRON, fields_)


def of_mirror(result: stages.mirror.Result) -> Content:
    """The closed surface of the whole solid."""
    datasets = {
        "surface/points": Dataset(result.vertices, "mm", "vertices of the solid's surface"),
        "surface/connectivity": Dataset(
            result.triangles.astype(np.int64).ravel(), "1", "vertices of the triangles, 3 each, outward normals"
        ),
    }
    return datasets, vtkhdf.GridPaths("/surface/points", "/surface/connectivity", vtkhdf.TRIANGLE, {})


#: Units of the columns of a pressure-displacement curve; the others are numbers without a unit.
CURVE_UNITS = {"pressure": "N/mm^2", "T1": "mm", "T3": "mm", "theta2": "rad", "elongation": "mm"}


def of_simulate(result: stages.simulate.Result) -> tuple[dict[str, Dataset], vtkhdf.GridPaths | None]:
    """Curves of every field, and the stored states on their meshes; no grid if there is no state yet."""
    datasets: dict[str, Dataset] = {}
    grids: dict[str, vtkhdf.GridPaths] = {}
    for name, response in result.responses.items():
        for column, values in response.curves.items():
            datasets[f"curves/{name}/{column}"] = Dataset(
                values, CURVE_UNITS.get(column, "1"), f"{column} along the path, field {name}"
            )
        if any(state.stored for state in response.states.values()):
            stored, grids[name] = _states(name, response)
            datasets |= stored
    if not grids:
        return datasets, None
    first, *others = grids
    return datasets, replace(grids[first], others={name: grids[name] for name in others})


def _states(name: str, response: Response) -> tuple[dict[str, Dataset], vtkhdf.GridPaths]:
    domain, at = response.domain, f"{name}/states"
    chosen = {load: state for load, state in sorted(response.states.items()) if state.stored}
    pressure = [vtkhdf.on_nodes(domain, state.pressure) for state in chosen.values()]
    datasets = {
        f"{at}/points": Dataset(domain.nodes, "mm", "undeformed nodes of the 20-node cells, the vertices first"),
        f"{at}/connectivity": Dataset(
            domain.node_cells[:, vtkhdf.vtk_order()].ravel(), "1", "nodes of the cells, 20 each, in VTK's order"
        ),
        f"{at}/chi": Dataset(vtkhdf.on_nodes(domain, response.chi), "1", "density field chi; on edges the mean"),
        f"{at}/pressure": Dataset(np.concatenate(pressure), "N/mm^2", "pressure p, one state after the other"),
        f"{at}/displacement": Dataset(
            np.concatenate([state.displacement for state in chosen.values()]), "mm", "u, one state after the other"
        ),
        f"{at}/load_factor": Dataset(np.array(list(chosen)), "1", "load factors of the states"),
    }
    fields_ = {field: f"/{at}/{field}" for field in ("chi", "pressure", "displacement")}
    grid = vtkhdf.GridPaths(f"/{at}/points", f"/{at}/connectivity", vtkhdf.QUADRATIC_HEXAHEDRON, fields_, tuple(chosen))
    return datasets, grid


def design(path: Path, stage: str) -> tuple[Domain, Floats]:
    """Domain and χ at its vertices from the artifact of ``optimize`` or ``refine``.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    chi = artifact.read(path, stage, "vertices/chi")[0]
    refuse_not_finite(path, "vertices/chi", chi)
    stored = artifact.read_group(path, stage, "domain")
    shape = stored.pop("shape", "without a name")
    if shape not in DOMAINS:
        known = ", ".join(DOMAINS)
        sentence = f"{path}: its design domain, {shape}, is none of {known}; register it, or make the file again."
        raise Fault(ExitCode.ARTIFACT, sentence)
    return DOMAINS[shape].domain_type()(**{name: value.item() for name, value in stored.items()}), chi


def refuse_not_finite(path: Path, name: str, values: Floats) -> None:
    """Do nothing if all values of a dataset are finite.

    Raises:
        Fault: with how many are not (ARTIFACT).
    """
    if bad := int(np.count_nonzero(~np.isfinite(values))):
        raise Fault(
            ExitCode.ARTIFACT, f"{path}: {name} is not finite in {bad} of {values.size} entries; make the file again."
        )


def surface(path: Path) -> tuple[Floats, Ints]:
    """Vertices (n, 3) and triangles (m, 3) from the artifact of ``mirror``.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    points, connectivity = artifact.read(path, "mirror", "surface/points", "surface/connectivity")
    refuse_not_finite(path, "surface/points", points)
    return points, connectivity.reshape(-1, 3)


def summarised(summary: Mapping[str, Any]) -> dict[str, Dataset]:
    """A stage's summary as a dataset; numbers that are not finite, which JSON lacks, become null."""
    text = json.dumps(_json_value(summary), allow_nan=False)
    return {"report/summary": Dataset(text, "", "summary of the stage, JSON")}


def summary(path: Path, stage: str) -> dict[str, Any]:
    """A stage's summary, read from its artifact.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    found: dict[str, Any] = json.loads(artifact.read(path, stage, "report/summary")[0])
    return found


def _json_value(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _json_value(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _json_value(value.tolist())
    if isinstance(value, list | tuple):
        return [_json_value(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _domain(domain: Domain) -> dict[str, Dataset]:
    return {
        "domain/shape": Dataset(domain.shape, "", "which design domain"),
        **{f"domain/{name}": Dataset(*parameter) for name, parameter in domain.parameters.items()},
    }
