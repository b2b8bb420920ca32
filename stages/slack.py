"""Slack at the beginning of a uniaxial test: strain without stress, before the bar is taut."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from actuator.arrays import Floats

#: Strain within which a row is at rest.
AT_REST = 0.02
#: Strains, least and most, that are looked through for slack, and in how many steps. Farther on the stress of a
#: stiffening elastomer may rise as unevenly.
LEAST, MOST, TRIED = 0.01, 0.25, 100
#: Share of the slope beyond that the slope in slack is below, by two standard deviations.
FLAT = 0.25
#: Fewer rows than this say nothing.
LEAST_ROWS = 5


@dataclass(frozen=True)
class Slack:
    """The beginning of a test.

    Attributes:
        rows: how many are of slack; none where a later cycle begins at the length that is left of those before.
        length: stretch at which the bar is taut.
        stress: of the rows of slack, N/mm².
    """

    rows: int
    length: float
    stress: float


def slack_of(stretch: Floats, stress: Floats, strain_limit: float) -> Slack | None:
    """Slack, if there is some.

    Args:
        stretch, stress: of the rows, in order of stretch, (n,).
        strain_limit: over which, at least, the slope beyond is taken.
    """
    if len(stretch) < LEAST_ROWS or stretch[0] < 1.0 - AT_REST:
        return None
    rows, level = 0, 0.0
    ahead = slice(0, _until(stretch, 0, strain_limit))
    first, beyond = np.searchsorted(stretch, [stretch[0] + LEAST, stretch[0] + MOST])
    for row in np.unique(np.linspace(first, min(beyond, len(stretch) - 3), TRIED).astype(int)):
        after = slice(row, _until(stretch, row, max(strain_limit, stretch[row] - stretch[0])))
        later, _ = _slope(stretch[after], stress[after])
        slope, doubt = _slope(stretch[: row + 1], stress[: row + 1])
        if later > 0.0 and abs(slope) + 2.0 * doubt < FLAT * later:
            rows, level, ahead = int(row) + 1, float(np.median(stress[: row + 1])), after
    if not rows:
        slope, _ = _slope(stretch[ahead], stress[ahead])
        if stretch[0] < 1.0 + LEAST or not stress[0] < FLAT * slope * (stretch[0] - 1.0):
            return None
    # Neo-Hooke's curve through the rows beyond begins where it meets the stress of the slack.
    x, y = stretch[rows : ahead.stop], stress[rows : ahead.stop] - level
    ends = np.linspace(stretch[rows - 2] if rows else 1.0, x[0], 301)

    def missed(end: float) -> float:
        shape = x / end - (x / end) ** -2.0
        return float(np.sum((y - shape * (shape @ y) / (shape @ shape)) ** 2))

    length = float(min(ends, key=missed))
    # Two rows without stress before a curve that begins between them are no slack: a sample was lost.
    lost = rows == 2 and length < 0.5 * (stretch[0] + stretch[1])
    return None if lost else Slack(rows, length, level)


def _until(stretch: Floats, row: int, span: float) -> int:
    """The end of the rows from one on, over a span, three of them at least."""
    return max(row + 3, int(np.searchsorted(stretch, stretch[row] + span)))


def _slope(x: Floats, y: Floats) -> tuple[float, float]:
    """Slope of the line through points, and one standard deviation of it; of two points it has none."""
    off = x - x.mean()
    square = float(off @ off)
    if square == 0.0:
        return 0.0, np.inf
    slope = float(off @ y) / square
    residual = y - y.mean() - slope * off
    return slope, float(np.sqrt(residual @ residual / max(len(x) - 2, 1) / square))
