"""The model that a design update minimises: exact to second order at its centre, and exact in its own derivatives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from exact_product import hessian_product
from physics import Floats, halvings, rates, remainders
from small_case import small_objective, start_of

from actuator.optimiser.model import Model, ModelPoint
from actuator.solve import sensitivity as sensitivity_module
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from actuator.solve.sensitivity import Sensitivity


@dataclass(frozen=True)
class Centre:
    """An evaluated design, and a direction."""

    objective: ReducedObjective
    at: Evaluation
    gradient: Gradient
    direction: Floats

    def model(self) -> tuple[Model, Sensitivity]:
        model = Model(self.objective, self.at, self.gradient)
        return model, model.sensitivity


def centre_of(**changes: float) -> Centre:
    objective = small_objective(tolerance=1e-11, **changes)
    points = objective.domain.points
    at = objective.evaluate(start_of(objective.domain))
    direction = np.cos(points @ [0.25, -0.4, 0.3]) + 0.1 * np.random.default_rng(1).normal(size=len(points))
    return Centre(objective, at, objective.gradient(at), direction)


@pytest.fixture(scope="module")
def centre() -> Centre:
    return centre_of(strain_limit=0.03)


def point_of(model: Model, delta: Floats, dx: Floats) -> ModelPoint:
    point = model(delta, dx)
    assert point is not None
    return point


def physics_bend(model: Model, at: Floats, at_dx: Floats, direction: Floats, dx: Floats, step: float = 1e-4) -> Floats:
    """Second derivative of the model without the χ-only terms along a direction, by central differences."""
    ends = [point_of(model, at + h * direction, at_dx + h * dx) for h in (step, -step)]
    forth, back = (model.gradient(end) - end.design.gradient for end in ends)
    return np.asarray((forth - back) / (2.0 * step))


def test_every_term_is_active(centre: Centre) -> None:
    assert min(abs(value) for value in centre.at.terms.values()) > 1e-9, centre.at.terms


@pytest.mark.parametrize(("sweeps", "error"), [(1, 2e-2), (2, 1e-3)])
def test_value_gradient_and_hessian_are_exact_at_the_centre(
    centre: Centre, sweeps: int, error: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Value and gradient with any S; the Hessian as far as S is."""
    monkeypatch.setattr(sensitivity_module, "SWEEPS", sweeps)
    model, _ = centre.model()
    start = model.start()
    assert start.value == pytest.approx(centre.at.value, rel=1e-9)
    exact = centre.gradient.total
    assert np.abs(model.gradient(start) - exact).max() < 1e-6 * np.abs(exact).max()
    # With single precision factors and few sweeps, against Krylov solves with the coupled tangent.
    hessian = hessian_product(centre.objective, centre.at, centre.gradient, centre.direction).hessian
    d, upper = centre.direction, centre.objective.design.gather.matrix(start.design.hessian)
    of_design = upper @ d + upper.T @ d - upper.diagonal() * d
    found = physics_bend(model, 0.0 * d, 0.0 * start.dx, d, model.sensitivity @ d) + of_design
    assert np.abs(found - hessian).max() < error * np.abs(hessian).max()


