"""Samples that were lost while a test was recorded: what is no measurement, though it is a number.

Loggers write 9999, zeros or the last value where a sensor gave none. Such rows would count as data: one of 9999 makes
a loop of a thousand times full scale. What a part does, a sensor that saw it too tells apart: rows in which the other
signal moves along are kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator.arrays import Floats, Ints
from stages.compare.noise import noise

Flags = NDArray[np.bool_]

#: A sample this many times the range of all others beyond them is none.
FAR = 2.0
#: A gap of more than this share of the range parts samples into groups: branches with one are refused anyway.
GAP = 0.3
#: Largest share of rows that may be lost for one reason: more is how the signal is.
LARGEST_SHARE = 0.25
#: The same of one value that stands in for others, with the signal in between.
LARGEST_SHARE_OF_VALUE = 0.9
#: The same where both signals are lost at once, which short pulses that are real look like.
LARGEST_SHARE_OF_BOTH = 0.05
#: Rows that a spike may last; a value that is repeated exactly may last longer.
SPIKE = 3
#: A lost sample stands out by so many standard deviations of the noise, so many times what the signal does from row to
#: row, and this share of its range; less does no harm.
DEVIATIONS, STEPS, LEAST = 8.0, 3.0, 0.05
#: Quantile of the steps that are not zero, by which a signal's usual step is told.
USUAL_STEP = 0.9
#: Values that are looked at because they are repeated exactly.
VALUES = 5
#: A signal sticks if it has one value in so many rows, while the other changes by more than this share of its range.
STUCK_ROWS, STUCK_CHANGE = 5, 0.05
#: A signal of which more than this share of rows repeats the one before does so by itself: its steps are coarse.
REPEATS = 0.05
#: Noise, over a signal's range, that is none.
ROUNDING = 1e-9
#: The other signal moves along if it leaves the line between its neighbours by this share of its range.
ALONG = 0.1


@dataclass(frozen=True)
class Lost:
    """Rows of a signal that are left out.

    Attributes:
        signal: ``pressure``, or what answers it.
        why: what is wrong with them, after "rows".
        rows: their indices in the recording.
        value: of the first one, as recorded.
    """

    signal: str
    why: str
    rows: Ints
    value: float


FAR_OFF, STUCK = "far off", "stuck at one value"


def find(pressure: Floats, answer: Floats, name: str) -> tuple[Lost, ...]:
    """Lost samples of two signals.

    Args:
        pressure, answer: (n,), of one recording.
        name: of the answer.
    """
    if len(pressure) < 2 * STUCK_ROWS:
        return ()
    signals = {"pressure": pressure, name: answer}
    far = {key: _beyond(values) for key, values in signals.items()}
    off = {key: far[key] | _out_and_back(values, far[key]) for key, values in signals.items()}
    stuck = {
        key: _stuck(values, off[key], other, off[rest])
        for (key, values), (rest, other) in zip(signals.items(), reversed(signals.items()), strict=True)
    }
    found = []
    for (key, values), (rest, other) in zip(signals.items(), reversed(signals.items()), strict=True):
        lost = np.zeros(len(values), dtype=np.bool_)
        for run in _runs(off[key]):
            if off[rest][run].any():
                inside = run.start > 0 and run.stop < len(values)
                lost[run] = (inside or far[key][run].all()) and _both(values[run], other[run], len(values))
            else:
                lost[run] = not _along(other, run, off[key] | off[rest])
        sticks = stuck[key] & ~lost
        for why, rows in ((FAR_OFF, lost), (STUCK, sticks)):
            if rows.any():
                indices = np.flatnonzero(rows)
                found.append(Lost(key, why, indices, float(values[indices[0]])))
    return tuple(found)


def _beyond(values: Floats) -> Flags:
    """Samples (n,) that lie far outside the range of most."""
    order = np.argsort(values, kind="stable")
    levels = values[order]
    low, high = 0, len(levels)
    while high - low > 1:
        gaps = np.diff(levels[low:high])
        place = low + int(gaps.argmax()) + 1
        if gaps.max() <= GAP * (levels[high - 1] - levels[low]):
            break
        if place - low < high - place:
            low = place
        else:
            high = place
        if len(levels) - (high - low) > LARGEST_SHARE * len(levels):
            return np.zeros(len(values), dtype=np.bool_)
    reach = FAR * (levels[high - 1] - levels[low])
    found: Flags = (values < levels[low] - reach) | (values > levels[high - 1] + reach)
    return found if reach > 0.0 else np.zeros(len(values), dtype=np.bool_)


def _out_and_back(values: Floats, far: Flags) -> Flags:
    """Samples (n,) that leave the signal and come back: spikes, and values that stand in for a lost one."""
    found = far.copy()
    good = np.flatnonzero(~far)
    if len(good) < 2 * STUCK_ROWS:
        return far
    # Values that stand in for others.
    candidates, counts = np.unique(values[good], return_counts=True)
    often = candidates[np.argsort(counts)[::-1][:VALUES]]
    for value in {0.0, float(candidates[0]), float(candidates[-1]), *often.tolist()}:
        there = good[values[good] == value]
        rest = good[values[good] != value]
        if not 0 < len(there) <= LARGEST_SHARE_OF_VALUE * len(values) or len(rest) < 2 * STUCK_ROWS:
            continue
        after = np.searchsorted(rest, there)
        sides = [values[rest[np.clip(place, 0, len(rest) - 1)]] - value for place in (after - 1, after)]
        away = np.minimum(*np.abs(sides)) * (sides[0] * sides[1] > 0.0)
        threshold = _threshold(values[rest])
        out = away > threshold
        # Where it stands in so often, it does so too where it does not stand out, unless the signal has it by itself.
        near = int((np.abs(values[rest] - value) <= threshold).sum())
        found[there] |= out | (out.sum() > SPIKE and near >= (~out).sum() and _noisy(values[rest]))
    # Spikes.
    good = np.flatnonzero(~found)
    if len(good) < 2 * STUCK_ROWS:
        return far
    signal, threshold = values[good], _threshold(values[good])
    for length in range(1, SPIKE + 1):
        before, after = signal[: -length - 1], signal[length + 1 :]
        inside = np.stack([signal[k : len(signal) - length - 1 + k] for k in range(1, length + 1)])
        shares = np.arange(1, length + 1)[:, None] / (length + 1)
        off = inside - (before + shares * (after - before))
        least = np.abs(off).min(axis=0)
        spike = (np.abs(np.sign(off).sum(axis=0)) == length) & (least > threshold)
        spike &= np.abs(after - before) <= 0.5 * least
        for start in np.flatnonzero(spike).tolist():
            found[good[start + 1 : start + 1 + length]] = True
    return found


def _threshold(signal: Floats) -> float:
    """By how much a lost sample stands out of a signal (n,)."""
    steps = np.abs(np.diff(signal))
    steps = steps[steps > 0.0]
    usual = float(np.quantile(steps, USUAL_STEP)) if len(steps) else 0.0
    return max(DEVIATIONS * noise(signal), STEPS * usual, LEAST * float(np.ptp(signal)))


def _noisy(signal: Floats) -> bool:
    """Whether a signal (n,) has noise: without any, it repeats its values by itself."""
    return noise(signal) > ROUNDING * float(np.ptp(signal))


def _stuck(values: Floats, off: Flags, other: Floats, other_off: Flags) -> Flags:
    """Rows (n,) in which a signal keeps one value exactly while the other goes on."""
    found = np.zeros(len(values), dtype=np.bool_)
    if off.all() or other_off.all():
        return found
    good = values[~off]
    threshold, rough = _threshold(good), _noisy(good)
    change = STUCK_CHANGE * float(np.ptp(other[~other_off])) + DEVIATIONS * noise(other[~other_off])
    same = np.concatenate([[False], np.diff(values) == 0.0])
    resting = float(np.median(values[:STUCK_ROWS]))
    for run in _runs(same):
        run = slice(run.start - 1, run.stop)
        if values[run.start] == resting:  # a sensor that shows no less than nothing may have one value at rest
            continue
        length = run.stop - run.start
        moved = other[run][~other_off[run]]
        if not STUCK_ROWS <= length <= LARGEST_SHARE * len(values) or not len(moved):
            continue
        stands = np.ptp(moved) == 0.0  # a logger that hangs repeats both
        if np.ptp(moved) <= change and not stands:
            continue
        ends = [place for place in (run.start - 1, run.stop) if 0 <= place < len(values) and not off[place]]
        jumps = any(abs(values[place] - values[run.start]) > threshold for place in ends)
        repeats = float((same & (values != values[run.start])).sum())
        if jumps or (rough and not stands and repeats < REPEATS * len(values)):
            # The first of them is the last that was measured.
            found[run.start + 1 : run.stop] = True
    return found


def _both(values: Floats, other: Floats, rows: int) -> bool:
    """Whether what stands out in both signals was lost in both: one row, or values that are repeated exactly."""
    return len(values) <= max(1, LARGEST_SHARE_OF_BOTH * rows) and bool(np.ptp(values) == 0.0 == np.ptp(other))


def _along(other: Floats, run: slice, off: Flags) -> bool:
    """Whether the other signal leaves its neighbours in a run of rows too."""
    rest = np.flatnonzero(~off)
    if not len(rest):
        return False
    rows = np.arange(run.start, run.stop)
    away = np.abs(np.median(other[run] - np.interp(rows, rest, other[rest])))
    return bool(away > ALONG * np.ptp(other[rest]) + DEVIATIONS * noise(other[rest]))


def _runs(flags: Flags) -> list[slice]:
    """Rows (n,) that follow each other."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [slice(int(start), int(stop)) for start, stop in zip(edges[::2], edges[1::2], strict=True)]
