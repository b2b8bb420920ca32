"""A recorded test of a printed actuator against its prediction (Section 5 of the paper).

The rig of the paper records the inlet pressure and the deflection of the spring's end while the pressure is raised by
hand beyond its target and slowly lowered again, several times. Here the two signals get a common zero, the cycles are
separated, and each branch becomes a curve over the pressure, so that repetitions can be averaged and compared.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import Field

from actuator.arrays import Floats
from actuator.failure import UnusableRecording
from stages.compare import cycles, deviations
from stages.compare.deviations import Hysteresis, Linearity, Overall, Stiffness, Target
from stages.settings import Section
from stages.words import Sensor, Zero

#: Points of the common pressure grid.
POINTS = 101
#: Rows that are the zero if it is to be taken from the first ones.
FIRST_ROWS = 20


class Settings(Section):
    """How a recording is aligned and compared."""

    target: float | None = Field(
        None, gt=0, description="pressure at which deviations are reported; p_in if not given [kPa]"
    )
    zero: Zero = Field("rest", description="zero of both signals: median at rest, of the first rows, or as recorded")
    sensor: Sensor = Field("auto", description="what the displacement's signal does as the pressure rises")
    smoothing: float = Field(
        0.02, gt=0, le=0.2, description="half width of the regression's window over the largest common pressure [-]"
    )
    lag: float = Field(0.0, ge=-60, le=60, description="by which the displacement's signal is late [s]")


@dataclass(frozen=True)
class Recording:
    """A test as recorded, in the order of time.

    Attributes:
        pressure: (n,), kPa.
        displacement: (n,), mm.
        time: (n,), s, not decreasing; None if it was not recorded.
    """

    pressure: Floats
    displacement: Floats
    time: Floats | None = None


@dataclass(frozen=True)
class Prediction:
    """The part's predicted response while the pressure rises.

    Attributes:
        pressure: (m,), kPa, along the path.
        displacement: (m,), mm, of the spring's end.
        target: p̄_in, the pressure the part was designed for, kPa.
        curve: whether these are a curve; else only the last point is known, and nothing may be read between.
    """

    pressure: Floats
    displacement: Floats
    target: float
    curve: bool


@dataclass(frozen=True)
class Alignment:
    """What was done to the signals.

    Attributes:
        pressure, displacement: their zeros as recorded, kPa and mm.
        rows: number of rows the zeros were taken from; 0 if they were left as recorded.
        turned: whether the displacement fell as the pressure rose, so that its sign was turned.
        lag: by which the displacement was moved back in time, s.
    """

    pressure: float
    displacement: float
    rows: int
    turned: bool
    lag: float


@dataclass(frozen=True)
class Result:
    """A recording, its averaged curves, and how they differ from the prediction.

    Attributes:
        aligned: the recording with its zeros and sign.
        cycles: those compared, c of them.
        alignment: what was done to the signals.
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

    aligned: Recording
    cycles: tuple[cycles.Cycle, ...]
    alignment: Alignment
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
    def mean_loading(self) -> Floats:
        """(g,), mm, over the cycles."""
        return self.loading.mean(axis=0)

    @property
    def mean_unloading(self) -> Floats:
        """(g,), mm, over the cycles with a whole unloading; NaN if there is none."""
        return deviations.mean_of_whole(self.unloading)


def run(measured: Recording, predicted: Prediction, settings: Settings) -> Result:
    """Align a recording, split and average its cycles, and compare them with a prediction.

    Args:
        measured: as recorded.
        predicted: scaled to the printed part.
        settings: how.

    Raises:
        UnusableRecording: if there is no cycle to compare, a signal is constant, or no cycle reaches the target.
    """
    found = cycles.split(measured.pressure)
    aligned, alignment = _aligned(measured, found, settings)
    target = predicted.target if settings.target is None else settings.target
    tops = [cycle.peak - alignment.pressure for cycle in found.cycles]
    compared = tuple(cycle for cycle, top in zip(found.cycles, tops, strict=True) if top >= target)
    if not compared:
        raise UnusableRecording(
            f"the target pressure of {target:.4g} kPa is never reached, the highest is {max(tops):.4g} kPa; check unit "
            "and sensitivity, or compare at a lower target."
        )
    notes = _notes(found, compared, settings, measured, target)
    top = min(cycle.peak for cycle in compared) - alignment.pressure
    half_width = settings.smoothing * top
    grid = _grid(aligned.pressure, compared, half_width, top)

    def branch(rows: slice | None, values: Floats, at: Floats = grid) -> Floats:
        if rows is None:
            return np.full(len(at), np.nan)
        return cycles.curve(aligned.pressure[rows], values[rows], at, half_width)

    def both(values: Floats) -> tuple[Floats, Floats]:
        sides = [cycle.loading for cycle in compared], [cycle.unloading for cycle in compared]
        loading, unloading = (np.array([branch(rows, values) for rows in side]) for side in sides)
        return loading, unloading

    loading, unloading = both(aligned.displacement)
    times = None if aligned.time is None else both(aligned.time)
    path = deviations.rising(predicted.pressure, predicted.displacement)
    on_grid = deviations.response(path)(grid) if predicted.curve else np.full(POINTS, np.nan)
    known = np.isfinite(on_grid)
    has_curve = int(known.sum()) >= POINTS // 10
    mean = loading.mean(axis=0)
    if not (np.ptp(loading, axis=1) > 0.0).all():
        raise UnusableRecording("the displacement is constant while the pressure rises; check sensor and column.")
    at_target = np.array([branch(cycle.loading, aligned.displacement, np.array([target]))[0] for cycle in compared])
    expected = deviations.at_target(path, target, predicted.curve, predicted.target)
    return Result(
        aligned=aligned,
        cycles=compared,
        alignment=alignment,
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
        notes=notes,
    )


