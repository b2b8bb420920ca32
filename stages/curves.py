"""The result of a simulation: what is kept of it, and what a user reads of it.

Kept are the curves of every field and the states at the load factors asked for. Read are the figures at p_in, and
whether the optimised state is the one that is reached.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stages.datasets import QUADRATIC_HEXAHEDRON, Dataset, GridPaths, Packed, nodes, on_nodes

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from stages.response import Response

#: Units of the columns of a pressure-displacement curve; the others are numbers without a unit.
UNITS = {"pressure": "N/mm^2", "T1": "mm", "T3": "mm", "theta2": "rad", "elongation": "mm"}

#: Limit points, and changes of stability, that are said one by one.
SHOWN = 6


@dataclass(frozen=True)
class Result:
    """Curves of all fields.

    Attributes:
        responses: by field, as far as they came.
        summary: ``fields`` with one entry per field, ``between_fields``, ``pressure_in`` and ``finished``.
        finished: false if the user interrupted.
    """

    responses: dict[str, Response]
    summary: dict[str, Any]
    finished: bool

    @property
    def curves(self) -> dict[str, dict[str, Floats]]:
        """Columns of every field's curve along its path, (n_points,) each; see :data:`stages.response.COLUMNS`."""
        return {name: response.curves for name, response in self.responses.items()}


def pack(result: Result) -> Packed:
    """Curves of every field, and the stored states on their meshes; no grid if there is no state yet."""
    datasets: dict[str, Dataset] = {}
    grids: dict[str, GridPaths] = {}
    for name, response in result.responses.items():
        for column, values in response.curves.items():
            datasets[f"curves/{name}/{column}"] = Dataset(
                values, UNITS.get(column, "1"), f"{column} along the path, field {name}"
            )
        if any(state.stored for state in response.states.values()):
            stored, grids[name] = _states(name, response)
            datasets |= stored
    if not grids:
        return Packed(result.summary, datasets)
    first, *others = grids
    return Packed(result.summary, datasets, replace(grids[first], others={name: grids[name] for name in others}))


def _states(name: str, response: Response) -> tuple[dict[str, Dataset], GridPaths]:
    domain, at = response.domain, f"{name}/states"
    chosen = {load: state for load, state in sorted(response.states.items()) if state.stored}
    pressure = [on_nodes(domain, state.pressure) for state in chosen.values()]
    datasets = {
        **nodes(domain, at),
        f"{at}/chi": Dataset(on_nodes(domain, response.chi), "1", "density field chi; on edges the mean"),
        f"{at}/pressure": Dataset(np.concatenate(pressure), "N/mm^2", "pressure p, one state after the other"),
        f"{at}/displacement": Dataset(
            np.concatenate([state.displacement for state in chosen.values()]), "mm", "u, one state after the other"
        ),
        f"{at}/load_factor": Dataset(np.array(list(chosen)), "1", "load factors of the states"),
    }
    fields = {field: f"/{at}/{field}" for field in ("chi", "pressure", "displacement")}
    grid = GridPaths(f"/{at}/points", f"/{at}/connectivity", QUADRATIC_HEXAHEDRON, fields, tuple(chosen))
    return datasets, grid


def lines(found: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What a user reads of the summary of a simulation."""
    text = [("at p_in", f"{'T3/mm':>10}{'theta2/deg':>12}{'spring/mm':>11}{'energy':>9}{'leak':>10}")]
    for name, field in found["fields"].items():
        at = field["at_target"]
        if at is None:
            text.append((name, f"not reached; largest load factor {field['largest_load']:.4g}"))
            continue
        moved = f"{at['T3']:10.4f}{math.degrees(at['theta2']):12.4f}{at['elongation']:11.4f}"
        text.append((name, f"{moved}{at['energy_ratio']:9.4f}{at['leak']:10.2e}"))
    for name, field in found["fields"].items():
        text += [(name if row == 0 else "", sentence) for row, sentence in enumerate(sentences(name, field))]
    for name, change in found["between_fields"].items():
        if name in ("T3", "theta2", "elongation"):
            text.append(
                ("thresholding" if name == "T3" else "", f"changes {name} by {100 * change['relative']:+.2f} %")
            )
    return text


def shortfall(found: Mapping[str, Any], path: str) -> str:
    """Which paths were not followed up and down, and why; empty if all were."""
    if not found["finished"]:
        return f"Interrupted; the curves so far are in {path}, run the same command to compute them to the end."
    ended = [f"{name}: {entry['ended']}" for name, entry in found["fields"].items() if not entry["complete"]]
    return f"The curves are in {path} as far as they go. {' '.join(ended)}" if ended else ""


def sentences(name: str, field: Mapping[str, Any]) -> list[str]:
    """What a summary says of a field, besides its figures at p_in."""
    meant = "the optimised state" if name == "density" else "the state found directly"
    difference = field["difference"]
    said = []
    if difference:
        figures = ", ".join(f"{key} {value:.1e}" for key, value in difference.items())
        answer = "is reached" if field["reached"] else "is NOT the one that is reached"
        said.append(f"{meant} {answer} (relative differences: {figures})")
    elif field["at_target"]:
        said.append("no state was found directly to compare with")
    if field["limit_points"]:
        said += [_limit(limit) for limit in field["limit_points"][:SHOWN]]
        if (more := len(field["limit_points"]) - SHOWN) > 0:
            said.append(f"and {more} more limit points")
    else:
        said.append(f"no limit point up to a load factor of {field['largest_load']:.4g}")
    for change in [change for change in field["instabilities"] if not change["at_limit_point"]][:SHOWN]:
        (low, high), (before, after) = change["load_factors"], change["negative_eigenvalues"]
        said.append(f"between {low:.4g} and {high:.4g} the negative eigenvalues change from {before} to {after}")
    if field["hysteresis"]:
        said.append(f"up and down differ by {max(field['hysteresis'].values()):.1e} of the largest value")
    if field["ended"]:
        said.append(field["ended"])
    return said


def _limit(limit: Mapping[str, Any]) -> str:
    way = "up" if limit["loading"] else "down"
    text = f"limit point, a {limit['kind']}, at a load factor of {limit['load_factor']:.5g} on the way {way}"
    jump = limit["jump_to"]
    return text if jump is None else f"{text}: T3 would jump from {limit['T3']:.4f} to {jump['T3']:.4f} mm"
