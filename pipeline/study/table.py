"""The results of a study as a table: CSV for programs, Markdown for people, and its plot."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from pipeline.results.wording import formatted
from pipeline.store import atomic
from pipeline.store import tables as table_file
from pipeline.study.sweep import Sweep

#: Results by the name of their column: unit, and where they stand in the summaries of the stages.
RESULTS = {
    "C": ("", ("optimize", "C")),
    "C0": ("", ("optimize", "terms", "C0")),
    "T3": ("mm", ("optimize", "T3")),
    "theta2": ("degrees", ("optimize", "theta2")),
    "spring_elongation": ("mm", ("optimize", "spring_elongation")),
    "wall_leak": ("", ("optimize", "wall_leak")),
    "energy_ratio": ("", ("optimize", "energy_ratio")),
    "stationarity": ("", ("optimize", "stationarity")),
    "updates": ("", ("optimize", "updates")),
    "converged": ("", ("optimize", "converged")),
    "volume": ("mm^3", ("export", "volume")),
}

Row = dict[str, Any]


def rows(sweep: Sweep) -> list[Row]:
    """One row per case: ``name``, the varied keys, :data:`RESULTS`, ``seconds``, ``exit_code`` and ``sentence``.

    Results that are missing or stale are None, and so is the exit code of a case that has not been run to an end.
    """
    found = []
    for variant in sweep.study.variants:
        outcome, summaries = sweep.outcome(variant), sweep.summaries(variant)
        results = {name: _at(summaries, place) for name, (_, place) in RESULTS.items()}
        if results["theta2"] is not None:
            results["theta2"] = math.degrees(results["theta2"])
        seconds = sum(summary["stage_seconds"] for summary in summaries.values()) if summaries else None
        ended = {
            "exit_code": outcome.exit_code if outcome else None,
            "sentence": outcome.sentence if outcome else "not run to an end yet",
        }
        found.append({"name": variant.case.name, **variant.values, **results, "seconds": seconds, **ended})
    return found


def write(sweep: Sweep, table: list[Row]) -> list[Path]:
    """Write table and plot; returns the files.

    Raises:
        OSError: if the folder or the disk does not take a file.
    """
    # Load a drawing library.
    from pipeline.figures.saving import save
    from pipeline.figures.sweep import sweep as sweep_figure

    files = [sweep.result("csv"), sweep.result("md")]
    for path, text in zip(files, (as_csv(table), as_markdown(sweep, table)), strict=True):
        atomic.write_text(path, text)
    if any(row["C0"] is not None for row in table):
        files.append(sweep.result("png"))
        study = sweep.study
        save(
            sweep_figure(table, study.keys, grid=study.grid, logarithmic=study.logarithmic, title=sweep.study.name),
            files[-1],
        )
    return files


def as_csv(table: list[Row]) -> str:
    """The table with all digits."""
    return table_file.as_csv(table[0], ([row[name] for name in table[0]] for row in table))


def as_markdown(sweep: Sweep, table: list[Row]) -> str:
    """The table for people, with units and few digits; columns without any value are left out."""
    hidden = {name for name in RESULTS if all(row[name] is None for row in table)} | {"sentence"}
    names = [name for name in table[0] if name not in hidden]
    units = {name: f" [{unit}]" for name, (unit, _) in RESULTS.items() if unit} | {"seconds": " [s]"}
    lines = [
        f"# Study {sweep.study.name}",
        "",
        f"{len(table)} cases of {sweep.study.base.name}.",
        "",
        table_file.as_markdown(
            (f"{name}{units.get(name, '')}" for name in names),
            ([formatted(row[name], 4, none="") for name in names] for row in table),
        ),
    ]
    failed = [row for row in table if row["sentence"]]
    if failed:
        lines += ["", *(f"- {row['name']}: {row['sentence']}" for row in failed)]
    return "\n".join(lines) + "\n"


def _at(summaries: dict[str, Any], place: tuple[str, ...]) -> Any:
    found: Any = summaries
    for name in place:
        found = found.get(name) if isinstance(found, dict) else None
    return found
