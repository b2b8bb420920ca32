"""Load cycles of a recorded test: rest, turning points, and a branch as a curve over the pressure."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from actuator.arrays import Floats, Ints
from actuator.failure import UnusableRecording
from stages.compare.noise import noise

Flags = NDArray[np.bool_]

#: Fewest rows of a loading or an unloading: with fewer, a spike would pass for one.
FEWEST_ROWS = 5
#: Largest part of a branch's pressures without a row: between, its curve would be a guess.
LARGEST_GAP = 0.3
#: Turning points are looked for in the means of at most so many blocks: this takes noise away, and bounds the time that
#: prominences take, which grows with the square of the number of small peaks.
BLOCKS = 4000
#: Share of the pressure's range that a turning point must stand out by: more than a hand at a regulator wavers.
PROMINENCE = 0.3
#: A loading begins, and an unloading ends, at most this share of the pressure's range above rest.
NEAR_REST = 0.1
#: What counts as rest: this share of the pressure's range, or so many standard deviations of its noise.
REST_SHARE, REST_DEVIATIONS = 0.005, 3.0
#: A pressure that changes by fewer standard deviations of its noise does not change.
LEAST_CHANGE = 8.0


@dataclass(frozen=True)
class Cycle:
    """Rows of one cycle.

    Attributes:
        loading: from rest to the highest pressure.
        unloading: from there back to rest; None where the recording has no whole one.
        peak: highest pressure without noise, kPa, as recorded.
    """

    loading: slice
    unloading: slice | None
    peak: float

    def later(self, rows: int) -> Cycle:
        """The same in a recording with so many rows before it."""
        up, down = self.loading, self.unloading
        moved = None if down is None else slice(down.start + rows, down.stop + rows)
        return Cycle(slice(up.start + rows, up.stop + rows), moved, self.peak)


@dataclass(frozen=True)
class Cycles:
    """All whole cycles of a recording.

    Attributes:
        cycles: at least one.
        rest: (n,), rows at rest before the first of them.
        skipped: number of rises that did not begin near rest.
        broken: number of cycles of which too many samples were lost.
    """

    cycles: tuple[Cycle, ...]
    rest: Flags
    skipped: int
    broken: int = 0


def split(pressure: Floats, rows: Ints | None = None) -> Cycles:
    """Find rest and cycles of a recording.

    Args:
        pressure: (n,), kPa, in the order of time, from any zero.
        rows: which of the recording they are, (n,), for messages; None for all.

    Raises:
        UnusableRecording: if it is too short, does not change, has no loading part, or a part of very few rows.
    """
    from scipy.signal import find_peaks  # slow to load: only where a recording is compared

    if len(pressure) < 2 * FEWEST_ROWS:
        raise UnusableRecording(f"there are {len(pressure)} rows, and {2 * FEWEST_ROWS} are needed; record more.")
    block = -(-len(pressure) // BLOCKS)
    starts = np.arange(0, len(pressure), block)
    coarse = np.add.reduceat(pressure, starts) / np.diff(starts, append=len(pressure))
    deviation = noise(pressure)
    low, span = float(coarse.min()), float(np.ptp(coarse))
    if span <= max(LEAST_CHANGE * deviation, 1e-9 * float(np.abs(coarse).max())):
        raise UnusableRecording(
            f"the pressure is constant: it changes by {span:.3g} kPa, which is no more than its noise; check sensor, "
            "column and unit."
        )
    # Lower ends, so that a recording may begin or end at the highest pressure.
    padded = np.concatenate([[low - span], coarse, [low - span]])
    peaks = find_peaks(padded, prominence=PROMINENCE * span)[0] - 1
    bounds = [0, *peaks.tolist(), len(coarse) - 1]
    valleys = [a + int(np.argmin(coarse[a : b + 1])) for a, b in pairwise(bounds)]

    def row(index: int) -> int:
        return min(index * block + block // 2, len(pressure) - 1)

    loaded = [coarse[peak] - coarse[valley] > PROMINENCE * span for peak, valley in zip(peaks, valleys, strict=False)]
    whole = [rises and coarse[valley] <= low + NEAR_REST * span for rises, valley in zip(loaded, valleys, strict=False)]
    if not any(loaded):
        raise UnusableRecording("there is no loading part: the pressure only falls; record from rest upwards.")
    if not any(whole):
        raise UnusableRecording("there is no loading part that begins at rest; record from rest upwards.")
    first = whole.index(True)
    before = slice(row(peaks[first - 1]) if first else 0, row(peaks[first]) + 1)
    rest, level = _rest(pressure, before, low, max(REST_SHARE * span, REST_DEVIATIONS * deviation))
    numbers = np.arange(len(pressure)) if rows is None else rows
    cycles, broken = [], []
    for number, peak in enumerate(peaks.tolist()):
        if not whole[number]:
            continue
        top = row(peak)
        # Rows at rest on either side are left out, but rather too few than too many: where a noisy signal first leaves
        # the band may lie in the rest, where it last does, well above it.
        rise, fall = row(valleys[number]), row(valleys[number + 1])
        start = max(rise, rise + int(np.argmax(pressure[rise : top + 1] > level)) - 1)
        end = min(fall, fall + 1 - int(np.argmax(pressure[top : fall + 1][::-1] > level)))
        returns = coarse[valleys[number + 1]] <= low + NEAR_REST * span
        branches = slice(start, top + 1), slice(top, end + 1) if returns else None
        try:
            _check(pressure, *branches, numbers)
        except UnusableRecording as failure:
            if numbers[branches[0].start] + end - start == numbers[end]:  # nothing was lost
                raise
            broken.append(failure)
            continue
        cycles.append(Cycle(*branches, float(coarse[peak])))
    if not cycles:
        raise broken[0]
    return Cycles(tuple(cycles), rest, sum(loaded) - sum(whole), len(broken))


def _rest(pressure: Floats, before: slice, low: float, band: float) -> tuple[Flags, float]:
    """Rows (n,) at rest among those before a peak, and the highest pressure that still is rest."""
    candidates = pressure[before]
    level = float(candidates[np.abs(candidates - low).argmin()])
    for _ in range(20):  # the lowest value lies below a noisy rest's middle; each step moves to the middle
        middle = float(np.median(candidates[np.abs(candidates - level) <= band]))
        if middle == level:
            break
        level = middle
    rest = np.zeros(len(pressure), dtype=np.bool_)
    rest[before] = np.abs(candidates - level) <= band
    return rest, level + band


def _check(pressure: Floats, loading: slice, unloading: slice | None, numbers: Ints) -> None:
    """Refuse branches of too few rows, or with too few between rest and peak."""
    for name, rows in (("loading", loading), ("unloading", unloading)):
        if rows is None:
            continue
        first, last = numbers[rows.start] + 1, numbers[rows.stop - 1] + 1
        where = f"rows {first} to {last} of the numbers are a whole {name} part"
        if rows.stop - rows.start < FEWEST_ROWS:
            raise UnusableRecording(
                f"{where} of fewer than {FEWEST_ROWS} rows; remove a spike there, or record more often."
            )
        levels = np.sort(pressure[rows])
        widest = int(np.diff(levels).argmax())
        if levels[widest + 1] - levels[widest] > LARGEST_GAP * (levels[-1] - levels[0]):
            gap = levels[widest + 1] - levels[widest]
            raise UnusableRecording(
                f"{where} that leaves out {gap:.3g} kPa between two rows; change the pressure more slowly, or record "
                "more often."
            )


def curve(pressure: Floats, values: Floats, grid: Floats, half_width: float) -> Floats:
    """Values of one branch over the pressure, by local linear regression.

    Rows are first averaged in bins of a quarter of the half width, so that where the pressure was held counts no more
    than where it passed. Then a straight line is fitted by least squares to the bins within the half width of each grid
    point. A straight response is kept exactly, also at the ends, and neither branch is delayed against the other.

    Args:
        pressure, values: (m,), of the branch's rows in any order.
        grid: (g,), in the pressure's unit.
        half_width: of the window, in the pressure's unit.

    Returns:
        (g,), in the unit of the values.
    """
    bins = np.floor((pressure - grid[0]) / (0.25 * half_width)).astype(np.int64)
    _, which, counts = np.unique(bins, return_inverse=True, return_counts=True)
    p, v = np.bincount(which, pressure) / counts, np.bincount(which, values) / counts
    near = (np.abs(p[None, :] - grid[:, None]) <= half_width).astype(np.float64)  # (g, bins)
    members = near.sum(axis=1)
    safe = np.maximum(members, 1.0)
    middle_p, middle_v = near @ p / safe, near @ v / safe
    away = (p[None, :] - middle_p[:, None]) * near
    squares = (away**2).sum(axis=1)
    slope = np.divide(
        (away * (v[None, :] - middle_v[:, None])).sum(axis=1), squares, where=squares > 0.0, out=np.zeros_like(grid)
    )
    fitted = middle_v + slope * (grid - middle_p)
    # Few rows, as read off by hand: a line through two that lie close together would lead anywhere.
    sparse = (members < 3) | (squares < members * (0.1 * half_width) ** 2)
    return np.where(sparse, np.interp(grid, p, v), fitted)
