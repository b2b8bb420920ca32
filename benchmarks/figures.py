"""The figures of the regression guard, and when one is worse than another."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil
from typing import Literal

Kind = Literal["count", "error", "ratio"]

#: How far a count may grow, as a part of it, and at least by how many.
COUNT_PART, COUNT_LEAST = 0.1, 1
#: How many times as large an error may become.
ERROR_FACTOR = 1.5


@dataclass(frozen=True)
class Figure:
    """One figure of the table.

    Attributes:
        name: what it is of.
        kind: a count or an error, which must not grow, or a ratio of times, which is only told.
        value: the figure.
        unit: its unit; "-" for none.
        allowed: largest value that passes; None for a ratio.
    """

    name: str
    kind: Kind
    value: float
    unit: str
    allowed: float | None

    def row(self) -> dict[str, object]:
        """The figure as a row of the table."""
        return {"name": self.name, "kind": self.kind, "value": self.value, "unit": self.unit, "allowed": self.allowed}

    @classmethod
    def from_row(cls, row: Mapping[str, str]) -> Figure:
        """The figure of a row of a table that was read."""
        kinds: dict[str, Kind] = {"count": "count", "error": "error", "ratio": "ratio"}
        allowed = float(row["allowed"]) if row["allowed"] else None
        return cls(row["name"], kinds[row["kind"]], float(row["value"]), row["unit"], allowed)


def count(name: str, value: float, unit: str) -> Figure:
    """A count of steps or iterations: other processors and solvers may need a few more."""
    return Figure(name, "count", float(value), unit, value + max(COUNT_LEAST, ceil(COUNT_PART * value)))


def error(name: str, value: float, unit: str = "-", *, rounding: float = 0.0) -> Figure:
    """An error.

    Args:
        rounding: what rounding, or a tolerance that is met by chance better, may make of it; allowed in any case.
    """
    return Figure(name, "error", float(value), unit, max(ERROR_FACTOR * value, rounding))


def ratio(name: str, value: float) -> Figure:
    """A ratio of two times, measured in turn in one process."""
    return Figure(name, "ratio", float(value), "-", None)


def worsened(committed: Iterable[Figure], found: Iterable[Figure]) -> list[str]:
    """A sentence for every count and error that is larger than the committed table allows, or is not in it."""
    known = {figure.name: figure for figure in committed}
    sentences = []
    for figure in found:
        if figure.kind == "ratio":
            continue
        before = known.get(figure.name)
        if before is None or before.allowed is None:
            sentences.append(f"{figure.name}: not in the committed table; run `make bench` and commit its tables.")
        elif not figure.value <= before.allowed:  # nor if it is not a number
            sentences.append(
                f"{figure.name}: {figure.value:.6g} {figure.unit}, in the committed table {before.value:.6g}, allowed "
                f"{before.allowed:.6g}."
            )
    return sentences
