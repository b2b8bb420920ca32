"""The signals of a recorded test with a common zero and sign, without lost samples, and split into cycles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.failure import UnusableRecording
from stages.compare import cycles, lost
from stages.compare.noise import noise
from stages.compare.settings import Settings

#: Rows that are the zero if it is to be taken from the first ones.
FIRST_ROWS = 20
#: A last cycle that comes nearer than this share to the peak of the others is whole.
CUT = 0.02
#: Rows that begin or end a recording, by which it is told where it was at rest.
END_ROWS = 5


@dataclass(frozen=True)
class Recording:
    """A test as recorded, in the order of time.

    Attributes:
        pressure: (n,), kPa.
        displacement: (n,), mm; or what else answers the pressure.
        time: (n,), s, not decreasing; None if it was not recorded.
        answer: what the second signal is.
        unit: of the second signal.
    """

    pressure: Floats
    displacement: Floats
    time: Floats | None = None
    answer: str = "displacement"
    unit: str = "mm"


@dataclass(frozen=True)
class Alignment:
    """What was done to the signals.

    Attributes:
        pressure, displacement: their zeros as recorded, kPa and mm.
        rows: number of rows the zeros were taken from; 0 if they were left as recorded.
        turned: whether the displacement fell as the pressure rose, so that its sign was turned.
        lag: by which the displacement was moved back in time, s.
        pressure_turned: whether the pressure fell from rest, so that its sign was turned.
    """

    pressure: float
    displacement: float
    rows: int
    turned: bool
    lag: float
    pressure_turned: bool = False


@dataclass(frozen=True)
class Aligned:
    """A recording that can be compared.

    Attributes:
        recording: with its zeros and sign, without lost samples.
        alignment: what was done to the signals.
        cycles: those that reach the target, at least one.
        top: the smallest of their highest pressures, kPa.
        lost: samples that were left out.
        notes: sentences about what was left out.
    """

    recording: Recording
    alignment: Alignment
    cycles: tuple[cycles.Cycle, ...]
    top: float
    lost: tuple[lost.Lost, ...]
    notes: tuple[str, ...]


def aligned(measured: Recording, settings: Settings, target: float) -> Aligned:
    """Leave out lost samples, give the signals a common zero and the sign of a rise, and split the cycles.

    Args:
        measured: as recorded.
        settings: how.
        target: pressure that a cycle must reach to be compared, kPa.

    Raises:
        UnusableRecording: if there is no cycle to compare, a signal is constant, or no cycle reaches the target.
    """
    gone = lost.find(measured.pressure, measured.displacement, measured.answer)
    measured, rows = _without(measured, gone)
    sensor = settings.pressure_sensor
    reversed_ = _falls_from_rest(measured.pressure) if sensor == "auto" else sensor == "falls"
    upright = replace(measured, pressure=-measured.pressure) if reversed_ else measured
    found = cycles.split(upright.pressure, rows)
    recording, alignment = _with_zeros(upright, found, settings)
    alignment = replace(
        alignment, pressure=-alignment.pressure if reversed_ else alignment.pressure, pressure_turned=reversed_
    )
    zero = -alignment.pressure if reversed_ else alignment.pressure
    tops = [cycle.peak - zero for cycle in found.cycles]
    compared = tuple(cycle for cycle, top in zip(found.cycles, tops, strict=True) if top >= target)
    if not compared:
        raise UnusableRecording(
            f"the target pressure of {target:.4g} kPa is never reached, the highest is {max(tops):.4g} kPa; check unit "
            "and sensitivity, or compare at a lower target."
        )
    notes = _notes(found, compared, settings, recording, target)
    if _is_cut(compared, zero, len(rows)):
        compared = compared[:-1]
        notes = (*notes, "left out: the last cycle, which the recording's end cuts on its way up")
    top = min(cycle.peak for cycle in compared) - zero
    return Aligned(recording, alignment, compared, top, gone, notes)


def _is_cut(compared: tuple[cycles.Cycle, ...], zero: float, rows: int) -> bool:
    """Whether the last of several cycles ends with the recording before it comes as high as the others.

    All cycles are compared up to the lowest of their peaks, where the loops of the others are still open.
    """
    *others, last = compared
    if not others or last.unloading is not None or last.loading.stop < rows - END_ROWS:
        return False
    return last.peak - zero < (1.0 - CUT) * min(cycle.peak - zero for cycle in others)


def _without(measured: Recording, gone: tuple[lost.Lost, ...]) -> tuple[Recording, Ints]:
    """A recording without lost samples, and which of its rows are left."""
    kept = np.ones(len(measured.pressure), dtype=np.bool_)
    for each in gone:
        kept[each.rows] = False
    rows = np.flatnonzero(kept)
    if 2 * len(rows) <= len(kept):
        first = min(gone, key=lambda each: int(each.rows[0]))
        raise UnusableRecording(
            f"{len(kept) - len(rows)} of {len(kept)} rows hold no samples, the first with a {first.signal} of "
            f"{first.value:g}; check the sensor's connection, and record again."
        )
    time = None if measured.time is None else measured.time[kept]
    left = replace(measured, pressure=measured.pressure[kept], displacement=measured.displacement[kept], time=time)
    return left, rows


def _falls_from_rest(pressure: Floats) -> bool:
    """Whether a pressure falls from rest, as that of a sensor that is connected the other way round does.

    Rest is where most rows are: of the lowest and the highest level the one with more rows, if the recording begins
    there, or at neither and ends there.
    """
    low, high = float(pressure.min()), float(pressure.max())
    band = max(cycles.REST_SHARE * (high - low), cycles.REST_DEVIATIONS * noise(pressure))
    # The extremes of a noisy level lie outside its middle.
    at_low, at_high = (int((np.abs(pressure - level) <= 2.0 * band).sum()) for level in (low, high))

    def near(rows: Floats, level: float) -> bool:
        return abs(float(np.median(rows)) - level) <= cycles.NEAR_REST * (high - low)

    begins, ends = pressure[:END_ROWS], pressure[-END_ROWS:]
    at_rest = near(begins, high) or (not near(begins, low) and near(ends, high))
    return at_high > max(at_low, 2 * END_ROWS) and at_rest


def _with_zeros(measured: Recording, found: cycles.Cycles, settings: Settings) -> tuple[Recording, Alignment]:
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
    if abs(rise) <= max(2.0 * noise(displacement), 1e-9 * float(np.abs(displacement).max())):
        raise UnusableRecording(
            f"the {measured.answer} is constant: from rest to the highest pressure it changes by {abs(rise):.3g} "
            f"{measured.unit}, which is no more than its noise; check sensor, column and unit."
        )
    turned = rise < 0.0 if settings.sensor == "auto" else settings.sensor == "falls"
    sign = -1.0 if turned else 1.0
    shifted = replace(measured, pressure=measured.pressure - zeros[0], displacement=sign * (displacement - zeros[1]))
    return shifted, Alignment(zeros[0], zeros[1], int(rows.sum()), turned, settings.lag)


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
    if found.broken:
        notes.append(f"left out: {_counted(found.broken, 'cycle')} of which too many samples were lost")
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