def test_model_follows_the_objective_to_second_order(centre: Centre, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error along a direction is of third order; without the adjoint's correction it would be of second."""
    monkeypatch.setattr(sensitivity_module, "SWEEPS", 3)
    model, sensitivity = centre.model()
    d, at = centre.direction, centre.at
    dx, steps = sensitivity @ d, halvings(0.02)
    true = [centre.objective.evaluate(at.chi + h * d, (at.state.x, at.state.p)).value for h in steps]
    model, _ = centre.model()
    errors = [point_of(model, h * d, h * dx).value - value for h, value in zip(steps, true, strict=True)]
    assert rates(errors).min() > 2.5
    plain = [true[i] - at.value - h * (centre.gradient.total @ d) for i, h in enumerate(steps)]
    assert abs(errors[0]) < 0.3 * abs(plain[0])


def test_gradient_is_the_derivative_of_the_value(centre: Centre) -> None:
    model, sensitivity = centre.model()
    base, d = 0.1 * np.sin(centre.objective.domain.points @ [0.1, 0.3, -0.2]), centre.direction
    base_dx, dx = sensitivity @ base, sensitivity @ d
    start = point_of(model, base, base_dx)
    slope = model.gradient(start) @ d
    errors = remainders(
        lambda h: point_of(model, base + h * d, base_dx + h * dx).value,
        lambda h: start.value + h * slope,
        halvings(0.02),
    )
    assert rates(errors).min() > 1.9


def test_hessian_is_symmetric(centre: Centre) -> None:
    model, sensitivity = centre.model()
    d, other = centre.direction, np.random.default_rng(3).normal(size=len(centre.direction))
    base, base_dx = 0.05 * d, sensitivity @ (0.05 * d)
    forth = other @ physics_bend(model, base, base_dx, d, sensitivity @ d)
    back = d @ physics_bend(model, base, base_dx, other, sensitivity @ other)
    assert forth == pytest.approx(back, rel=1e-3)


def test_pressure_is_that_of_the_predicted_state(centre: Centre) -> None:
    model, sensitivity = centre.model()
    delta = 0.1 * centre.direction
    point = point_of(model, delta, sensitivity @ delta)
    flow = centre.objective.equilibrium.flow_residual(point.chi, point.x, point.p)
    assert np.linalg.norm(flow) < 1e-10 * centre.objective.equilibrium.scales[1]


def test_inverted_element_is_refused(centre: Centre) -> None:
    model, _ = centre.model()
    assert model(np.zeros_like(centre.at.chi), -30.0 * centre.at.state.x) is None


def test_correction_brings_the_model_to_the_true_objective(centre: Centre) -> None:
    """One step of Newton's method at a predicted state, where the prediction has lost its way."""
    model, sensitivity = centre.model()
    d, at = 0.05 * centre.direction, centre.at
    predicted = point_of(model, d, sensitivity @ d)
    corrected = model.corrected(predicted)
    assert corrected is not None
    assert corrected.delta is predicted.delta
    assert np.linalg.norm(corrected.force) < 0.1 * np.linalg.norm(predicted.force)
    true = centre.objective.evaluate(at.chi + d, (corrected.x, corrected.p))
    assert abs(corrected.value - true.value) < 0.3 * abs(predicted.value - true.value)
    assert np.linalg.norm(corrected.x - true.state.x) < 0.1 * np.linalg.norm(predicted.x - true.state.x)


@pytest.mark.parametrize(("strain_limit", "leak_weight", "leaks"), [(0.03, 1e6, False), (0.14, 1e9, True)])
def test_diagonal_is_what_holding_the_state_leaves_plus_the_leak(
    strain_limit: float, leak_weight: float, leaks: bool
) -> None:
    """Against finite differences of the gradient and of the pressure, one vertex after the other."""
    centre = centre_of(strain_limit=strain_limit, leak_weight=leak_weight)
    model, _ = centre.model()
    start = model.start()
    model.gradient(start)
    found = model.diagonal(start)
    objective, h = centre.objective, 1e-5

    def held(chi: Floats) -> Floats:
        assert start.flow_adjoint is not None
        adjoint = centre.gradient.adjoint[0]
        return objective.derivatives(chi, start.x, start.p, adjoint, start.flow_adjoint, start.tip)[0]

    state_held = np.abs(held(start.chi + h) - held(start.chi - h)) / (2.0 * h)
    leak, matrix = np.empty(len(start.chi)), objective.total.cases[0].leak.matrix
    for vertex, unit in enumerate(np.eye(len(start.chi))):
        ahead, behind = (objective.equilibrium.pressure(start.chi + e * unit, start.x) for e in (h, -h))
        dp = (ahead - behind) / (2.0 * h)
        leak[vertex] = dp @ (matrix @ dp)
    assert (leak.max() > 0.1 * state_held.max()) == leaks
    exact = state_held + leak
    # The leak's part is estimated with 32 probes and the wall's mass lumped.
    large = exact > 1e-2 * exact.max()
    assert (found > 0.3 * exact)[large].all()
    assert (found < 3.0 * exact)[large].all()
    assert np.median(np.abs(found - exact)[large] / exact[large]) < (0.4 if leaks else 1e-4)
