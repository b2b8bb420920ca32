"""C_p as a function of χ with the displacements frozen."""

from __future__ import annotations

import numpy as np
import pytest
from physics import Floats, half_cylinder, halvings, nodal_residuals, parameters, rates, remainders

from actuator.initial_design import initial_design
from actuator.optimiser.leak import FrozenLeak
from actuator.reduced import Evaluation, ReducedObjective

DOMAIN = half_cylinder(2, 2, 3)
CHI = initial_design(DOMAIN.points, 15.0, 3.0)
DIRECTION = np.cos(DOMAIN.points @ [0.25, -0.4, 0.3]) + 0.2 * np.random.default_rng(1).normal(size=CHI.shape)


@pytest.fixture(scope="module")
def reduced() -> ReducedObjective:
    return ReducedObjective(DOMAIN, *parameters(), state_tolerance=1e-11, threads=1)


@pytest.fixture(scope="module")
def evaluation(reduced: ReducedObjective) -> Evaluation:
    return reduced.evaluate(CHI)


@pytest.fixture(scope="module")
def leak(reduced: ReducedObjective, evaluation: Evaluation) -> FrozenLeak:
    """Frozen at displacements well away from rest, so that they count."""
    return FrozenLeak(reduced, 3.0 * evaluation.state.displacement)


def test_equals_the_term_of_the_objective_at_its_own_state(reduced: ReducedObjective, evaluation: Evaluation) -> None:
    point = FrozenLeak(reduced, evaluation.state.displacement)(CHI)
    assert point.value == pytest.approx(evaluation.terms["C_p"], rel=1e-7)
    assert point.p == pytest.approx(evaluation.state.p, rel=1e-6, abs=1e-9)


def test_pressure_solves_darcy_at_the_frozen_displacements(
    reduced: ReducedObjective, leak: FrozenLeak, evaluation: Evaluation
) -> None:
    equilibrium, chi, u = reduced.equilibrium, CHI + DIRECTION, 3.0 * evaluation.state.displacement
    point = leak(chi)
    _, flow = nodal_residuals(equilibrium.geometry, equilibrium.source, equilibrium.coefficients, chi, u, point.p)
    assert np.linalg.norm(flow) < 1e-10 * equilibrium.scales[1]
    assert point.value == pytest.approx(0.5 * point.p @ reduced.leak @ point.p, rel=1e-14)


def test_gradient_and_hessian_product_have_taylor_rates(leak: FrozenLeak) -> None:
    at = leak(CHI)
    product = leak.product(CHI, at, DIRECTION)
    steps = halvings(0.02)
    slope, bend = at.gradient @ DIRECTION, product @ DIRECTION

    def value(h: float) -> float:
        return leak(CHI + h * DIRECTION).value

    def gradient(h: float) -> Floats:
        return leak(CHI + h * DIRECTION).gradient

    assert at.value > 1.0
    assert rates(remainders(value, lambda h: at.value + h * slope, steps)).min() > 1.9
    assert rates(remainders(value, lambda h: at.value + h * slope + 0.5 * h * h * bend, steps)).min() > 2.9
    assert rates(remainders(gradient, lambda h: at.gradient + h * product, steps)).min() > 1.9


def test_hessian_is_symmetric(leak: FrozenLeak) -> None:
    at, other = leak(CHI), np.random.default_rng(3).normal(size=CHI.shape)
    forth = other @ leak.product(CHI, at, DIRECTION)
    assert forth == pytest.approx(DIRECTION @ leak.product(CHI, at, other), rel=1e-8)


def test_displacements_count(reduced: ReducedObjective, leak: FrozenLeak) -> None:
    at_rest = FrozenLeak(reduced, np.zeros_like(DOMAIN.nodes))(CHI).value
    assert abs(leak(CHI).value - at_rest) > 1e-3 * at_rest
