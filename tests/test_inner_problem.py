"""The inner problem: the step that minimises model plus step term, without any mechanical solve."""

from __future__ import annotations

import numpy as np
import pytest
from small_case import metric_of, small_objective, start_of

from actuator.optimiser.curvature import Curvature
from actuator.optimiser.inner import InnerProblem
from actuator.optimiser.metric import Metric
from actuator.optimiser.model import Model
from actuator.reduced import Evaluation, Gradient, ReducedObjective

STEPS = [0.1, 1.0, 10.0, 30.0]


@pytest.fixture(scope="module")
def objective() -> ReducedObjective:
    return small_objective()


@pytest.fixture(scope="module")
def metric(objective: ReducedObjective) -> Metric:
    return metric_of(objective)


@pytest.fixture(scope="module")
def start(objective: ReducedObjective) -> tuple[Evaluation, Gradient]:
    at = objective.evaluate(start_of(objective.domain))
    return at, objective.gradient(at)


@pytest.fixture
def model(objective: ReducedObjective, metric: Metric, start: tuple[Evaluation, Gradient]) -> Model:
    """Around the initial design, and not taught anything yet."""
    return Model(objective, *start, Curvature(metric))


@pytest.fixture(scope="module")
def inner(objective: ReducedObjective, metric: Metric) -> InnerProblem:
    return InnerProblem(objective, metric)


@pytest.mark.parametrize("dt", STEPS)
def test_solution_is_stationary(inner: InnerProblem, model: Model, metric: Metric, dt: float) -> None:
    step = inner.solve(model, dt, tolerance=1e-5)
    first, last = model(np.zeros(metric.size)), model(step.delta)
    left = metric.dual_norm(last.gradient + metric @ step.delta / dt**2)
    assert metric.dual_norm(first.gradient) > 1e3 * metric.dual_norm(model.linear)
    assert left < 1e-2 * metric.dual_norm(model.linear)


@pytest.mark.parametrize("dt", [*STEPS, 100.0, 1000.0, 1e4])
def test_step_says_what_it_does(inner: InnerProblem, model: Model, metric: Metric, dt: float) -> None:
    step = inner.solve(model, dt)
    change = model(step.delta).value - model(np.zeros(metric.size)).value
    assert step.change == pytest.approx(change, rel=1e-9)
    assert step.step_term == pytest.approx(metric.norm(step.delta) ** 2 / (2.0 * dt**2), rel=1e-9)
    assert step.change + step.step_term < 0.0


def test_smaller_time_step_gives_a_smaller_step(inner: InnerProblem, model: Model, metric: Metric) -> None:
    steps = [inner.solve(model, dt, tolerance=1e-5) for dt in STEPS]
    assert (np.diff([metric.norm(step.delta) for step in steps]) > 0.0).all()
    assert (np.diff([step.change for step in steps]) < 0.0).all()


def test_short_step_is_steepest_descent_in_the_metric(inner: InnerProblem, model: Model, metric: Metric) -> None:
    dt = 1e-6
    step = inner.solve(model, dt, tolerance=1e-9)
    expected = -(dt**2) * metric.solve(model(np.zeros(metric.size)).gradient)
    assert np.abs(step.delta - expected).max() < 1e-4 * np.abs(expected).max()


def test_violated_passive_core_is_left_at_once(
    inner: InnerProblem, model: Model, start: tuple[Evaluation, Gradient]
) -> None:
    at, _ = start
    assert at.terms["C_chi"] > 1e4
    step = inner.solve(model, 100.0)
    assert model.design(step.delta).passive < 1e-6 * at.terms["C_chi"]
    assert step.change < -at.terms["C_chi"]


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_model_never_increases_however_concave_it_is(
    inner: InnerProblem, objective: ReducedObjective, metric: Metric, model: Model, seed: int, size: float
) -> None:
    """Taught any curvature, also one that is negative along some directions."""
    rng = np.random.default_rng(seed)
    curvature = Curvature(metric)
    for sign in (-1.0, 1.0, -1.0):
        d = metric.solve(rng.normal(size=metric.size))
        curvature.learn(d, sign * size * (metric @ d))
    at = objective.evaluate(start_of(objective.domain))
    bent = Model(objective, at, objective.gradient(at), curvature)
    for dt in (1.0, 100.0):
        step = inner.solve(bent, dt)
        assert step.change + step.step_term < 0.0
        assert np.isfinite(step.delta).all()


def test_no_state_is_solved_for(inner: InnerProblem, objective: ReducedObjective, model: Model) -> None:
    work = objective.equilibrium.work
    before = work.states, work.factorisations, work.krylov
    inner.solve(model, 10.0)
    assert (work.states, work.factorisations, work.krylov) == before
    assert work.darcy_factorisations > 0
