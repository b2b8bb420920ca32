"""Rows of a recorded test that lie far off those around them: lost samples, spikes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from actuator.arrays import Bools, Floats, Ints

#: Rows beside each other by which one of them is judged; medians stand three bad ones of them.
NEIGHBOURS = 7
#: Fewer rows than this say nothing about one of them.
LEAST_ROWS = 5
#: Standard deviations of normal noise in a median absolute deviation.
NORMAL = 1.4826
#: Standard deviations that a row may lie off, by which hardly one of ten thousand good rows is lost.
DEVIATIONS = 8.0
#: How much farther off the first and last rows of a table may be, which have rows on one side.
END = 4.0
#: Share of what its neighbours say that a stress may be off, for curves bend.
OFF = 0.1
#: Least strain that counts.
JITTER = 0.01


def lone_rows(stretch: Floats, stress: Floats) -> Bools:
    """Which rows, in the order of the record, lie far off those around, (n,)."""
    lone = np.zeros(len(stretch), dtype=bool)
    # By a wrong stretch the stress would be judged wrongly. Each row that is found clears the view of others.
    for far in (lambda x, _: _far_stretch(x), _far_stress, _far_stress, _far_stress):
        near = np.flatnonzero(~lone)
        if len(near) >= LEAST_ROWS:
            lone[near[far(stretch[near], stress[near])]] = True
    return lone


def _windows(count: int) -> Ints:
    """The rows around each row, (n, k); at the ends the first and the last ones."""
    size = min(NEIGHBOURS, count)
    first = np.clip(np.arange(count) - size // 2, 0, count - size)
    return first[:, None] + np.arange(size)


def _far_stretch(stretch: Floats) -> Bools:
    """Rows whose stretch is not between those around, by the median of them and its absolute deviation."""
    around = stretch[_windows(len(stretch))]
    middle = np.median(around, axis=1)
    scatter = np.median(np.abs(around - middle[:, None]), axis=1)
    limit = DEVIATIONS * NORMAL * np.maximum(scatter, np.median(scatter))
    # Tables often end in steps that grow; a middle row of a rising table is its own median.
    half = min(NEIGHBOURS, len(stretch)) // 2
    limit[:half] *= END
    limit[len(limit) - half :] *= END
    far: Bools = np.abs(stretch - middle) > np.maximum(limit, JITTER)
    return far


def _far_stress(stretch: Floats, stress: Floats) -> Bools:
    """Rows whose stress is far off a line through those around, by medians."""
    windows = _windows(len(stretch))
    x, y = stretch[windows], stress[windows]
    i, j = np.triu_indices(windows.shape[1], 1)
    run = x[:, j] - x[:, i]
    rise = y[:, j] - y[:, i]
    slopes = np.divide(rise, run, out=np.full_like(rise, np.nan), where=run != 0.0)
    slope = np.zeros(len(stretch))
    some = np.isfinite(slopes).any(axis=1)
    slope[some] = np.nanmedian(slopes[some], axis=1)
    level = np.median(y - slope[:, None] * x, axis=1)
    line = level + slope * stretch
    scatter = np.median(np.abs(y - (level[:, None] + slope[:, None] * x)), axis=1)
    # At the ends the line is continued beyond the middle of its rows, where the curve has bent.
    reach = np.maximum(np.abs(stretch - np.median(x, axis=1)), np.ptp(x, axis=1) / (windows.shape[1] - 1))
    limit = DEVIATIONS * NORMAL * np.maximum(scatter, np.median(scatter))
    far: Bools = np.abs(stress - line) > np.maximum.reduce([limit, OFF * np.abs(line), np.abs(slope) * reach])
    return far
