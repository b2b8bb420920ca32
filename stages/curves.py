"""The result of a simulation: what is kept of it, and what a user reads of it.

Kept are the curve and the states at the load factors asked for. Read are the figures at p_in, and whether the optimised
state is the one that is reached.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from stages.datasets import QUADRATIC_HEXAHEDRON, Dataset, GridPaths, Packed, nodes, on_nodes

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from stages.response import Response
    from stages.rig import RigUnits

#: Units of the columns of a pressure-displacement curve; the others are numbers without a unit.
UNITS = {"pressure": "N/mm^2", "T1": "mm", "T3": "mm", "theta2": "rad", "elongation": "mm"}

#: Limit points, and changes of stability, that are said one by one.
SHOWN = 6


@dataclass(frozen=True)
class Result:
    """A curve.

    Attributes:
        response: as far as it came.
        summary: see :func:`stages.response.summarised`, with ``finished``.
        finished: false if the user interrupted.
    """

    response: Response
    summary: dict[str, Any]
    finished: bool

    @property
    def curves(self) -> dict[str, Floats]:
        """Columns along the path, (n_points,) each; see :data:`stages.response.COLUMNS`."""
        return self.response.curves


def pack(result: Result) -> Packed:
    """The curve, and the stored states on their mesh; no grid if there is no state yet."""
    datasets = {
        f"curves/{column}": Dataset(values, UNITS.get(column, "1"), f"{column} along the path")
        for column, values in result.curves.items()
    }
    chosen = {load: state for load, state in sorted(result.response.states.items()) if state.stored}
    if not chosen:
        return Packed(result.summary, datasets)
    domain = result.response.domain
    pressure = [on_nodes(domain, state.pressure) for state in chosen.values()]
    chi = on_nodes(domain, result.response.chi)
    datasets |= {
        **nodes(domain, "states"),
        "states/chi": Dataset(chi, "1", "density field chi; on edges the mean"),
        "states/pressure": Dataset(np.concatenate(pressure), "N/mm^2", "pressure p, one state after the other"),
        "states/displacement": Dataset(
            np.concatenate([state.displacement for state in chosen.values()]), "mm", "u, one state after the other"
        ),
        "states/load_factor": Dataset(np.array(list(chosen)), "1", "load factors of the states"),
    }
    fields = {field: f"/states/{field}" for field in ("chi", "pressure", "displacement")}
    grid = GridPaths("/states/points", "/states/connectivity", QUADRATIC_HEXAHEDRON, fields, tuple(chosen))
    return Packed(result.summary, datasets, grid)


def lines(found: Mapping[str, Any], rig: RigUnits) -> list[tuple[str, str]]:
    """What a user reads of the summary of a simulation, with lengths of the case and of the part."""
    text = [("at p_in", f"{'T3/mm':>10}{'theta2/deg':>12}{'travel/mm':>11}{'energy':>9}{'leak':>10}")]
    if at := found["at_target"]:
        moved = f"{at['T3']:10.4f}{math.degrees(at['theta2']):12.4f}{at['elongation']:11.4f}"
        text.append(("density", f"{moved}{at['energy_ratio']:9.4f}{at['leak']:10.2e}"))
        if rig.scale != 1.0:
            text.append(("of the part", f"{rig.millimetres(at['T3']):10.4f}{rig.millimetres(at['elongation']):23.4f}"))
    else:
        text.append(("density", f"not reached; largest load factor {found['largest_load']:.4g}"))
    return text + [("", sentence) for sentence in sentences(found, rig)]


def shortfall(found: Mapping[str, Any], path: str) -> str:
    """That the path was not followed up and down, and why; empty if it was."""
    if not found["finished"]:
        return f"Interrupted; the curve so far is in {path}, run the same command to compute it to the end."
    return "" if found["complete"] else f"The curve is in {path} as far as it goes. {found['ended']}"


def sentences(found: Mapping[str, Any], rig: RigUnits) -> list[str]:
    """What a summary says besides the figures at p_in."""
    said = []
    if found["difference"]:
        figures = ", ".join(f"{key} {value:.1e}" for key, value in found["difference"].items())
        answer = "is reached" if found["reached"] else "is NOT the one that is reached"
        said.append(f"the optimised state {answer} (relative differences: {figures})")
    if found["limit_points"]:
        said += [_limit(limit, rig) for limit in found["limit_points"][:SHOWN]]
        if (more := len(found["limit_points"]) - SHOWN) > 0:
            said.append(f"and {more} more limit points")
    else:
        said.append(f"no limit point up to a load factor of {found['largest_load']:.4g}")
    for change in [change for change in found["instabilities"] if not change["at_limit_point"]][:SHOWN]:
        (low, high), (before, after) = change["load_factors"], change["negative_eigenvalues"]
        said.append(f"between {low:.4g} and {high:.4g} the negative eigenvalues change from {before} to {after}")
    if found["hysteresis"]:
        said.append(f"up and down differ by {max(found['hysteresis'].values()):.1e} of the largest value")
    if found["ended"]:
        said.append(found["ended"])
    return said


def _limit(limit: Mapping[str, Any], rig: RigUnits) -> str:
    way = "up" if limit["loading"] else "down"
    text = f"limit point, a {limit['kind']}, at a load factor of {limit['load_factor']:.5g} on the way {way}"
    jump = limit["jump_to"]
    if jump is None:
        return text
    return f"{text}: T3 would jump from {limit['T3']:.4f} mm to {rig.both_lengths(jump['T3'], 4)}"
