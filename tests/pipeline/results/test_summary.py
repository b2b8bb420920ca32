"""Numbers and lines shown to the user."""

from __future__ import annotations

import math

import pytest

from pipeline.results.wording import byte_size, duration
from pipeline.runs.growing_table import LOAD_COLUMNS, UPDATES, Table


def test_rows_stand_below_their_heading() -> None:
    record = {name: -1.0e-3 for name in ("C", "C0", "C_chi", "C_A", "C_i", "C_p", "C_psi", "dt")}
    line = UPDATES.row(record | {"update": 12, "seconds": 1234.5})
    assert len(line) == len(UPDATES.heading())
    assert line.split()[0] == "12"
    assert line.endswith("1234.5")


@pytest.mark.parametrize("value", [0.50757, -20.50757, 123456.789, -7.5e9, 7.25e-120, -1.25e300, math.nan, -math.inf])
def test_columns_never_touch(value: float) -> None:
    """Whatever the size of a case: its numbers have so many digits as there is room for."""
    for table in (UPDATES, Table(LOAD_COLUMNS)):
        for width in (None, 60, 80):
            heading = table.heading(width)
            line = table.row(dict.fromkeys(table.columns, value), width)
            assert len(line) == len(heading) <= (width or 1000)
            assert len(line.split()) == len(heading.replace("strain 99%", "strain").split())


def test_numbers_that_fit_are_not_shortened() -> None:
    record = {"update": 7, "C": 2460707.123456, "C0": 720.089549, "C_chi": 1.25e-3, "seconds": 86400.25}
    cells = UPDATES.row(record).split()
    assert cells[:4] == ["7", "2.46071e+06", "720.089549", "1.25e-03"]
    assert cells[-1] == "86400.2"


def test_duration_is_hours_minutes_seconds() -> None:
    assert duration(3725.4) == "1:02:05"


@pytest.mark.parametrize(
    ("size", "said"),
    [(0, "0 bytes"), (999, "999 bytes"), (1000, "1 kB"), (999_600, "1 MB"), (12_345_678, "12.3 MB"), (3e12, "3000 GB")],
)
def test_sizes_are_told_in_units_of_thousands(size: float, said: str) -> None:
    assert byte_size(size) == said
