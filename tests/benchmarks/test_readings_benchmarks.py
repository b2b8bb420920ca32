"""The benchmarks of what the paper leaves open: initial designs, and the elements of p."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import pressure_elements, readings
from pipeline.case.changes import changed
from pipeline.case.model import Case, find_case, read_case
from stages.settings import ProblemSettings


@pytest.fixture(scope="module")
def case() -> Case:
    shipped = read_case(find_case(Path("case14.yaml")))[0]
    return changed(shipped, {"domain.core_cells": 2, "domain.rings": 1, "domain.layers": 3})


def test_a_shift_of_chi_makes_the_limit_stricter(case: Case) -> None:
    """And the limit of 11 % is (14 / 11)² as strict as that of 14 %."""
    rows = list(readings.rows_of(case, "fitted", 1e-6))
    assert [row["shift"] for row in rows] == list(readings.SHIFTS)
    wide, narrow = ([float(str(row[f"max Ψ/Ψ_lim, {limit} %"])) for row in rows] for limit in (14, 11))
    assert 0.0 < wide[0] < wide[1] < wide[2] < wide[3]
    assert narrow == pytest.approx([(14.0 / 11.0) ** 2 * each for each in wide])
    other = next(readings.rows_of(case, "fitted", 1e-5))
    assert abs(float(str(other["T3 [mm]"]))) < abs(float(str(rows[0]["T3 [mm]"]))), "c_r holds back"


def test_a_reading_without_a_state_has_an_empty_row(case: Case) -> None:
    soft = changed(case, {"load.pressure_ratio": 3.0})
    rows = list(readings.rows_of(soft, "plain", 0.0))
    assert len(rows) == 1
    assert rows[0]["C0"] is None


def test_all_elements_see_the_same_leak_on_average(case: Case) -> None:
    """A wall that lets air through is no matter of elements; those of a tight one are."""
    rows = list(pressure_elements.rows(ProblemSettings(), (6, 2, 9)))
    assert {row["elements of p"] for row in rows} == {"fitted", "summed", "plain", "20 nodes"}
    assert all(float(str(row["largest p / p_in"])) < 1.05 for row in rows)
    whole, thinner, thinnest = (
        {str(row["elements of p"]): float(str(row["C_p"])) for row in rows if row["wall"] == wall}
        for wall in pressure_elements.WALLS
    )
    assert all(whole[kind] < thinner[kind] < thinnest[kind] for kind in whole)
