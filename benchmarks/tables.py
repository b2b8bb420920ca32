"""Where benchmarks put their results: Markdown to read, CSV to compare with, both from the same rows."""

from __future__ import annotations

import csv
import io
import logging
from collections.abc import Iterable, Mapping
from pathlib import Path

RESULTS = Path(__file__).parent / "results"

Row = Mapping[str, object]


def start_log(name: str) -> logging.Logger:
    """A benchmark's own log, its messages as they are; without it a benchmark says nothing."""
    logging.basicConfig(format="%(message)s")
    logger = logging.getLogger(name)
    logger.setLevel(logging.INFO)
    return logger


def markdown(rows: Iterable[Row]) -> str:
    """A table of rows that share their keys, which become its head."""
    rows = list(rows)
    if not rows:
        return ""
    lines = [tuple(rows[0]), tuple("---" for _ in rows[0])]
    lines += [tuple(shown(value).replace("|", "\\|") for value in row.values()) for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def write_markdown(name: str, title: str, parts: Iterable[str]) -> Path:
    """Write ``results/NAME.md`` from a title and paragraphs or tables."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.md"
    path.write_text("\n".join([f"# {title}\n", *(f"{part.rstrip()}\n" for part in parts)]), encoding="utf-8")
    return path


def write_csv(name: str, rows: Iterable[Row]) -> Path:
    """Write ``results/NAME.csv``, numbers in full."""
    rows = list(rows)
    RESULTS.mkdir(exist_ok=True)
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    path = RESULTS / f"{name}.csv"
    path.write_text(text.getvalue(), encoding="utf-8")
    return path


def read_csv(name: str) -> list[dict[str, str]]:
    """The rows of ``results/NAME.csv`` as text."""
    with (RESULTS / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def shown(value: object) -> str:
    """A figure to read: four digits of a float, nothing for None."""
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
