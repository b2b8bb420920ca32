"""The inner problem: the step that minimises model plus step term, without any mechanical factorisation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from small_case import metric_of, small_objective, start_of

from actuator.optimiser.controls import CONTROLS
from actuator.optimiser.inner import InnerProblem, Trust, _adapted, _Landing
from actuator.optimiser.model import Model, ModelPoint
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from actuator.terms.step import Metric

STEPS = [0.1, 0.3, 1.0, 3.0]
PLENTY = 400


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
def model(objective: ReducedObjective, start: tuple[Evaluation, Gradient]) -> Model:
    """Around the initial design, whose passive core is violated."""
    return Model(objective, *start)


@pytest.fixture
def inner(objective: ReducedObjective, metric: Metric) -> InnerProblem:
    return InnerProblem(objective, metric)


def step_term(metric: Metric, point: ModelPoint, dt: float) -> float:
    return metric.norm(point.delta) ** 2 / (2.0 * dt**2)


@pytest.mark.parametrize("dt", STEPS)
def test_solution_is_nearly_stationary(objective: ReducedObjective, model: Model, metric: Metric, dt: float) -> None:
    """As far as the model holds: where a step is so long that its displacements drift, it ends before."""
    first = metric.dual_norm(model.gradient(model.start()))
    patient = replace(CONTROLS, worthless_gain=1e-9, negligible_gain=1e-6, subproblem_gain=1e-3)
    step = InnerProblem(objective, metric, patient).solve(model, dt, PLENTY)
    left = metric.dual_norm(model.gradient(step.point) + metric @ step.point.delta / dt**2)
    assert left < 1e-3 * first


@pytest.mark.parametrize("dt", [*STEPS, 100.0, 1000.0, 1e4])
@pytest.mark.parametrize("most", [1, 5, 60])
def test_step_says_what_it_does(inner: InnerProblem, model: Model, metric: Metric, dt: float, most: int) -> None:
    step = inner.solve(model, dt, most)
    assert len(step.trail) <= step.steps <= most
    assert step.start.value == model.start().value
    values = [step.start.value, *(point.value + step_term(metric, point, dt) for point in step.trail)]
    assert len(values) > 1
    assert (np.diff(values) < 0.0).all()
    assert step.change(step.point) == step.point.value - step.start.value


def test_smaller_time_step_gives_a_smaller_step(inner: InnerProblem, model: Model, metric: Metric) -> None:
    steps = [inner.solve(model, dt, PLENTY) for dt in STEPS]
    assert (np.diff([metric.norm(step.point.delta) for step in steps]) > 0.0).all()
    assert (np.diff([step.change(step.point) for step in steps]) < 0.0).all()


@pytest.fixture
def mended(objective: ReducedObjective, inner: InnerProblem, model: Model) -> Model:
    """Around a design whose passive core is void."""
    point = inner.solve(model, 100.0, 60).point
    at = objective.evaluate(point.chi, (point.x, point.p))
    assert at.terms["C_chi"] < 1e-3
    return Model(objective, at, objective.gradient(at))


def test_more_steps_find_a_lower_point(inner: InnerProblem, mended: Model, metric: Metric) -> None:
    totals = []
    for most in (1, 60):
        point = inner.solve(mended, 300.0, most).point
        totals.append(point.value + step_term(metric, point, 300.0))
    assert totals[1] < totals[0]


def test_short_step_is_steepest_descent_in_the_metric(inner: InnerProblem, model: Model, metric: Metric) -> None:
    dt = 1e-6
    step = inner.solve(model, dt, PLENTY)
    expected = -(dt**2) * metric.solve(model.gradient(model.start()))
    assert np.abs(step.point.delta - expected).max() < 1e-2 * np.abs(expected).max()


def test_violated_passive_core_is_what_a_step_mends(
    inner: InnerProblem, model: Model, start: tuple[Evaluation, Gradient]
) -> None:
    at, _ = start
    assert at.terms["C_chi"] > 1e4
    step = inner.solve(model, 100.0, 60)
    mended = at.terms["C_chi"] - step.point.design.terms["C_chi"].value
    assert mended > 0.3 * at.terms["C_chi"]
    assert step.change(step.point) == pytest.approx(-mended, rel=1e-3)


def test_displacements_of_the_solution_are_corrected(
    inner: InnerProblem, mended: Model, objective: ReducedObjective
) -> None:
    """They are closer to the true state than the linear prediction."""
    point = inner.solve(mended, 0.3, 30).point
    predicted = mended(point.delta, mended.sensitivity @ point.delta)
    assert predicted is not None
    assert np.linalg.norm(point.force) < 0.1 * np.linalg.norm(predicted.force)


def test_no_state_is_solved_for(inner: InnerProblem, objective: ReducedObjective, model: Model) -> None:
    work = objective.equilibrium.work
    before = work.states, work.factorisations, work.krylov
    inner.solve(model, 10.0, 60)
    assert (work.states, work.factorisations, work.krylov) == before
    assert work.darcy_factorisations > 0


def test_trust_falls_even_where_the_displacements_drift(
    inner: InnerProblem, model: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step of which little could be taken ends the inner problem; the next must not promise the same again."""
    whole = inner.solve(model, 1e4, 60)
    point = whole.trail[0]
    landing = _Landing(point, length=0.06, quality=0.05, drifted=True)
    monkeypatch.setattr(InnerProblem, "_land", lambda *_: landing)
    step = inner.solve(model, 1e4, 60, trust=Trust(stiffness=1e-2, reach=0.5))
    assert step.trail == (point,)
    assert step.trust.stiffness > 1e-2
    assert step.trust.reach < 0.1 * 0.5


@pytest.mark.parametrize(
    ("length", "quality", "stiffness", "reach"),
    [(0.0, 0.0, 2.0, 0.2), (0.4, 0.9, 2.0, 0.08), (1.0, 0.1, 2.0, 0.5), (1.0, 0.5, 1.0, 0.5), (1.0, 1.0, 0.5, 0.5)],
)
def test_trust_follows_the_quality_of_a_step(
    length: float, quality: float, stiffness: float, reach: float, model: Model
) -> None:
    """Of a step of 0.2: stiffer where it was cut short or brought little, softer where it brought what it promised."""
    landing = _Landing(model.start() if length else None, length, quality)
    found = _adapted(Trust(stiffness=1.0, reach=0.5), landing, 0.2, CONTROLS)
    assert found.stiffness == pytest.approx(stiffness)
    assert found.reach == pytest.approx(reach)


def test_curvature_is_that_of_the_model_along_its_steps(inner: InnerProblem, mended: Model) -> None:
    """Of each step the curvature keeps the change of the physics' gradient."""
    curvature = inner.blank()
    step = inner.solve(mended, 100.0, 3, curvature)
    last, before = step.trail[-1], step.trail[-2] if len(step.trail) > 1 else step.start
    s = last.delta - before.delta
    y = mended.gradient(last) - last.design.gradient - mended.gradient(before) + before.design.gradient
    assert curvature.pairs.shape == (2, len(step.trail), len(s))
    np.testing.assert_allclose(curvature.pairs[:, -1], [s, y], rtol=1e-9, atol=1e-12 * np.abs(y).max())
