"""The model that a design update minimises: exact at its centre, and exact in what it has been taught."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from physics import Floats, halvings, rates, remainders
from small_case import metric_of, small_objective, start_of

from actuator.optimiser.curvature import Curvature
from actuator.optimiser.model import SMALLEST_LESSON, Model
from actuator.reduced import Evaluation, Gradient, Product, ReducedObjective


@dataclass(frozen=True)
class Centre:
    """An evaluated design, a direction, and the exact response to it."""

    objective: ReducedObjective
    at: Evaluation
    gradient: Gradient
    direction: Floats
    product: Product

    def model(self, lessons: int = 0) -> tuple[Model, Curvature]:
        """A model of its own, taught arbitrary pairs."""
        curvature = Curvature(metric_of(self.objective))
        rng = np.random.default_rng(7)
        for _ in range(lessons):
            curvature.learn(*rng.normal(size=(2, len(self.at.chi))))
        return Model(self.objective, self.at, self.gradient, curvature), curvature


@pytest.fixture(scope="module")
def centre() -> Centre:
    objective = small_objective(tolerance=1e-11, strain_limit=0.03)
    points = objective.domain.points
    at = objective.evaluate(start_of(objective.domain))
    gradient = objective.gradient(at)
    direction = np.cos(points @ [0.25, -0.4, 0.3]) + 0.1 * np.random.default_rng(1).normal(size=len(points))
    return Centre(objective, at, gradient, direction, objective.product(at, gradient, direction, 1e-10))


def test_every_term_is_active(centre: Centre) -> None:
    assert min(abs(value) for value in centre.at.terms.values()) > 1e-6, centre.at.terms


@pytest.mark.parametrize("lessons", [0, 3])
def test_value_and_gradient_are_exact_at_the_centre(centre: Centre, lessons: int) -> None:
    model, _ = centre.model(lessons)
    point, terms = model(np.zeros_like(centre.at.chi)), centre.at.terms
    exact = centre.gradient.total
    assert point.value == pytest.approx(centre.at.value - terms["C0"] - terms["C_psi"], rel=1e-9)
    assert np.abs(point.gradient - exact).max() <= 1e-12 * np.abs(exact).max()


def test_gradient_is_the_derivative_of_the_value_and_product_that_of_the_gradient(centre: Centre) -> None:
    model, _ = centre.model(lessons=3)
    base, d = 0.3 * np.sin(centre.objective.domain.points @ [0.1, 0.3, -0.2]), centre.direction
    start = model(base)
    product = model.product(start, d)

    def smooth(h: float) -> Floats:
        """Gradient without the χ-only terms: C_χ has kinks in its second derivative."""
        point = model(base + h * d)
        return point.gradient - point.design.gradient

    slope, steps = start.gradient @ d, halvings(0.02)
    found = remainders(lambda h: model(base + h * d).value, lambda h: start.value + h * slope, steps)
    assert rates(found).min() > 1.9
    first = start.gradient - start.design.gradient
    assert rates(remainders(smooth, lambda h: first + h * product, steps)).min() > 1.9
    # The product counts: without it the remainder is of first order.
    assert rates(remainders(smooth, lambda h: first, steps)).max() < 1.5


@pytest.mark.parametrize("lessons", [0, 3])
def test_lesson_makes_the_curvature_along_a_step_the_true_one(centre: Centre, lessons: int) -> None:
    model, _ = centre.model(lessons)
    d, exact = centre.direction, centre.product.hessian

    def modelled() -> Floats:
        point = model(np.zeros_like(d))
        return model.product(point, d) + centre.objective.design_product(centre.at, d)

    before = modelled()
    error = model.learn(d, centre.product)
    assert error == pytest.approx(abs(0.5 * d @ (exact - before)), rel=1e-8)
    assert error > 1e-3 * abs(d @ exact)
    assert np.abs(modelled() - exact).max() < 1e-10 * np.abs(exact).max()
    assert model.learn(d, centre.product) < 1e-10 * error


def test_accepted_design_gives_the_model_the_gradient_found_there(centre: Centre) -> None:
    model, _ = centre.model(lessons=3)
    delta = 0.05 * centre.direction
    new = centre.objective.evaluate(centre.at.chi + delta, (centre.at.state.x, centre.at.state.p))
    gradient = centre.objective.gradient(new)
    scale = np.abs(gradient.total).max()
    assert np.abs(model(delta).gradient - gradient.total).max() > 1e-3 * scale
    model.learn_from(new, gradient)
    assert np.abs(model(delta).gradient - gradient.total).max() < 1e-10 * scale


def test_tiny_step_teaches_nothing(centre: Centre) -> None:
    model, curvature = centre.model()
    delta = 0.5 * SMALLEST_LESSON / np.abs(centre.direction).max() * centre.direction
    new = centre.objective.evaluate(centre.at.chi + delta, (centre.at.state.x, centre.at.state.p))
    model.learn_from(new, centre.objective.gradient(new))
    assert len(curvature.arrays()["directions"]) == 0


def test_prediction_errs_in_second_order_only(centre: Centre) -> None:
    model, _ = centre.model()
    at, d = centre.at, centre.direction
    dx, steps = centre.product.dx, halvings(0.02)
    slope = centre.gradient.total @ d
    errors, pressures, changes = [], [], []
    for h in steps:
        true = centre.objective.evaluate(at.chi + h * d, (at.state.x, at.state.p))
        predicted = model.predict(h * d, h * dx)
        assert predicted is not None
        change, p = predicted
        errors.append(change - (true.value - at.value))
        pressures.append(float(np.linalg.norm(p - true.state.p)))
        changes.append(true.value - at.value)
    assert rates(errors).min() > 1.9
    assert rates(pressures).min() > 1.9
    assert changes[-1] == pytest.approx(steps[-1] * slope, rel=0.2)


def test_prediction_is_exact_where_nothing_moves(centre: Centre) -> None:
    model, _ = centre.model()
    predicted = model.predict(np.zeros_like(centre.at.chi), np.zeros_like(centre.at.state.x))
    assert predicted is not None
    assert abs(predicted[0]) < 1e-8 * centre.at.value
    assert predicted[1] == pytest.approx(centre.at.state.p, rel=1e-6, abs=1e-9)


def test_prediction_refuses_an_inverted_element(centre: Centre) -> None:
    model, _ = centre.model()
    assert model.predict(np.zeros_like(centre.at.chi), -30.0 * centre.at.state.x) is None
