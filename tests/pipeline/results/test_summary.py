"""Numbers and lines shown to the user."""

from __future__ import annotations

import json
from pathlib import Path

from command_line import Poro, edited

from pipeline.runs.progress import HEADING, duration, row
from pipeline.store import contents


def test_rows_stand_below_their_heading() -> None:
    record = {name: -1.0e-3 for name in ("C", "C0", "C_chi", "C_A", "C_i", "C_p", "C_psi", "dt")}
    line = row(record | {"update": 12, "seconds": 1234.5})
    assert len(line) == len(HEADING)
    assert line.split()[0] == "12"
    assert line.endswith("1234.5")


def test_designs_of_older_versions_are_still_summarised(poro: Poro, folder: Path) -> None:
    """Their summaries lack what later versions added."""
    path = folder / "tiny.h5"
    older = contents.summary(path, "optimize")
    for key in ("passive_share", "work", "peak_memory"):
        del older[key]
    with edited(path) as file:
        file["report/summary"][()] = json.dumps(older)
    ended = poro("export", path)
    assert ended.code == 0, ended.err
    assert "largest p / p_in on the outer wall" in ended.out
    assert "1 updates, " in ended.out
    assert "passive core" not in ended.out


def test_duration_is_hours_minutes_seconds() -> None:
    assert duration(3725.4) == "1:02:05"
