"""The regression guard: counts and errors as good as the committed table, and a guard that notices if they are not."""

from __future__ import annotations

from dataclasses import replace

import numba
import pytest

from benchmarks import guard
from benchmarks.figures import Figure, count, error, ratio, worsened
from benchmarks.guard_model import update_figures
from benchmarks.small_cases import TINY
from benchmarks.tables import RESULTS


@pytest.fixture(autouse=True)
def one_thread() -> None:
    numba.set_num_threads(1)


@pytest.fixture(scope="module")
def committed() -> list[Figure]:
    return guard.committed()


def test_counts_and_errors_are_no_worse_than_committed(committed: list[Figure]) -> None:
    assert worsened(committed, guard.cheap()) == []


@pytest.mark.slow
def test_counts_and_errors_on_the_quick_mesh_are_no_worse_than_committed(committed: list[Figure]) -> None:
    assert worsened(committed, guard.dear()) == []


@pytest.mark.slow
def test_counts_and_errors_hold_for_the_other_direct_solver(committed: list[Figure]) -> None:
    """Its factors round otherwise, and several design updates drive that apart: 30 % more iterations were seen."""
    roomier = [
        replace(figure, allowed=1.35 * figure.value + 1.0) if "design updates" in figure.name else figure
        for figure in committed
    ]
    assert worsened(roomier, guard.cheap("superlu")) == []


def test_counts_do_not_depend_on_the_number_of_threads(committed: list[Figure]) -> None:
    found = list(update_figures(TINY, 4, "auto"))
    numba.set_num_threads(min(2, numba.config.NUMBA_NUM_THREADS))
    assert list(update_figures(TINY, 4, "auto")) == found


@pytest.mark.parametrize("kind", ["count", "error"])
def test_every_figure_of_the_table_fails_if_it_gets_worse(committed: list[Figure], kind: str) -> None:
    figures = [figure for figure in committed if figure.kind == kind]
    assert len(figures) > 10
    for figure in figures:
        assert figure.allowed is not None
        assert worsened(committed, [figure]) == []
        assert worsened(committed, [replace(figure, value=figure.allowed)]) == []
        worse = replace(figure, value=1.01 * figure.allowed + 1e-300)
        (sentence,) = worsened(committed, [worse])
        assert sentence.startswith(f"{figure.name}: {worse.value:.6g}")
        assert f"{figure.value:.6g}" in sentence
        assert worsened(committed, [replace(figure, value=float("nan"))])


def test_a_solver_that_needs_more_iterations_is_noticed(
    committed: list[Figure], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not only the comparison: a preconditioner that is worse shows in the counts that are taken."""
    monkeypatch.setattr("actuator.solve.linearisation.STALE_ITERATIONS", 1)
    found = worsened(committed, update_figures(TINY, 4, "auto"))
    assert any("factorisations" in sentence for sentence in found), found


def test_limits_are_what_the_table_says() -> None:
    assert count("few", 4, "steps").allowed == 5
    assert count("many", 205, "steps").allowed == 226
    assert error("plain", 2e-3).allowed == pytest.approx(3e-3)
    assert error("rounding", 1e-16, rounding=1e-12).allowed == 1e-12
    assert ratio("times", 3.0).allowed is None


def test_times_are_told_but_not_compared() -> None:
    assert worsened([ratio("times", 1.0)], [ratio("times", 100.0)]) == []


def test_figure_that_nobody_committed_is_no_pass() -> None:
    (sentence,) = worsened([], [count("new", 3, "steps")])
    assert "new" in sentence
    assert "make bench" in sentence


def test_table_is_read_as_it_was_written(committed: list[Figure]) -> None:
    for figure in committed:
        row = {key: "" if value is None else str(value) for key, value in figure.row().items()}
        assert Figure.from_row(row) == figure
    names = [figure.name for figure in committed]
    assert len(set(names)) == len(names)
    shown = (RESULTS / "bench.md").read_text(encoding="utf-8")
    assert all(name in shown for name in names)
    assert {figure.kind for figure in committed} == {"count", "error", "ratio"}
