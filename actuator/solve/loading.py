"""A state at the full pressure by way of smaller ones, where Newton's method from rest does not find it.

The steps are taken at fixed pressures and not along the path's arc: on a design of soft material the path bends back
wherever a few elements of void fold, and a step across such a place is what is wanted, not every turn of it.
"""

from __future__ import annotations

from collections.abc import Callable

from actuator.arrays import Floats
from actuator.failure import SolveFailure
from actuator.solve.equilibrium import Equilibrium, NoState
from actuator.solve.path import Control, correct
from actuator.solve.pressurisation import Pressurisation
from actuator.solve.state import State

#: First and least step of the load factor; how steps grow after one that went well. Chosen: a state that takes shorter
#: steps than the least lies beyond a limit point, where shorter ones do not help either.
FIRST, LEAST, GROW = 0.25, 1.0 / 128.0, 1.5
#: Newton steps at each pressure: more than along a path, whose points lie closer.
MOST_NEWTON = 15


def loaded(equilibrium: Equilibrium, chi: Floats, reached: Callable[[float], None]) -> State:
    """The state of a design at p_in, its pressure raised from zero in steps that adapt.

    Args:
        equilibrium: state equations at p_in, which must not be zero.
        chi: design, (n_vertices,).
        reached: is told every load factor at which there is a state.

    Raises:
        NoState: if p_in is not reached, with the part of it that was.
    """
    problem = Pressurisation(equilibrium, chi)
    control = Control(tolerance=equilibrium.tolerance, most_newton=MOST_NEWTON)
    before, here, load, step = None, problem.rest, 0.0, FIRST
    while load < 1.0:
        target = min(1.0, load + step)
        starts = [here]
        if before is not None:  # a straight line through the last two states
            starts.insert(0, here + (target - load) / (load - before[1]) * (here - before[0]))
        found, failure = None, ""
        for start in starts:
            try:
                found, _, _ = correct(problem, start, target, None, control)
                break
            except SolveFailure as reason:
                failure = str(reason)
        if found is None:
            step = 0.5 * (target - load)
            if step < LEAST:
                raise NoState(
                    f"The first design has no state at p_in: its pressure could be raised from zero to {load:.0%} of "
                    f"it, and no farther ({failure.rstrip('.')}). Begin with a thicker wall (initial.wall) or with "
                    "another design (initial.file), raise material.hessian_regularisation, or lower "
                    "load.pressure_ratio to what is reached."
                )
            continue
        before, here, load, step = (here, load), found, target, GROW * step
        reached(load)
    return equilibrium.solve(chi, (here[: problem.size], here[problem.size :]))
