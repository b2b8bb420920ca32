"""Tables as text: CSV and Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable


def as_csv(heading: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table as text, apart by commas."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([heading, *rows])
    return text.getvalue()


def as_markdown(heading: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table as Markdown; cells on one line, with no bar that would end them."""
    names = list(heading)
    lines = [f"| {' | '.join(map(markdown_cell, cells))} |" for cells in (names, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(names), *lines[1:]])


def markdown_cell(text: str) -> str:
    """Text on one line, with no bar that would end a cell."""
    return " ".join(text.split()).replace("|", "\\|")