def _aligned(measured: Recording, found: cycles.Cycles, settings: Settings) -> tuple[Recording, Alignment]:
    """The recording with its zeros, its sign and without its lag."""
    displacement = measured.displacement
    if settings.lag:
        if measured.time is None:
            raise UnusableRecording(
                "a lag can only be taken out of a recording with a time column; leave the lag at 0."
            )
        # What the displacement's signal shows at t + lag happened at t.
        displacement = np.interp(measured.time + settings.lag, measured.time, displacement)
    rows = {
        "rest": found.rest,
        "first": np.arange(len(displacement)) < FIRST_ROWS,
        "none": np.zeros(len(displacement), dtype=np.bool_),
    }[settings.zero]
    zeros = [float(np.median(signal[rows])) if rows.any() else 0.0 for signal in (measured.pressure, displacement)]
    top = np.concatenate([_top(measured.pressure, displacement, cycle) for cycle in found.cycles])
    rise = float(np.median(top)) - float(np.median(displacement[found.rest]))
    if abs(rise) <= max(2.0 * cycles.noise(displacement), 1e-9 * float(np.abs(displacement).max())):
        raise UnusableRecording(
            f"the displacement is constant: from rest to the highest pressure it changes by {abs(rise):.3g} mm, which "
            "is no more than its noise; check sensor, column and unit."
        )
    turned = rise < 0.0 if settings.sensor == "auto" else settings.sensor == "falls"
    sign = -1.0 if turned else 1.0
    aligned = Recording(measured.pressure - zeros[0], sign * (displacement - zeros[1]), measured.time)
    return aligned, Alignment(zeros[0], zeros[1], int(rows.sum()), turned, settings.lag)


def _grid(pressure: Floats, compared: tuple[cycles.Cycle, ...], half_width: float, top: float) -> Floats:
    """Pressures (g,) that all branches reach, kPa; from 0 where they begin near it, else from where they begin."""
    branches = [rows for cycle in compared for rows in (cycle.loading, cycle.unloading) if rows is not None]
    start = max(float(pressure[rows].min()) for rows in branches)
    return np.linspace(0.0 if abs(start) <= 0.5 * half_width else start, top, POINTS)


def _top(pressure: Floats, displacement: Floats, cycle: cycles.Cycle) -> Floats:
    """Displacements in the uppermost tenth of a loading's pressures."""
    p, d = pressure[cycle.loading], displacement[cycle.loading]
    return d[p >= p.max() - 0.1 * np.ptp(p)]


def _notes(
    found: cycles.Cycles,
    compared: tuple[cycles.Cycle, ...],
    settings: Settings,
    measured: Recording,
    target: float,
) -> tuple[str, ...]:
    """Sentences about what was left out."""
    notes = []
    if found.skipped:
        notes.append(f"left out: {_counted(found.skipped, 'rise')} of the pressure that did not begin near rest")
    if len(compared) < len(found.cycles):
        missing = _counted(len(found.cycles) - len(compared), "cycle")
        notes.append(f"left out: {missing} that did not reach {target:.4g} kPa")
    open_ended = sum(cycle.unloading is None for cycle in compared)
    if open_ended:
        notes.append(f"{_counted(open_ended, 'cycle')} without whole unloading; they count for loading only")
    if settings.zero == "first" and not found.rest[:FIRST_ROWS].all():
        notes.append("the first rows, taken for the zero, are not all at rest")
    if measured.time is None:
        notes.append("no time column: the effect of a lag between the sensors is not known")
    return tuple(notes)


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
