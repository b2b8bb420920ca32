"""Stage `optimize` as a Python function: settings in, events on the way, result out."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from actuator.failure import SolveFailure
from actuator.terms import PAPER
from stages.domains import HalfCylinderSettings
from stages.events import DesignUpdate, Event, Message
from stages.optimize import Compute, OptimizerSettings, Result, Settings, run
from stages.settings import LoadSettings

COMPUTE = Compute(threads=1)
UPDATES = 3
RESULTS = {"C", "terms", "T1", "T3", "theta2", "p_min", "p_max", "evaluations", "seconds"}


def settings(updates: int = UPDATES, **changes: Any) -> Settings:
    domain = HalfCylinderSettings(core_cells=2, rings=2, layers=2)
    return Settings(domain=domain, optimizer=OptimizerSettings(max_updates=updates), **changes)


@pytest.fixture(scope="module")
def observed() -> tuple[Result, list[Event]]:
    events: list[Event] = []
    return run(settings(), compute=COMPUTE, observer=events.append), events


@pytest.fixture(scope="module")
def result(observed: tuple[Result, list[Event]]) -> Result:
    return observed[0]


def test_events_tell_of_every_design_in_turn(observed: tuple[Result, list[Event]]) -> None:
    result, events = observed
    assert isinstance(events[0], Message)
    updates = [event for event in events if isinstance(event, DesignUpdate)]
    assert events[1:] == updates
    assert [update.record["update"] for update in updates] == list(range(UPDATES + 1))
    assert {update.updates_limit for update in updates} == {UPDATES}
    for key, column in result.history.items():
        np.testing.assert_array_equal([update.record[key] for update in updates], column, err_msg=key)


def test_two_threads_find_the_same_design_bit_by_bit(result: Result) -> None:
    again = run(settings(), compute=Compute(threads=2))
    np.testing.assert_array_equal(again.chi, result.chi)
    np.testing.assert_array_equal(again.history["C"], result.history["C"])


def test_fields_have_the_shapes_that_are_promised(result: Result) -> None:
    domain = result.domain
    assert result.chi.shape == result.pressure.shape == (domain.mesh.nvertices,)
    assert result.displacement.shape == domain.nodes.shape
    assert result.arm.shape == (3,)
    assert {column.shape for column in result.history.values()} == {(UPDATES + 1,)}
    assert {"C", *PAPER} <= set(result.history)
    assert all(np.isfinite(column).all() for column in result.history.values())


def test_displacements_meet_the_supports_and_the_rigid_arm(result: Result) -> None:
    """u = 0 at X1 = 0, u2 = 0 on X2 = 0, and at X1 = L the rigid motion of T."""
    X, u = result.domain.nodes, result.displacement
    T1, T3, angle = result.arm
    length = result.domain.length
    assert np.abs(u[X[:, 0] == 0.0]).max() == 0.0
    assert np.abs(u[X[:, 1] == 0.0, 1]).max() == 0.0
    end = np.isclose(X[:, 0], length)
    assert end.any()
    assert u[end, 1] == pytest.approx(0.0, abs=1e-12)
    # Distances between nodes of the end stay as they were, and it is turned by θ2.
    moved, there = X[end] + u[end], X[end]
    assert np.linalg.norm(moved - moved[0], axis=1) == pytest.approx(np.linalg.norm(there - there[0], axis=1))
    top, bottom = there[:, 2].argmax(), there[:, 2].argmin()
    across = moved[top] - moved[bottom]
    assert abs(np.arctan2(across[0], across[2])) == pytest.approx(abs(angle), rel=1e-8)
    assert np.abs(u[end, 0]).max() > 0.5 * abs(T1)
    assert np.isfinite(T3)


def test_summary_is_that_of_the_last_design(result: Result) -> None:
    summary, history = result.summary, result.history
    assert set(summary) >= RESULTS
    assert set(summary["terms"]) == set(PAPER)
    for key in ("C", "T1", "T3", "theta2", "stationarity", "energy_ratio", "steepest", "evaluations"):
        assert summary[key] == pytest.approx(history[key][-1], rel=1e-12), key
    assert summary["C"] == pytest.approx(sum(summary["terms"].values()), rel=1e-12)
    assert [summary["T1"], summary["T3"], summary["theta2"]] == list(result.arm)
    assert (summary["p_min"], summary["p_max"]) == (result.pressure.min(), result.pressure.max())
    pressure = 2e-2 * 2.736
    assert summary["wall_leak"] == pytest.approx(result.pressure[result.domain.outside.vertices].max() / pressure)
    # The arm's end moves by T3 and by the arm's length times the sine of its slope; positive downwards.
    assert summary["spring_elongation"] == pytest.approx(60.0 * np.sin(summary["theta2"]) - summary["T3"], rel=1e-12)
    assert summary["updates"] == UPDATES
    assert summary["seconds"] > 0.0
    assert summary["reason"] == result.reason
    assert not result.converged


def test_result_starts_from_the_paper_and_goes_down(result: Result) -> None:
    before = run(settings(0), compute=COMPUTE)
    start = before.domain.initial_design(before.domain.points, 3.0)
    assert np.array_equal(before.chi, start)
    assert before.history["C"] == pytest.approx(result.history["C"][:1], rel=1e-10)
    assert (np.diff(result.history["C"]) < 0.0).all()


def test_longer_run_continues_from_the_checkpoint_of_a_shorter_one(result: Result) -> None:
    events: list[Event] = []
    shorter = run(settings(1), compute=COMPUTE)
    longer = run(settings(), compute=COMPUTE, observer=events.append, resume=shorter.checkpoint)
    assert any(isinstance(event, Message) and "after design update 1" in event.text for event in events)
    updates = [event.record["update"] for event in events if isinstance(event, DesignUpdate)]
    assert updates == list(range(1, UPDATES + 1))
    np.testing.assert_allclose(longer.history["C"], result.history["C"], rtol=1e-8)
    np.testing.assert_allclose(longer.chi, result.chi, rtol=0.0, atol=1e-6)
    assert longer.summary["evaluations"] == result.summary["evaluations"]


def test_checkpoint_of_an_event_is_as_good_as_that_of_the_result(result: Result) -> None:
    kept: list[dict[str, Any]] = []

    def observer(event: Event) -> None:
        if isinstance(event, DesignUpdate) and event.record["update"] == 2.0:
            kept.append({key: value.copy() for key, value in event.checkpoint().items()})

    run(settings(), compute=COMPUTE, observer=observer)
    longer = run(settings(), compute=COMPUTE, resume=kept[0])
    np.testing.assert_allclose(longer.chi, result.chi, rtol=0.0, atol=1e-6)


def test_finished_run_is_returned_as_it_is(result: Result) -> None:
    again = run(settings(), compute=COMPUTE, resume=result.checkpoint)
    assert np.array_equal(again.chi, result.chi)
    assert again.summary["evaluations"] == result.summary["evaluations"]
    assert again.summary["C"] == pytest.approx(result.summary["C"], rel=1e-12)


def test_case_without_pressure_stays_at_rest() -> None:
    at_rest = run(settings(1, load=LoadSettings(pressure_ratio=0.0)), compute=COMPUTE)
    assert np.abs(at_rest.displacement).max() < 1e-12
    assert at_rest.summary["terms"]["C0"] == pytest.approx(0.0, abs=1e-12)
    assert at_rest.summary["terms"]["C_p"] == 0.0
    assert at_rest.history["C"][1] < at_rest.history["C"][0]


def test_design_that_bears_no_load_is_a_failure_with_a_remedy() -> None:
    with pytest.raises(SolveFailure, match=r"take (a )?smaller|lower load\.pressure_ratio"):
        run(settings(0, load=LoadSettings(pressure_ratio=1e6)), compute=COMPUTE)
