"""Interior point bounds: the solution that scipy finds, in few Newton steps, rigid or soft, from inside or beyond."""

from __future__ import annotations

import numpy as np
import pytest
from physics import Floats
from scipy.optimize import lsq_linear, minimize

from actuator.optimiser.barrier import Barrier, Bounds

N = 60


def problem(seed: int) -> tuple[Floats, Floats, Floats]:
    """Root R of a quadratic ½‖R s − b‖², b, and the room d of s ≤ d, which half of the free solution exceeds."""
    rng = np.random.default_rng(seed)
    root, b = rng.standard_normal((N, N)) + 4.0 * np.eye(N), rng.standard_normal(N)
    return root, b, np.linalg.solve(root, b) + 0.3 * rng.standard_normal(N)


def below(room: Floats, compliance: float = 0.0) -> Bounds:
    """s ≤ room at each unknown, on dense matrices in place of upper triangles."""
    return Bounds(room, np.ones(N), compliance, lambda s: s, lambda force: force, lambda sigma: np.diag(sigma))


def above(low: float) -> Bounds:
    """The same from the other side: s ≥ low."""
    room = np.full(N, -low)
    return Bounds(room, np.ones(N), 0.0, lambda s: -s, lambda force: -force, lambda sigma: np.diag(sigma))


def solved(root: Floats, b: Floats, *bounds: Bounds, most: int = 25) -> Floats:
    s, barrier = np.zeros(N), Barrier(bounds, 1e-2)
    for _ in range(most):
        matrix = root.T @ root + barrier.linearise(s)
        force = root.T @ (root @ s - b)
        free = -np.linalg.solve(matrix, force + barrier.push())
        step = -np.linalg.solve(matrix, force + barrier.push(free))
        length = barrier.longest(step)
        barrier.move(length)
        s = s + length * step
        if barrier.gap < 1e-12:
            return s
    raise AssertionError(f"not solved in {most} steps: the gap is {barrier.gap:.1e}")


@pytest.mark.parametrize("seed", range(5))
def test_rigid_bounds_from_inside_and_from_beyond(seed: int) -> None:
    root, b, room = problem(seed)
    assert (room < 0.0).any(), "s = 0 must lie beyond some of them"
    expected = lsq_linear(root, b, (-np.inf, room), method="bvls", tol=1e-14).x
    s = solved(root, b, below(room))
    assert (np.abs(expected - room) < 1e-9).sum() > 10, "many must hold"
    np.testing.assert_allclose(s, expected, atol=1e-6)
    assert (s <= room + 1e-9).all()


def test_soft_bounds_give_way_as_their_penalty_does() -> None:
    root, b, room = problem(1)
    weight = 50.0

    def penalised(s: Floats) -> tuple[float, Floats]:
        rest, over = root @ s - b, np.maximum(s - room, 0.0)
        return 0.5 * float(rest @ rest + weight * over @ over), root.T @ rest + weight * over

    expected = minimize(penalised, np.zeros(N), jac=True, method="BFGS", options={"gtol": 1e-10}).x
    s = solved(root, b, below(room, 1.0 / weight))
    np.testing.assert_allclose(s, expected, atol=1e-6)
    assert (s - room).max() > 1e-2, "some must be exceeded"


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("low", [-np.inf, -0.05])
def test_last_step_tells_which_bounds_are_met(seed: int, low: float) -> None:
    root, b, room = problem(seed)
    room = room if np.isinf(low) else np.maximum(room, 0.01)
    exact = lsq_linear(root, b, (np.full(N, low), room), method="bvls", tol=1e-14).x
    sets = [below(room)] if np.isinf(low) else [below(room), above(low)]
    expected = [np.abs(exact - bound) < 1e-9 for bound in (room, low)[: len(sets)]]
    s, barrier, told = np.zeros(N), Barrier(sets, 1e-2), []
    while barrier.gap > 1e-9:
        matrix, force = root.T @ root + barrier.linearise(s), root.T @ (root @ s - b)
        step = -np.linalg.solve(matrix, force + barrier.push(-np.linalg.solve(matrix, force + barrier.push())))
        length = barrier.longest(step)
        barrier.move(length)
        s = s + length * step
        told.append(barrier.met(len(sets)))
    assert told[-1] is not None
    np.testing.assert_array_equal(told[-1], expected)
    assert told[0] is None or not np.array_equal(told[0], expected), "it is not known from the start"


def test_short_step_tells_nothing() -> None:
    root, b, room = problem(0)
    barrier = Barrier([below(room)], 1e-2)
    matrix, force = root.T @ root + barrier.linearise(np.zeros(N)), -root.T @ b
    barrier.longest(-np.linalg.solve(matrix, force + barrier.push()))
    barrier.move(0.1)
    assert barrier.met(1) is None


def test_two_sets_of_bounds() -> None:
    root, b, room = problem(2)
    low = np.full(N, -0.05)
    room = np.maximum(room, 0.01)
    expected = lsq_linear(root, b, (low, room), method="bvls", tol=1e-14).x
    np.testing.assert_allclose(solved(root, b, below(room), above(-0.05)), expected, atol=1e-6)


def test_steps_do_not_grow_with_the_scale_of_the_problem() -> None:
    root, b, room = problem(3)
    expected = solved(root, b, below(room))
    np.testing.assert_allclose(solved(1e-3 * root, 1e-3 * b, below(room), most=30), expected, atol=1e-4)
