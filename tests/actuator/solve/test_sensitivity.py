"""The linear response of the displacements to a change of the design."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from exact_product import TINY
from physics import Floats
from small_case import small_objective, start_of

from actuator.solve import sensitivity as module
from actuator.solve.reduced import ReducedObjective
from actuator.solve.sensitivity import Sensitivity
from actuator.solve.state import State


@dataclass(frozen=True)
class Case:
    """A state of the initial design, and a direction to change it in."""

    objective: ReducedObjective
    state: State
    direction: Floats

    def sensitivity(self) -> Sensitivity:
        return Sensitivity(self.objective.equilibrium, self.state)


@pytest.fixture(scope="module")
def case() -> Case:
    objective = small_objective(tolerance=1e-11)
    points = objective.domain.points
    state = objective.equilibrium.solve(start_of(objective.domain))
    direction = np.cos(points @ [0.25, -0.4, 0.3]) + 0.1 * np.random.default_rng(1).normal(size=len(points))
    return Case(objective, state, direction)


def test_response_is_that_of_the_coupled_tangent(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    """Against a Krylov solve to rounding: two sweeps are close, more are exact."""
    equilibrium, state = case.objective.equilibrium, case.state
    rx, rp, _, _ = equilibrium.residual(state.chi + 1j * TINY * case.direction, state.x, state.p)
    exact, _ = equilibrium.linearise(state).solve(-rx.imag / TINY, -rp.imag / TINY, 1e-11)
    errors = []
    for sweeps in (1, 2, 8):
        monkeypatch.setattr(module, "SWEEPS", sweeps)
        errors.append(float(np.abs(case.sensitivity() @ case.direction - exact).max() / np.abs(exact).max()))
    assert errors[1] < 0.1 * errors[0]
    assert errors[1] < 1e-2
    assert errors[2] < 1e-5  # the factors are of single precision


def test_state_moves_as_the_map_says(case: Case) -> None:
    """Against Newton's method at two neighbouring designs."""
    equilibrium, state, step = case.objective.equilibrium, case.state, 1e-4
    after, before = (equilibrium.solve(state.chi + s * case.direction, (state.x, state.p)).x for s in (step, -step))
    moved = (after - before) / (2.0 * step)
    assert np.abs(case.sensitivity() @ case.direction - moved).max() < 3e-2 * np.abs(moved).max()


@pytest.mark.parametrize("sweeps", [1, 2, 3])
def test_transpose_is_exact_for_any_number_of_sweeps(case: Case, sweeps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "SWEEPS", sweeps)
    found, force = case.sensitivity(), np.random.default_rng(2).normal(size=len(case.state.x))
    dx = found @ case.direction
    difference = force @ dx - found.transposed(force) @ case.direction
    assert abs(difference) < 1e-6 * np.linalg.norm(force) * np.linalg.norm(dx)  # factors of single precision
