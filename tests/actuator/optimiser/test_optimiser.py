"""The outer loop: every update lowers the objective, and a run does not depend on where it was interrupted."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from physics import Floats, half_cylinder
from small_case import metric_of, small_objective, start_of

from actuator.failure import SolveFailure
from actuator.optimiser.inner import InnerStep
from actuator.optimiser.loop import Optimiser, Outcome, Progress
from actuator.optimiser.model import Model
from actuator.optimiser.stationarity import stationarity
from actuator.solve.equilibrium import NoState
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from actuator.terms import PAPER

UPDATES = 4
#: Half the layers of :func:`small_case.small_domain` and fewer cells in each; the initial design still reaches into the
#: passive core.
DOMAIN = half_cylinder(2, 2, 2)


def objective_of(tolerance: float = 1e-8) -> ReducedObjective:
    return small_objective(DOMAIN, tolerance)


def optimiser(**options: float) -> Optimiser:
    return Optimiser(objective_of(), **options)


def begun(**options: float) -> tuple[Optimiser, Progress]:
    loop = optimiser(**options)
    return loop, loop.begin(start_of(loop.objective.domain))


@dataclass(frozen=True)
class Run:
    """A run of :data:`UPDATES` updates, and each design on its way."""

    outcome: Outcome
    designs: list[Floats]

    @property
    def progress(self) -> Progress:
        return self.outcome.progress

    def column(self, key: str) -> Floats:
        return np.array([record[key] for record in self.progress.history])


def whole_run() -> Run:
    loop, progress = begun()
    designs = [progress.evaluation.chi]
    outcome = loop.run(progress, UPDATES, lambda reached: designs.append(reached.evaluation.chi))
    return Run(outcome, designs)


@pytest.fixture(scope="module")
def run() -> Run:
    return whole_run()


# ----------------------------------------------------------------------------------------------- the updates


def test_objective_falls_with_every_update(run: Run) -> None:
    assert len(run.designs) == len(run.progress.history) == UPDATES + 1
    assert (np.diff(run.column("C")) < 0.0).all()
    # The initial design reaches into the passive core; that is mended first.
    assert run.column("C_chi")[0] > 1e4
    assert run.column("C_chi")[-1] < 1e-2
    assert run.column("C")[-1] < 1e-3 * run.column("C")[0]


def test_every_record_is_a_fresh_evaluation_of_its_design(run: Run) -> None:
    objective = objective_of(1e-10)
    metric = metric_of(objective)
    for record, chi in zip(run.progress.history, run.designs, strict=True):
        at = objective.evaluate(chi)
        for term in PAPER:
            assert record[term] == pytest.approx(at.terms[term], rel=1e-5, abs=1e-9), term
        assert record["C"] == pytest.approx(sum(record[term] for term in PAPER), rel=1e-12)
        assert [record["T1"], record["T3"], record["theta2"]] == pytest.approx(at.state.arm, rel=1e-5)
        assert record["energy_ratio"] == pytest.approx(at.measures["energy_ratio"], rel=1e-5)
        assert record["steepest"] == pytest.approx(at.measures["steepest"], rel=1e-12)
        measure = stationarity(at, objective.gradient(at), metric)
        assert record["stationarity"] == pytest.approx(measure, rel=1e-2)


def test_progress_is_that_of_the_last_design(run: Run) -> None:
    last = run.progress.evaluation
    assert np.array_equal(last.chi, run.designs[-1])
    assert last.value == run.column("C")[-1]
    objective = objective_of(1e-10)
    exact = objective.gradient(objective.evaluate(last.chi)).total
    # The adjoint's tolerance is relative to a load that the wall's response to pressure makes large.
    assert np.abs(run.progress.gradient.total - exact).max() < 3e-2 * np.abs(exact).max()


def test_counts_only_grow(run: Run) -> None:
    np.testing.assert_array_equal(run.column("update"), np.arange(UPDATES + 1))
    for key in ("evaluations", "krylov", "inner", "seconds"):
        assert (np.diff(run.column(key)) > 0.0).all(), key
    # A state that was predicted well enough needs no Newton step, and old factors may serve.
    for key in ("newton", "factorisations"):
        assert (np.diff(run.column(key)) >= 0.0).all(), key
    assert run.progress.evaluations == run.column("evaluations")[-1]


# ---------------------------------------------------------------------------------- the same again, and going on


def test_same_run_twice_ends_in_the_same_place(run: Run) -> None:
    again = whole_run()
    np.testing.assert_allclose(again.column("C"), run.column("C"), rtol=1e-10)
    for first, second in zip(run.designs, again.designs, strict=True):
        np.testing.assert_allclose(second, first, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("made", [0, 2, 3])
def test_interrupted_run_goes_on_as_if_nothing_had_happened(made: int, run: Run, tmp_path: Path) -> None:
    first, progress = begun()
    first.run(progress, made)
    np.savez(tmp_path / "checkpoint.npz", **first.checkpoint(progress))
    with np.load(tmp_path / "checkpoint.npz") as arrays:
        second = optimiser()
        resumed = second.resume(dict(arrays))
    assert len(resumed.history) == made + 1
    assert resumed.dt == progress.dt
    second.run(resumed, UPDATES)
    np.testing.assert_array_equal([r["C"] for r in resumed.history], run.column("C"))
    np.testing.assert_array_equal(resumed.evaluation.chi, run.designs[-1])
    assert resumed.dt == run.progress.dt
    assert resumed.evaluations == run.progress.evaluations
    for key in ("inner", "krylov"):
        np.testing.assert_array_equal([r[key] for r in resumed.history], run.column(key), key)
    for key in ("factorisations", "seconds"):
        assert (np.diff([r[key] for r in resumed.history]) >= 0.0).all(), key


def test_number_of_threads_makes_no_difference(run: Run) -> None:
    """Bit by bit, whatever is shared out."""
    loop = Optimiser(small_objective(DOMAIN, threads=2))
    progress = loop.begin(start_of(DOMAIN))
    loop.run(progress, UPDATES)
    np.testing.assert_array_equal(progress.evaluation.chi, run.designs[-1])


# -------------------------------------------------------------------------------------------------- the ends


def test_no_updates_only_evaluate() -> None:
    loop, progress = begun()
    outcome = loop.run(progress, 0)
    assert not outcome.converged
    assert "0 design updates" in outcome.reason
    assert loop.objective.equilibrium.work.states == progress.evaluations == len(progress.history) == 1
    assert np.array_equal(progress.evaluation.chi, start_of(loop.objective.domain))


def test_limit_of_updates_is_the_reason(run: Run) -> None:
    assert not run.outcome.converged
    assert f"{UPDATES} design updates" in run.outcome.reason


def test_run_ends_where_updates_gain_little(run: Run) -> None:
    """Five updates are looked at, so that fewer never end a run; one that has ended stays ended."""
    loop, progress = begun(least_gain=0.9)
    outcome = loop.run(progress, 20)
    values = [record["C"] for record in progress.history]
    gains = [(values[i] - values[i + 5]) / abs(values[i + 5]) for i in range(len(values) - 5)]
    assert gains[-1] < 0.9
    assert all(gain >= 0.9 for gain in gains[:-1])
    assert not outcome.converged
    assert outcome.reason.startswith("The last 5 design updates lowered C by less than 90 % of it; the measure is")
    assert run.column("C") == pytest.approx(values[: UPDATES + 1], rel=1e-12)
    assert loop.run(progress, 20).progress.evaluations == progress.evaluations


def test_stationary_design_is_left_alone() -> None:
    loop, progress = begun(tolerance=1e6)
    outcome = loop.run(progress, UPDATES)
    assert outcome.converged
    assert "stationary" in outcome.reason
    assert len(progress.history) == 1


def test_run_ends_once_the_measure_is_reached(run: Run) -> None:
    tolerance = 0.5 * sum(sorted(run.column("stationarity"))[:2])
    loop, progress = begun(tolerance=tolerance)
    outcome = loop.run(progress, UPDATES)
    assert outcome.converged
    assert progress.history[-1]["stationarity"] <= tolerance
    assert all(record["stationarity"] > tolerance for record in progress.history[:-1])


# --------------------------------------------------------------------------------------------- refused steps


@pytest.mark.parametrize("failure", ["no state", "no gain", "no adjoint"])
def test_refused_step_shortens_the_time_step_and_leaves_a_sound_run(
    failure: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first candidate has no state, or turns out to be worse than promised, or its adjoint cannot be solved for."""
    loop, progress = begun()
    evaluate, gradient, tried = loop.objective.evaluate, loop.objective.gradient, []

    def spoilt(chi: Floats, start: tuple[Floats, Floats] | None = None) -> Evaluation:
        tried.append(chi)
        if len(tried) > 1 or failure == "no adjoint":
            return evaluate(chi, start)
        if failure == "no state":
            raise NoState("Newton's method stalled.")
        return replace(progress.evaluation, chi=chi)

    def unsolved(at: Evaluation, guess: tuple[Floats, Floats] | None = None) -> Gradient:
        if len(tried) == 1 and failure == "no adjoint":
            raise SolveFailure("A coupled linear solve stopped.")
        return gradient(at, guess)

    monkeypatch.setattr(loop.objective, "evaluate", spoilt)
    monkeypatch.setattr(loop.objective, "gradient", unsolved)
    initial = progress.evaluation
    loop.run(progress, 2)
    assert progress.evaluations == len(progress.history) + 1
    assert progress.history[1]["dt"] < loop.first_step
    first, second = (np.abs(chi - initial.chi).max() for chi in tried[:2])
    assert second < first
    values = [record["C"] for record in progress.history]
    assert values[0] > values[1] > values[2]
    fresh = objective_of().evaluate(progress.evaluation.chi)
    assert fresh.value == pytest.approx(values[-1], rel=1e-5)


