"""The solution of a subproblem on its active constraints: from an interior point to the last digits.

An interior point stops short of the walls, here by 1e-8 of χ or less. C does not feel that, but its gradient does: C_χ
is so steep that a design pressed against it with its whole force is no farther than that beyond its bound. So once the
active set is identified, it is kept and corrected (primal-dual active set method, Hintermüller, Ito & Kunisch 2002,
doi:10.1137/S1052623401383558), which solves the subproblem to the last digits.
"""

from __future__ import annotations

import numpy as np

from actuator.arrays import Bools, Floats, Ints
from actuator.optimiser.controls import Controls
from actuator.optimiser.proposal import Proposal, Task
from actuator.optimiser.quadratic import Inverse


def on_bound(
    task: Task, inverse: Inverse, s: Floats, met: Bools | Ints, best: Proposal, controls: Controls
) -> Proposal | None:
    """From a step s to the solution, with C_χ exact at the points that touch a bound of it.

    Args:
        s: an interior point.
        met: the points that seem to, (n_cells, n_q); -1 at a lower bound.
        best: what the solution has to come up to, and each step nearly.

    Returns:
        None if the set of points does not settle on one.
    """
    design, physics, bound = task.design, task.physics, task.design.bound
    assert bound is not None, "only what touches the bound comes here"
    steep, (rise, fall) = bound.weight, bound.rooms(task.chi)
    bent, there = physics.bent(s), design.smooth(task.chi + s)
    for _ in range(controls.max_corrections):
        wall: Floats = np.where(met, steep, 0.0)
        room = rise if fall is None else np.where(met > 0, rise, -fall)
        force = physics.linear + bent + there.gradient + design.from_points(wall * (design.points.at(s) - room))
        p = -inverse(there.hessian + design.point_stiffness(wall), physics)(force)
        s = s + p
        if float(np.abs(s).max()) > task.reach:
            return None
        bent, there = bent + physics.bent(p), design.smooth(task.chi + s)
        found = task.proposal(s, bent, there.value)
        if found.change > (1.0 - controls.negligible_gain) * best.change:
            return None
        before, met = met, bound.beyond(design.points.at(s), rise, fall)
        if np.array_equal(met, before):
            return found if found.change < best.change + task.rounding else None
    return None
