"""Solution paths R(z, λ) = 0 by pseudo-arc-length continuation, past limit points.

A point is predicted along the path's tangent and corrected in the plane normal to it (Riks 1979,
doi:10.1016/0020-7683(79)90081-7); the corrector's two right-hand sides share one tangent (Crisfield 1981,
doi:10.1016/0045-7949(81)90108-5). What z is, how long it is and how its tangent is solved is the problem's business.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from actuator.arrays import Floats
from actuator.failure import SolveFailure

#: Steps grow while the corrector needs fewer iterations than this.
EASY_ITERATIONS = 5
#: A target this much farther than the next step is stepped onto rather than left for a short step of its own.
STRETCH = 1.25
#: How far a corrected point may lie from its prediction, in steps.
LARGEST_CORRECTION = 0.3
#: Part of the largest step down to which steps are cut where the number of negative eigenvalues changes without a
#: limit point, or a limit point comes without such a change: something may have been stepped over.
INSPECTED = 0.05
#: A limit point is located until the load falls or rises this little per arc length.
FLAT = 1e-4
MOST_SECANTS = 8


class PathLost(SolveFailure):
    """The path could not be followed any farther."""


class Problem(Protocol):
    """What is followed: R(z, λ) = 0 with R linear in λ."""

    load_derivative: Floats
    """∂R/∂λ, (n,)."""

    def residual(self, z: Floats, load: float) -> Floats:
        """R, (n,); values that are not finite where the state is not admissible."""

    def norm(self, residual: Floats) -> float:
        """Relative size of a residual; infinite if it is not finite."""

    def linearise(self, z: Floats, load: float, *, fresh: bool) -> None:
        """Prepare solves with ∂R/∂z at z; ``fresh`` asks for a new factorisation and its inertia."""

    def solve(self, right: Floats, tolerance: float, guess: Floats | None = None) -> Floats:
        """Solve ∂R/∂z · dz = right to a relative residual.

        Raises:
            SolveFailure: if that is not reached.
        """

    def inner(self, a: Floats, b: Floats) -> float:
        """Inner product of two changes of z, so measured that a length of one is a large change."""

    def settled(self, z: Floats, load: float) -> Floats:
        """A converged z with what can be polished at no cost polished."""

    def negative_eigenvalues(self) -> int | None:
        """Of the symmetric block of the tangent factorised last; None if the solver does not tell."""


@dataclass(frozen=True)
class Control:
    """How a path is stepped along.

    Attributes:
        first: load factor of the first step.
        least, largest: arc length of a step.
        tolerance: relative residual of a point.
        most_newton: corrections before a step is cut.
        most_points: points of a path.
        least_cosine: between the tangents of successive points; a path that turns faster is stepped in shorter steps.
    """

    first: float = 0.1
    least: float = 1e-4
    largest: float = 0.3
    tolerance: float = 1e-8
    most_newton: int = 10
    most_points: int = 400
    least_cosine: float = 0.9


@dataclass(frozen=True)
class Point:
    """A point of a path.

    Attributes:
        z: solution, (n,).
        load: λ.
        direction, slope: dz/ds, (n,), and dλ/ds, s the arc length.
        newton: corrections it took.
        negative: negative eigenvalues of the tangent's symmetric block; None if not known.
        limit: whether it is a limit point, located until dλ/ds is nearly zero.
    """

    z: Floats
    load: float
    direction: Floats
    slope: float
    newton: int
    negative: int | None
    limit: bool = False

    def reversed(self) -> Point:
        """The same point on the path walked the other way."""
        return replace(self, direction=-self.direction, slope=-self.slope, newton=0)


def begin(problem: Problem, z: Floats, load: float, control: Control, *, upwards: bool = True) -> Point:
    """The first point of a path from an approximate solution at a load that is kept.

    Raises:
        SolveFailure: if there is no solution close to it.
    """
    z, _, newton = correct(problem, z, load, None, control)
    point = _with_tangent(problem, z, load, newton, None)
    return point if (point.slope > 0.0) == upwards else point.reversed()


def follow(
    problem: Problem,
    start: Point,
    last: float,
    control: Control,
    *,
    stops: Sequence[float] = (),
    lowest: float = -np.inf,
) -> Iterator[Point]:
    """Points of a path from a start, which is not repeated, to the load ``last``.

    Loads in ``stops`` and ``last`` are met exactly, as often as the path crosses them. Where dλ/ds changes its sign a
    limit point is put in.

    Args:
        lowest: a path that falls below this load is given up.

    Raises:
        PathLost: if the least step fails, the path falls below ``lowest``, or has too many points.
    """
    here, stops = start, sorted({*stops, last})
    step = control.first / max(abs(start.slope), 1e-3)
    for _ in range(control.most_points):
        step = min(step, control.largest)
        while True:
            try:
                there = _advance(problem, here, step, stops, control)
                break
            except SolveFailure as reason:
                step *= 0.5
                if step < control.least:
                    raise PathLost(
                        f"The path could not be followed beyond a load factor of {here.load:.4g}, not even in steps "
                        f"of {2.0 * step:.1e}: {_lowered(str(reason))}"
                    ) from reason
        if here.slope * there.slope < 0.0:
            found = _located(problem, here, there, control)
            if found:
                yield found
        yield there
        # So many Newton iterations are paid for by so long a step (Crisfield 1981, section 4).
        step *= float(np.clip((EASY_ITERATIONS / max(there.newton, 1)) ** 0.5, 0.5, 2.0))
        here = there
        if here.load == last:
            return
        if here.load < lowest:
            raise PathLost(f"The path fell below a load factor of {lowest:.4g} without reaching {last:.4g}.")
    raise PathLost(f"The path has more than {control.most_points} points up to a load factor of {here.load:.4g}.")


def snap(loads: Sequence[float], at: int) -> tuple[int, float] | None:
    """Where a system under a prescribed load goes from a limit point: the next point of its path at the same load.

    Args:
        loads: λ along the path.
        at: index of a limit point: a maximum where the load was rising, a minimum where it was falling.

    Returns:
        k and t, meaning the point at (1 - t) times point k plus t times point k + 1; None if the path does not come
        back to this load.
    """
    sign = 1.0 if loads[at] >= loads[at - 1] else -1.0
    relative = [sign * (load - loads[at]) for load in loads]
    for k in range(at + 1, len(loads) - 1):
        if relative[k] < 0.0 <= relative[k + 1]:
            return k, relative[k] / (relative[k] - relative[k + 1])
    return None


def _advance(problem: Problem, here: Point, step: float, stops: Sequence[float], control: Control) -> Point:
    """The next point, or the stop in between, checked against having left the path."""
    target = _first_between(stops, here.load, here.load + STRETCH * step * here.slope)
    if target is not None:
        step = (target - here.load) / here.slope
        return _land(problem, here, here.z + step * here.direction, target, step, control)
    z, load = here.z + step * here.direction, here.load + step * here.slope
    found, reached, newton = correct(problem, z, load, here, control)
    target = _first_between(stops, here.load, reached)
    if target is not None:
        share = (target - here.load) / (reached - here.load)
        return _land(problem, here, (1.0 - share) * here.z + share * found, target, step, control)
    return _checked(problem, here, found, reached, newton, (z, load), step, control)


def _land(problem: Problem, here: Point, z: Floats, load: float, step: float, control: Control) -> Point:
    found, _, newton = correct(problem, z, load, None, control)
    return _checked(problem, here, found, load, newton, (z, load), step, control)


def _checked(
    problem: Problem,
    here: Point,
    z: Floats,
    load: float,
    newton: int,
    predicted: tuple[Floats, float],
    step: float,
    control: Control,
) -> Point:
    """A corrected point with its tangent, unless the two say that it may lie on another branch."""
    moved = z - predicted[0]
    if _length(problem, moved, load - predicted[1]) > LARGEST_CORRECTION * step:
        raise SolveFailure("the corrected point lies far from the predicted one.")
    there = _with_tangent(problem, z, load, newton, here)
    if problem.inner(here.direction, there.direction) + here.slope * there.slope < control.least_cosine:
        raise SolveFailure("the path turns sharply.")
    if step > INSPECTED * control.largest and not _explained(here, there):
        raise SolveFailure("the number of negative eigenvalues changes without a limit point.")
    return there


def _explained(here: Point, there: Point) -> bool:
    """Whether the number of negative eigenvalues changes by one at a limit point, and not at all elsewhere."""
    if here.negative is None or there.negative is None:
        return True
    return abs(there.negative - here.negative) == int(here.slope * there.slope < 0.0)


def correct(
    problem: Problem, z: Floats, load: float, normal: Point | None, control: Control
) -> tuple[Floats, float, int]:
    """Newton's method in the plane through (z, λ) normal to a point's tangent, or at fixed λ; returns z, λ, steps.

    The plane passes through the start and the equation of the plane is linear, so every iterate, damped or not,
    stays in it.

    Raises:
        SolveFailure: if it does not converge.
    """
    residual = problem.residual(z, load)
    norm = problem.norm(residual)
    for newton in range(control.most_newton + 1):
        if norm <= control.tolerance:
            return problem.settled(z, load), load, newton
        if not np.isfinite(norm):
            raise SolveFailure("the predicted point is not admissible, as an element would turn inside out.")
        if newton == control.most_newton:
            break
        problem.linearise(z, load, fresh=False)
        # No more digits than the next iterate can use (Eisenstat & Walker 1996).
        dz = problem.solve(-residual, max(min(1e-3, norm), 0.1 * control.tolerance / norm))
        dload = 0.0
        if normal is not None:
            guess = normal.direction / normal.slope if abs(normal.slope) > 0.1 else None
            along = problem.solve(-problem.load_derivative, 1e-5, guess)
            dload = -problem.inner(normal.direction, dz) / (problem.inner(normal.direction, along) + normal.slope)
            dz = dz + dload * along
        share = 1.0
        while True:
            there = z + share * dz
            trial = problem.residual(there, load + share * dload)
            trial_norm = problem.norm(trial)
            if trial_norm <= (1.0 - 1e-4 * share) * norm:
                break
            share *= 0.5
            if share < 0.1:
                raise SolveFailure(f"Newton's method stalled at a relative residual of {norm:.1e}.")
        z, load, residual, norm = there, load + share * dload, trial, trial_norm
    raise SolveFailure(
        f"Newton's method did not converge in {control.most_newton} steps (relative residual {norm:.1e})."
    )


def _with_tangent(problem: Problem, z: Floats, load: float, newton: int, before: Point | None) -> Point:
    """A converged point with the tangent of the path, in the sense of the point before."""
    problem.linearise(z, load, fresh=True)
    along = problem.solve(-problem.load_derivative, 1e-6)
    slope = 1.0 / _length(problem, along, 1.0)
    direction = slope * along
    if before is not None:
        # Towards the new point: where the tangent turns by a right angle the old one alone would not tell.
        moved = z - before.z, load - before.load
        if problem.inner(direction, moved[0]) + slope * moved[1] < 0.0:
            direction, slope = -direction, -slope
    return Point(z, load, direction, slope, newton, problem.negative_eigenvalues())


def _located(problem: Problem, here: Point, there: Point, control: Control) -> Point | None:
    """The limit point between two points by regula falsi (Illinois) on dλ/ds; None if corrections fail at once."""
    low, high = 0.0, _length(problem, there.z - here.z, there.load - here.load)
    at_low, at_high = here.slope, there.slope
    best: Point | None = None
    for _ in range(MOST_SECANTS):
        step = (low * at_high - high * at_low) / (at_high - at_low)
        try:
            z, load, newton = correct(
                problem, here.z + step * here.direction, here.load + step * here.slope, here, control
            )
            found = _with_tangent(problem, z, load, newton, here)
        except SolveFailure:
            break
        if best is None or abs(found.slope) < abs(best.slope):
            best = replace(found, limit=True)
        if abs(found.slope) < FLAT:
            break
        if found.slope * at_low > 0.0:
            low, at_low, at_high = step, found.slope, 0.5 * at_high
        else:
            high, at_high, at_low = step, found.slope, 0.5 * at_low
    return best


def _first_between(stops: Sequence[float], here: float, there: float) -> float | None:
    """The first of the sorted stops behind ``here`` on the way to ``there``, that one included."""
    margin = 1e-12 * max(1.0, abs(here))
    if there > here:
        return next((stop for stop in stops if here + margin < stop <= there), None)
    return next((stop for stop in reversed(stops) if there <= stop < here - margin), None)


def _length(problem: Problem, dz: Floats, dload: float) -> float:
    return float(np.sqrt(problem.inner(dz, dz) + dload**2))


def _lowered(sentence: str) -> str:
    return sentence if sentence.startswith(("Newton", "PARDISO")) else sentence[:1].lower() + sentence[1:]