def test_model_is_that_of_the_last_design_again_after_a_refusal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method at the refused design has moved tangent and factors, which the model's S works with."""
    loop, progress = begun()
    evaluate, solve, answers = loop.objective.evaluate, loop._inner.solve, []
    direction = np.cos(loop.objective.domain.points @ [0.25, -0.4, 0.3])

    def refused_once(chi: Floats, start: tuple[Floats, Floats] | None = None) -> Evaluation:
        found = evaluate(chi, start)
        return replace(progress.evaluation, chi=chi) if len(answers) == 1 else found

    def observed(model: Model, *arguments: Any) -> InnerStep:
        answers.append(model.sensitivity @ direction)
        return solve(model, *arguments)

    monkeypatch.setattr(loop.objective, "evaluate", refused_once)
    monkeypatch.setattr(loop._inner, "solve", observed)
    loop.run(progress, 1)
    assert len(answers) == 2
    np.testing.assert_array_equal(answers[1], answers[0])


def test_run_that_finds_no_step_says_so_and_keeps_its_design(run: Run) -> None:
    """Δt is already below what is worth trying."""
    loop, progress = begun()
    arrays = loop.checkpoint(progress)
    before, record = progress.evaluation, dict(progress.history[-1])
    progress.dt = 1e-12 * loop.first_step
    outcome = loop.run(progress, UPDATES)
    assert not outcome.converged
    assert "No smaller step" in outcome.reason
    assert progress.evaluation is before
    assert progress.history == [record]
    # From the checkpoint, with its own Δt, everything goes on.
    resumed = loop.resume(arrays)
    loop.run(resumed, 1)
    assert resumed.history[1]["C"] == pytest.approx(run.column("C")[1], rel=1e-8)
