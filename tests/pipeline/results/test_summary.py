"""Numbers and lines shown to the user."""

from __future__ import annotations

from pipeline.results.wording import duration
from pipeline.runs.growing_table import UPDATES


def test_rows_stand_below_their_heading() -> None:
    record = {name: -1.0e-3 for name in ("C", "C0", "C_chi", "C_A", "C_i", "C_p", "C_psi", "dt")}
    line = UPDATES.row(record | {"update": 12, "seconds": 1234.5})
    assert len(line) == len(UPDATES.heading())
    assert line.split()[0] == "12"
    assert line.endswith("1234.5")


def test_duration_is_hours_minutes_seconds() -> None:
    assert duration(3725.4) == "1:02:05"
