"""Rows of the table of what is skipped: needless work beside the work without it, and how far their results differ."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np

from actuator.arrays import Floats
from benchmarks.timing import timed


@dataclass(frozen=True)
class Skip:
    """One thing that is skipped.

    Attributes:
        item: of the list in ``docs/project/notebook/skipping.md``.
        what: what is skipped, and in what.
        against: how the needless work was brought about.
        unit: "time" or what is counted.
        needless, skipped: counts with the needless work and without it; of a time 1 and its part.
        noise: half the width of the middle half of the times, as a part of the median; None of counts.
        difference: largest difference of the results, as a part of their largest value; None if there is none to make.
        remark: what to make of it.
    """

    item: str
    what: str
    against: str
    unit: str
    needless: float
    skipped: float
    noise: float | None
    difference: float | None
    remark: str = ""

    def row(self) -> dict[str, object]:
        """The row, with the part that is left."""
        values = vars(self).copy()
        remark = values.pop("remark")
        return values | {"left": self.skipped / self.needless if self.needless else None, "remark": remark}

    @classmethod
    def from_row(cls, row: Mapping[str, str]) -> Skip:
        """The row of a table that was read."""
        texts: dict[str, Any] = {name: row[name] for name in ("item", "what", "against", "unit", "remark")}
        numbers: dict[str, Any] = {
            name: float(row[name]) if row[name] else None for name in ("needless", "skipped", "noise", "difference")
        }
        return cls(**texts, **numbers)


def count_skip(
    item: str,
    what: str,
    against: str,
    unit: str,
    counts: tuple[float, float],
    *,
    difference: float | None = None,
    remark: str = "",
) -> Skip:
    """A row of counts: with the needless work, and without it."""
    needless, skipped = map(float, counts)
    return Skip(item, what, against, unit, needless, skipped, None, difference, remark)


def time_skip(
    item: str,
    what: str,
    against: str,
    needless: Callable[[], Any],
    skipped: Callable[[], Any],
    *,
    remark: str = "",
    repeats: int = 9,
) -> Skip:
    """Time two calls in turn, and compare the arrays or numbers that they return."""
    difference = largest_difference(needless(), skipped())
    times = timed({"needless": needless, "skipped": skipped}, repeats)
    half_widths = []
    for values in times.values():
        quarter = len(values) // 4
        half_widths.append(0.5 * (values[-1 - quarter] - values[quarter]) / median(values))
    part = median(times["skipped"]) / median(times["needless"])
    if not remark and 1.0 - part < max(half_widths):
        remark = "less than the noise"
    return Skip(item, what, against, "time", 1.0, part, max(half_widths), difference, remark)


def largest_difference(one: Any, other: Any) -> float:
    """Largest difference of two arrays, numbers, or sequences of such, as a part of the largest value of each."""
    if isinstance(one, tuple | list):
        return max(largest_difference(a, b) for a, b in zip(one, other, strict=True))
    first, second = np.asarray(one), np.asarray(other)
    size = float(np.abs(first).max(initial=0.0))
    return float(np.abs(first - second).max(initial=0.0)) / (size if size > 0.0 else 1.0)


def parts(*arrays: Floats) -> list[Floats]:
    """Real and imaginary parts, to be compared apart: those of a complex step are tiny."""
    return [part for array in arrays for part in (array.real, array.imag)]
