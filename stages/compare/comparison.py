"""A recorded test of a printed actuator against its prediction (Section 5 of the paper).

The rig of the paper records the inlet pressure and the deflection of the spring's end while the pressure is raised by
hand beyond its target and slowly lowered again, several times. Here the two signals get a common zero, the cycles are
separated, and each branch becomes a curve over the pressure, so that repetitions, in one recording or several, can be
averaged and compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator.arrays import Floats
from actuator.failure import UnusableRecording
from stages.compare import cycles, deviations
from stages.compare.alignment import Aligned, Alignment, Recording, aligned
from stages.compare.deviations import Hysteresis, Linearity, Overall, Stiffness, Target
from stages.compare.settings import Settings

#: Points of the common pressure grid.
POINTS = 101


@dataclass(frozen=True)
class Prediction:
    """The part's predicted response while the pressure rises.

    Attributes:
        pressure: (m,), kPa, along the path.
        displacement: (m,), mm, of the spring's end; or what else is compared, in its unit. NaN where nothing is
            predicted.
        target: p̄_in, the pressure the part was designed for, kPa.
        curve: whether these are a curve; else only the last point is known, and nothing may be read between.
    """

    pressure: Floats
    displacement: Floats
    target: float
    curve: bool


@dataclass(frozen=True)
class Result:
    """Recordings, their averaged curves, and how they differ from the prediction.

    Attributes:
        recordings: each with its zeros and sign, its cycles, and what was left out.
        aligned: all of them, one after the other.
        cycles: those compared, c of them, by their rows in ``aligned``.
        pressure: (g,), the common grid, kPa, from rest to the smallest of the cycles' highest pressures.
        loading: (c, g), mm.
        unloading: (c, g), mm; NaN for cycles without whole unloading.
        predicted: (g,), mm; NaN where the prediction does not reach, and everywhere if it has no curve.
        target: deviation at the target pressure.
        overall: deviation over the curve; None without a predicted curve.
        hysteresis: None without a whole unloading.
        linearity, predicted_linearity: of loading, over the same pressures; the latter None without a predicted curve.
        stiffness: None without a predicted curve.
        notes: sentences about what was left out.
    """

    recordings: tuple[Aligned, ...]
    aligned: Recording
    cycles: tuple[cycles.Cycle, ...]
    pressure: Floats
    loading: Floats
    unloading: Floats
    predicted: Floats
    target: Target
    overall: Overall | None
    hysteresis: Hysteresis | None
    linearity: Linearity
    predicted_linearity: Linearity | None
    stiffness: Stiffness | None
    notes: tuple[str, ...]

    @property
    def alignment(self) -> Alignment:
        """What was done to the signals of the first recording."""
        return self.recordings[0].alignment

    @property
    def at_target(self) -> Floats:
        """(r,), at the target pressure, mm: the mean of each recording's cycles."""
        ends = np.cumsum([len(each.cycles) for each in self.recordings])
        return np.array([part.mean() for part in np.split(self.target.measured, ends[:-1])])

    @property
    def mean_loading(self) -> Floats:
        """(g,), mm, over the cycles."""
        return self.loading.mean(axis=0)

    @property
    def mean_unloading(self) -> Floats:
        """(g,), mm, over the cycles with a whole unloading; NaN if there is none."""
        return deviations.mean_of_whole(self.unloading)


def run(measured: Recording | Sequence[Recording | Aligned], predicted: Prediction, settings: Settings) -> Result:
    """Align recordings, split and average their cycles, and compare them with a prediction.

    Args:
        measured: as recorded: one test, or repetitions and specimens of the same.
        predicted: scaled to the printed part.
        settings: how.

    Raises:
        UnusableRecording: if there is no cycle to compare, a signal is constant, or no cycle reaches the target.
    """
    target = predicted.target if settings.target is None else settings.target
    given = [measured] if isinstance(measured, Recording) else measured
    parts = tuple(each if isinstance(each, Aligned) else aligned(each, settings, target) for each in given)
    top = min(part.top for part in parts)
    half_width = settings.smoothing * top
    recording, compared = _joined(parts)
    grid = _grid(recording.pressure, compared, half_width, top)

    def branch(rows: slice | None, values: Floats, at: Floats = grid) -> Floats:
        if rows is None:
            return np.full(len(at), np.nan)
        return cycles.curve(recording.pressure[rows], values[rows], at, half_width)

    def both(values: Floats) -> tuple[Floats, Floats]:
        sides = [cycle.loading for cycle in compared], [cycle.unloading for cycle in compared]
        loading, unloading = (np.array([branch(rows, values) for rows in side]) for side in sides)
        return loading, unloading

    loading, unloading = both(recording.displacement)
    times = None if recording.time is None else both(recording.time)
    path = deviations.rising(predicted.pressure, predicted.displacement)
    on_grid = deviations.response(path)(grid) if predicted.curve else np.full(POINTS, np.nan)
    known = np.isfinite(on_grid)
    has_curve = int(known.sum()) >= POINTS // 10
    mean = loading.mean(axis=0)
    if not (np.ptp(loading, axis=1) > 0.0).all():
        raise UnusableRecording(
            f"the {recording.answer} is constant while the pressure rises; check sensor and column."
        )
    at_target = np.array([branch(cycle.loading, recording.displacement, np.array([target]))[0] for cycle in compared])
    expected = deviations.at_target(path, target, predicted.curve, predicted.target)
    return Result(
        recordings=parts,
        aligned=recording,
        cycles=compared,
        pressure=grid,
        loading=loading,
        unloading=unloading,
        predicted=on_grid,
        target=Target(target, at_target, expected),
        overall=deviations.overall(grid, mean, on_grid) if has_curve else None,
        hysteresis=deviations.hysteresis(grid, loading, unloading, times),
        linearity=deviations.linearity(grid[known], mean[known]) if has_curve else deviations.linearity(grid, mean),
        predicted_linearity=deviations.linearity(grid[known], on_grid[known]) if has_curve else None,
        stiffness=deviations.stiffness(grid, mean, path) if has_curve else None,
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


def _joined(parts: tuple[Aligned, ...]) -> tuple[Recording, tuple[cycles.Cycle, ...]]:
    """All recordings one after the other, and their cycles there."""
    compared, start = [], 0
    for part in parts:
        compared += [cycle.later(start) for cycle in part.cycles]
        start += len(part.recording.pressure)
    each = [part.recording for part in parts]
    times = [one.time for one in each if one.time is not None]
    return replace(
        each[0],
        pressure=np.concatenate([one.pressure for one in each]),
        displacement=np.concatenate([one.displacement for one in each]),
        time=np.concatenate(times) if len(times) == len(each) else None,
    ), tuple(compared)


def _grid(pressure: Floats, compared: tuple[cycles.Cycle, ...], half_width: float, top: float) -> Floats:
    """Pressures (g,) that all branches reach, kPa; from 0 where they begin near it, else from where they begin."""
    branches = [rows for cycle in compared for rows in (cycle.loading, cycle.unloading) if rows is not None]
    start = max(float(pressure[rows].min()) for rows in branches)
    return np.linspace(0.0 if abs(start) <= 0.5 * half_width else start, top, POINTS)
