"""The result of an optimisation: what is kept of it, and what a user reads of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stages import regions
from stages.datasets import (
    HEXAHEDRON,
    QUADRATIC_HEXAHEDRON,
    Dataset,
    GridPaths,
    Packed,
    Source,
    corners,
    nodes,
    of_domain,
    on_nodes,
)

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from actuator.domains.interface import Domain
    from stages.regions import Bodies
    from stages.rig import RigUnits

#: Units of the history's columns, in the order of a table; others are numbers without a unit and come after them.
HISTORY = {
    **dict.fromkeys(("update", "evaluations", "C", "C0", "C_chi", "C_A", "C_i", "C_p", "C_psi"), "1"),
    **{"T1": "mm", "T2": "mm", "T3": "mm", "theta1": "rad", "theta2": "rad", "theta3": "rad"},
    **dict.fromkeys(("dt", "stationarity", "energy_ratio", "steepest"), "1"),
    **dict.fromkeys(("newton", "krylov", "factorisations", "inner"), "1"),
    **dict.fromkeys(("seconds_state", "seconds_adjoint", "seconds_inner", "seconds"), "s"),
}

#: Fields of a design update by name: unit and meaning.
FIELDS = {
    "chi": ("1", "design field chi at the vertices"),
    "pressure": ("N/mm^2", "pressure p at the vertices"),
    "displacement": ("mm", "displacement u at the vertices"),
}

#: Number of the design update -> field -> values at the vertices.
Kept = dict[int, dict[str, NDArray[np.float32]]]


@dataclass(frozen=True)
class Design:
    """A design and its pressurised state, of several load cases that of the first.

    Attributes:
        domain: the meshed design domain.
        chi: design field χ at the vertices, (n_vertices,), dimensionless.
        displacement: u at the 20-node element's nodes, (n_nodes, 3), mm.
        pressure: p at the vertices, (n_vertices,), N/mm².
        arm: T = [T1, T3 (mm), θ2 (rad)], (3,).
    """

    domain: Domain
    chi: Floats
    displacement: Floats
    pressure: Floats
    arm: Floats


@dataclass(frozen=True)
class Result(Design):
    """An optimised design and how it was found.

    Attributes:
        history: one record per accepted design, the first being the initial design; column name -> (n_records,).
        summary: ``C``, ``terms``, ``T1``, ``T3``, ``theta2``, ``p_min``, ``p_max``, ``evaluations``, ``seconds``
            and more.
        checkpoint: what :func:`stages.optimize.run` needs to continue from here, in the units of the computation.
        converged: whether the stationarity measure was reached.
        reason: one sentence saying why the optimisation ended.
        others: states under the load cases after the first, by their names.
        bodies: what the files of regions hold, by the number of the region.
    """

    history: dict[str, Floats]
    summary: dict[str, Any]
    checkpoint: dict[str, Floats]
    converged: bool
    reason: str
    others: Mapping[str, OtherState] = field(default_factory=dict, kw_only=True)
    bodies: Bodies = field(default_factory=dict, kw_only=True)

    def under(self, load_case: str | None) -> Design:
        """The design in its state under a load case; under the first one if None, or if it is none of the others."""
        if load_case is None or load_case not in self.others:
            return self
        return Design(self.domain, self.chi, *self.others[load_case])


class OtherState(NamedTuple):
    """The state of a design under another load case; units and shapes are those of :class:`Design`."""

    displacement: Floats
    pressure: Floats
    arm: Floats

    @classmethod
    def read(cls, source: Source, name: str) -> OtherState:
        """What :func:`pack` has stored of a load case after the first."""
        nodal = source.read(f"nodes/displacement-{name}", f"nodes/pressure-{name}", f"arm-{name}", "vertices/chi")
        displacement, pressure, arm, chi = nodal
        return cls(displacement, pressure[: len(chi)], arm)  # vertices are the first of the nodes


def pack(result: Result, kept: Kept | None = None) -> Packed:
    """Design, state and history.

    Args:
        result: of the optimisation.
        kept: fields of the design updates that VTK readers shall find as time steps.
    """
    from scipy.special import expit  # slow to load: only where there is a design to store

    domain = result.domain
    chi = on_nodes(domain, result.chi)
    datasets = {
        "vertices/chi": Dataset(result.chi, *FIELDS["chi"]),
        "vertices/pressure": Dataset(result.pressure, *FIELDS["pressure"]),
        **nodes(domain, "nodes"),
        "nodes/chi": Dataset(chi, "1", "design field chi; on edges the mean of the ends"),
        "nodes/density": Dataset(expit(chi), "1", "density rho = 1 / (1 + exp(-chi)), Eq. (1)"),
        "nodes/pressure": Dataset(
            on_nodes(domain, result.pressure), "N/mm^2", "pressure p; on edges the mean of the ends"
        ),
        "nodes/displacement": Dataset(result.displacement, "mm", "displacement u"),
        "arm": Dataset(result.arm, "mm, mm, rad", "rigid motion T1, T3, theta2 of the arm's root"),
        **of_domain(domain),
        **_others(result),
        **regions.pack(result.bodies),
        **{
            f"history/{name}": Dataset(column, unit_of_column(name), f"{name} after every design update")
            for name, column in result.history.items()
        },
    }
    names = ("chi", "density", "pressure", "displacement")
    others = tuple(f"{field}-{name}" for name in result.others for field in ("displacement", "pressure"))
    fields = {name: f"/nodes/{name}" for name in (*names, *others)}
    grid = GridPaths("/nodes/points", "/nodes/connectivity", QUADRATIC_HEXAHEDRON, fields)
    if not kept:
        return Packed(result.summary, datasets, grid)
    series = GridPaths(
        "/nodes/points",
        "/updates/connectivity",
        HEXAHEDRON,
        {name: f"/updates/{name}" for name in names},
        times=tuple(map(float, kept)),
        n_points=len(domain.points),
    )
    return Packed(result.summary, datasets | _updates(domain, kept), replace(grid, series=series))


def unit_of_column(name: str) -> str:
    """Of a column of the history; those of a load case have its name behind a point."""
    return HISTORY.get(name.partition(".")[0], "1")


def _others(result: Result) -> dict[str, Dataset]:
    """States under the load cases after the first, at the nodes."""
    found = {}
    for name, state in result.others.items():
        pressure = on_nodes(result.domain, state.pressure)
        found[f"nodes/displacement-{name}"] = Dataset(state.displacement, "mm", f"displacement u, load case {name}")
        found[f"nodes/pressure-{name}"] = Dataset(pressure, "N/mm^2", f"pressure p, load case {name}")
        found[f"arm-{name}"] = Dataset(state.arm, "mm, mm, rad", f"rigid motion T1, T3, theta2, load case {name}")
    return found


def _updates(domain: Domain, kept: Kept) -> dict[str, Dataset]:
    """Fields of the vertices, one update after the other, as VTK reads them."""
    from scipy.special import expit  # as in pack

    flat = {name: np.concatenate([fields[name] for fields in kept.values()]) for name in FIELDS}
    meanings = FIELDS | {"density": ("1", "density rho = 1 / (1 + exp(-chi)), Eq. (1), at the vertices")}
    flat["density"] = expit(flat["chi"])
    return {
        "updates/number": Dataset(np.array(list(kept), dtype=np.int64), "1", "numbers of the design updates kept"),
        "updates/connectivity": corners(domain),
        **{
            f"updates/{name}": Dataset(values, meanings[name][0], f"{meanings[name][1]}, one update after the other")
            for name, values in flat.items()
        },
    }


def lines(design: Mapping[str, Any], rig: RigUnits) -> list[tuple[str, str]]:
    """What a user reads of the summary of an optimisation, with lengths of the case and of the part."""
    return [
        ("ended", design["reason"]),
        ("C0", f"{design['terms']['C0']:.6f}   (total objective C {design['C']:.6f})"),
        ("T3", rig.both_lengths(design["T3"], 4)),
        ("theta2", f"{math.degrees(design['theta2']):.3f} degrees"),
        _arm_end(design, rig),
        *(("load cases" if row == 0 else "", text) for row, text in enumerate(_load_cases(design, rig))),
        *(("constraints" if row == 0 else "", text) for row, text in enumerate(_constraints(design))),
        ("stationarity", f"{design['stationarity']:.1e}"),
        *(("work" if row == 0 else "", text) for row, text in enumerate(_work(design))),
    ]


def _arm_end(design: Mapping[str, Any], rig: RigUnits) -> tuple[str, str]:
    """What the arm's end does: its travel, which is the spring's elongation if there is one, or its force if held."""
    end, travel = design.get("arm_end", "sprung"), rig.both_lengths(design["spring_elongation"], 3)
    if end == "held":
        force = design["spring_force"]
        return "blocked force", f"{abs(force):.4g} N at the arm's end, which the spring holds, of the whole actuator"
    return ("spring elongation" if end == "sprung" else "travel of the arm"), travel


def _load_cases(design: Mapping[str, Any], rig: RigUnits) -> list[str]:
    """What the design does under each of several load cases; that of the lines before is the first."""
    return [
        f"{name}, weight {case['weight']:g}: C0 {case['C0']:.6f}, T3 {rig.both_lengths(case['T3'], 4)}, "
        f"theta2 {math.degrees(case['theta2']):.3f} degrees, travel {rig.both_lengths(case['spring_elongation'], 3)}"
        for name, case in design.get("load_cases", {}).items()
    ]


def _constraints(design: Mapping[str, Any]) -> list[str]:
    """How well the penalised constraints are met, in physical terms."""
    shown = (
        ("wall_leak", "largest p / p_in on the outer wall {:.1e}"),
        ("wall_leak_second_order", "the same with second-order pressure {:.1e}"),
        ("chamber_leak", "pressure off its own at the inlet of a chamber, over p_in {:.1e}"),
        ("energy_ratio", "largest energy density over its limit {:.3f}"),
        ("steepest", "steepest interface over its limit {:.3f}"),
        ("passive_share", "share of the solid in the passive core {:.1e}"),
        ("solid_missing", "share of the solid regions that is void {:.1e}"),
    )
    # Where the second-order check could not be made, its figure is not there.
    return [text.format(design[key]) for key, text in shown if key in design]


def _work(design: Mapping[str, Any]) -> list[str]:
    """What the design cost."""
    work, seconds = design["work"], design["seconds_per_part"]
    return [
        f"{design['updates']} updates, {design['evaluations']} evaluations, {work['factorisations']} factorisations",
        f"{work['newton']} Newton, {work['krylov']} Krylov iterations, {work['inner']} inner steps",
        "seconds: " + ", ".join(f"{part} {time:.1f}" for part, time in seconds.items()),
    ]
