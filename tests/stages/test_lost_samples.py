"""Samples that were lost are found in a test whose truth is known, and nothing that was measured is taken for one."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from synthetic import CURVE, Truth, recording

from actuator.failure import UnusableRecording
from stages import compare
from stages.compare import Recording, Settings, lost

SLOW = Truth(loop=1.0, noise=(0.03, 0.02), rate=10.0)
SLOW_ONE = recording(SLOW)
#: Rows that are lost, and what a logger writes there.
LOST: dict[str, tuple[slice, float]] = {
    "one row of 9999": (slice(305, 306), 9999.0),
    "a spike of twice the range": (slice(180, 181), 60.0),
    "zeros in the middle": (slice(150, 170), 0.0),
    "every third row": (slice(1, None, 3), 0.0),
    "the last value": (slice(100, 130), np.nan),
    "an overflow at the beginning": (slice(0, 5), 65535.0),
}


def spoilt(values: np.ndarray, rows: slice, value: float) -> np.ndarray:
    found = values.copy()
    found[rows] = values[rows.start] if np.isnan(value) else value
    return found


@pytest.mark.parametrize("which", ["pressure", "displacement", "both"])
@pytest.mark.parametrize("kind", LOST)
def test_lost_samples_are_found_and_left_out(kind: str, which: str) -> None:
    made, (rows, value) = recording(SLOW), LOST[kind]
    pressure, displacement = (
        spoilt(signal, rows, value) if which in (name, "both") else signal
        for name, signal in (("pressure", made.pressure), ("displacement", made.displacement))
    )
    result = compare.run(Recording(pressure, displacement, made.time), CURVE, Settings())
    found = {lost.signal for lost in result.recordings[0].lost}
    assert found == ({"pressure", "displacement"} if which == "both" else {which})
    clean = compare.run(made, CURVE, Settings())
    assert result.target.mean == pytest.approx(clean.target.mean, abs=0.03)
    assert result.hysteresis is not None
    assert clean.hysteresis is not None
    assert result.hysteresis.area == pytest.approx(clean.hysteresis.area, abs=0.3)


def staircase(lag: float) -> Recording:
    """Steps of a digital regulator, whose setpoint is recorded, and a part that follows."""
    pressure = np.repeat(np.tile([0.0, 5, 10, 15, 20, 25, 20, 15, 10, 5], 3), 20)
    displacement = np.zeros(len(pressure))
    for row in range(1, len(pressure)):
        displacement[row] = displacement[row - 1] + lag * (1.1 * pressure[row] - displacement[row - 1])
    return Recording(pressure, displacement)


def snapping() -> Recording:
    made = recording(SLOW)
    return Recording(made.pressure, np.where(made.displacement > 12.0, made.displacement + 10.0, made.displacement))


#: Signals of parts and sensors in which nothing is lost.
WHOLE = {
    "few rows": recording(Truth(rate=0.5, seconds=20.0)),
    "coarse steps": Recording(np.round(recording(SLOW).pressure), np.round(recording(SLOW).displacement)),
    "no less than zero": Recording(
        *(np.maximum(np.round(v, 1), 0.0) for v in (SLOW_ONE.pressure, SLOW_ONE.displacement))
    ),
    "much noise": recording(dataclasses.replace(SLOW, noise=(0.3, 0.5))),
    "staircase": staircase(1.0),
    "staircase with creep": staircase(0.2),
    "snap-through": snapping(),
    "long rest": recording(Truth(cycles=1, rest=600.0, noise=(0.03, 0.02), rate=2.0)),
}


@pytest.mark.parametrize("kind", WHOLE)
def test_what_was_measured_is_not_lost(kind: str) -> None:
    made = WHOLE[kind]
    assert lost.find(made.pressure, made.displacement, "displacement") == ()


def test_too_many_lost_samples_are_refused() -> None:
    made = recording(SLOW)
    spoilt_rows = np.arange(len(made.pressure)) % 9 > 2
    with pytest.raises(UnusableRecording, match="hold no samples"):
        compare.run(Recording(np.where(spoilt_rows, 0.0, made.pressure), made.displacement), CURVE, Settings())
