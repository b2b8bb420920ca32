"""What a recorded uniaxial test holds besides a loading curve that begins at rest: found, left out, and said.

In this order: lone rows far off those around, rows of unloading and of later cycles, rows after a break, rows of
slack, and stress at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from stages.lone_rows import DEVIATIONS, JITTER, NORMAL, lone_rows
from stages.near_rest import REACH, Start, near_rest, nearest
from stages.slack import AT_REST, slack_of

if TYPE_CHECKING:
    from actuator.arrays import Bools, Floats, Ints

#: A strain that goes back less than this share of their range is noise of its sensor.
JITTER_SHARE = 0.02
#: Share of the largest stress below which a stress that fell for good tells of a break, as testing machines are set.
BROKEN = 0.8
#: Share of the stress at the strain limit above which a stress at rest counts, with rows there, and without.
PRELOADED, EXTRAPOLATED = 0.05, 0.1
#: Standard deviations that a stress at rest must have.
SURE = 4.0
#: Row names that a sentence holds.
NAMED = 5


@dataclass(frozen=True)
class Curve:
    """The loading curve of a test.

    Attributes:
        stretch, stress: in order of stretch, (n,); compression at its beginning. The stress is N/mm².
        left_out: stretch and stress of the rows left out, as they were, (m, 2).
        warnings: sentences on what was found and done.
    """

    stretch: Floats
    stress: Floats
    left_out: Floats
    warnings: list[str]


def loading_curve(stretch: Floats, stress: Floats, strain_limit: float, lines: Sequence[int] | None = None) -> Curve:
    """Leave out of a test what is no loading curve, and take slack and stress at rest off it.

    Args:
        stretch, stress: of the rows as recorded, (n,); N/mm².
        strain_limit: strain up to which the curve matters most.
        lines: of a file in which the rows stand, for the sentences; by default rows are counted from 1.
    """
    cleaning = _Cleaning(stretch, stress, strain_limit, lines)
    cleaning.leave_out_lone_rows()
    cleaning.leave_out_unloading()
    cleaning.leave_out_broken()
    cleaning.take_up_slack()
    cleaning.take_off_rest()
    kept = cleaning.rows
    gone = np.ones(len(stretch), dtype=bool)
    gone[kept] = False
    return Curve(cleaning.stretch, cleaning.stress, np.column_stack([stretch[gone], stress[gone]]), cleaning.warnings)


class _Cleaning:
    """The rows that are left, step by step."""

    def __init__(self, stretch: Floats, stress: Floats, strain_limit: float, lines: Sequence[int] | None) -> None:
        self.rows = np.arange(len(stretch))
        self.stretch, self.stress, self.strain_limit = stretch, stress, strain_limit
        self._word, self._names = ("line", lines) if lines is not None else ("row", range(1, len(stretch) + 1))
        self.warnings: list[str] = []

    def _named(self, kept: Bools) -> str:
        """The rows that are not kept."""
        names = [self._names[row] for row in self.rows[~kept]]
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        return f"{self._word}{'s' if len(names) > 1 else ''} {', '.join(map(str, names[:NAMED]))}{more}"

    def _keep(self, kept: Bools | Ints) -> None:
        self.rows, self.stretch, self.stress = self.rows[kept], self.stretch[kept], self.stress[kept]

    def leave_out_lone_rows(self) -> None:
        kept = ~lone_rows(self.stretch, self.stress)
        # Rows to the end at less stress are those after a break.
        last = int(np.flatnonzero(kept)[-1])
        after = slice(last + 1, None)
        if (self.stress[after] < self.stress[last]).all() and (self.stretch[after] >= self.stretch[last]).all():
            kept[after] = True
        if kept.all():
            return
        named = self._named(kept)
        if np.count_nonzero(~kept) == 1:
            x, y = self.stretch[~kept][0], self.stress[~kept][0]
            sentence = (
                f"of {named}, a stress of {y:.4g} N/mm² at a stretch of {x:.4g}, lies far off those around: it is"
            )
        else:
            sentence = f"of {named} lie far off those around: they are"
        self.warnings.append(f"The point{'s' if 'lie ' in sentence else ''} {sentence} left out.")
        self._keep(kept)

    def leave_out_unloading(self) -> None:
        """Keep what was loaded for the first time, of tension and compression; in order of stretch."""
        bend = np.abs(np.diff(self.stretch, 2))
        # A second difference of normal noise has the variance times six. A table in no order is all noise and stays.
        sensor = DEVIATIONS * NORMAL * float(np.median(bend)) / 6.0**0.5 if len(bend) else 0.0
        noise = max(sensor, min(JITTER, JITTER_SHARE * float(np.ptp(self.stretch))))
        rises, falls = (bool((_behind(way) <= noise).all()) for way in (self.stretch, -self.stretch))
        if falls and not rises and (self.stretch > 1.0).any():
            self.warnings.append(
                "The stretch falls from the first row to the last, taken for a table written backwards: if it is the "
                "way back of a test, E is not that of loading."
            )
        if not falls and not rises:
            kept = np.ones(len(self.rows), dtype=bool)
            for side in (self.stretch >= 1.0, self.stretch < 1.0):
                kept[side] = _first_loading(np.abs(self.stretch[side] - 1.0), noise)
            if not kept.all():
                first = self._names[self.rows[~kept][0]]
                self.warnings.append(
                    f"The strain goes back at {self._word} {first}, as in unloading, a cycle or another specimen: only "
                    f"the rows of first loading are used, {np.count_nonzero(~kept)} of {len(kept)} are left out. A "
                    "part that is inflated often is softer: for that, give the rows of a later cycle alone."
                )
                self._keep(kept)
        self._keep(np.argsort(self.stretch, kind="stable"))

    def leave_out_broken(self) -> None:
        peak = int(self.stress.argmax())
        if self.stress[peak] > 0.0 and self.stress[-1] < BROKEN * self.stress[peak]:
            fallen = 100.0 * (1.0 - self.stress[peak:].min() / self.stress[peak])
            self.warnings.append(
                f"The stress falls by {fallen:.0f} % beyond a stretch of {self.stretch[peak]:.4g} ({self._word} "
                f"{self._names[self.rows[peak]]}), as after a break: what is beyond is left out."
            )
            self._keep(np.arange(peak + 1))

    def take_up_slack(self) -> None:
        foot = slack_of(self.stretch, self.stress, self.strain_limit)
        if foot is None:
            return
        gone = f"The first {foot.rows} rows are left out, and the" if foot.rows else "The"
        self.warnings.append(
            f"The stress rises only from a stretch of {foot.length:.4g} on: the bar was slack before, or longer than "
            f"at first. {gone} length there is taken for the initial one."
        )
        self._keep(np.arange(foot.rows, len(self.rows)))
        self.stretch, self.stress = self.stretch / foot.length, self.stress - foot.stress

    def take_off_rest(self) -> None:
        near = nearest(self.stretch, REACH * self.strain_limit)
        resting = np.abs(self.stretch - 1.0) <= AT_REST
        start = self._offset(near, PRELOADED)
        if start and resting.any():
            measured = np.median(self.stress[resting] - start.slope * (self.stretch[resting] - 1.0))
            if measured * np.sign(start.at_rest) > PRELOADED * abs(start.stress(1.0 + self.strain_limit)):
                self.warnings.append(
                    f"The stress at rest is {start.at_rest:.3g} N/mm², not near zero: it is taken off every row, as of "
                    "a load cell not zeroed. If it is a preload, count the stretch from the length without load."
                )
                self.stress = self.stress - start.at_rest
                return
        start = self._offset(near & ~resting, EXTRAPOLATED)
        if start and (start.at_rest < 0.0 or not resting.any()):
            self.warnings.append(
                f"The rows from a stretch of {self.stretch[near & ~resting].min():.4g} on, continued to rest, have a "
                f"stress of {start.at_rest:.3g} N/mm² there, as if the bar were slack or loaded before. With this "
                f"taken off, E would be near {start.slope:.3g} N/mm²."
            )

    def _offset(self, rows: Bools, share: float) -> Start | None:
        """The beginning of the curve by some rows, if it has a stress at rest that counts."""
        start = near_rest(self.stretch[rows], self.stress[rows], rest=True)
        if start is None or start.slope <= 0.0:
            return None
        least = max(share * abs(start.stress(1.0 + self.strain_limit)), SURE * start.at_rest_uncertainty)
        return start if abs(start.at_rest) > least else None


def _behind(progress: Floats) -> Floats:
    """How far each row is behind the farthest one before."""
    found: Floats = np.maximum.accumulate(progress) - progress
    return found


def _first_loading(progress: Floats, noise: float) -> Bools:
    """Rows but for those of the way back and of the way up to where it began."""
    if not len(progress):
        return np.ones(0, dtype=bool)
    behind = _behind(progress)
    record = np.concatenate([[True], progress[1:] > np.maximum.accumulate(progress)[:-1]])
    group = np.cumsum(record) - 1
    deepest = np.zeros(group[-1] + 1)
    np.maximum.at(deepest, group, behind)
    kept: Bools = record | (deepest[group] <= noise)
    return kept
