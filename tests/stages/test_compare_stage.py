"""What a comparison must find in synthetic tests whose truth is known, and what it refuses."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic import CURVE, PRESSURE, Truth, recording

from actuator.failure import UnusableRecording
from stages import compare
from stages.compare import Prediction, Recording, Result, Settings, cycles, deviations

POINT = Prediction(np.array([20.0]), np.array([23.0]), 20.0, False)
NOISY = Truth(quadratic=4.0, loop=1.2, noise=(0.02, 0.02), zeros=(1.3, 47.0), falls=True)


def compared(truth: Truth, predicted: Prediction = CURVE, **options: object) -> Result:
    return compare.run(recording(truth), predicted, Settings.model_validate(options))


# ------------------------------------------------------------------------------------------------ what must be found


@pytest.mark.parametrize("rate", [20.0, 500.0])
def test_known_deviation_hysteresis_and_linearity_are_found(rate: float) -> None:
    truth = dataclasses.replace(NOISY, rate=rate)
    result = compared(truth)
    assert len(result.cycles) == 3
    assert result.alignment.turned
    assert (result.alignment.pressure, result.alignment.displacement) == pytest.approx(truth.zeros, abs=0.05)
    expected = float(truth.loading(np.array([20.0]))[0])
    assert result.target.mean == pytest.approx(expected, abs=0.03)
    assert result.target.predicted == pytest.approx(28.0 * 0.8**1.5, abs=1e-3)
    assert result.target.deviation == pytest.approx(expected - 28.0 * 0.8**1.5, abs=0.03)
    assert result.target.spread is not None
    assert result.target.spread < 0.03
    assert result.hysteresis is not None
    assert result.hysteresis.area == pytest.approx(truth.area, abs=0.15)
    assert result.hysteresis.width == pytest.approx(truth.width, abs=0.15)
    assert result.hysteresis.at == pytest.approx(12.5, abs=1.5)
    assert result.linearity.largest == pytest.approx(truth.off_line, abs=0.15)
    assert result.linearity.r_squared == pytest.approx(truth.r_squared, abs=5e-4)
    np.testing.assert_allclose(result.mean_loading, truth.loading(result.pressure), atol=0.06)


def test_deviation_over_the_curve() -> None:
    result = compared(Truth())
    exact = 27.5 * result.pressure / 25.0 - 28.0 * (result.pressure / 25.0) ** 1.5
    assert result.overall is not None
    assert result.overall.rms == pytest.approx(np.sqrt(np.mean(exact**2)), abs=0.01)
    assert result.overall.largest == pytest.approx(exact.max(), abs=0.02)
    assert result.overall.at == pytest.approx(result.pressure[exact.argmax()], abs=0.6)
    assert result.predicted_linearity is not None
    assert result.predicted_linearity.r_squared < result.linearity.r_squared == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("factor", [0.6, 1.0, 1.37])
def test_stiffness_that_fits_is_found(factor: float) -> None:
    """A material that is stiffer by a factor needs all pressures higher by it."""
    truth = Truth(linear=20.0, quadratic=8.0)
    softer = Prediction(PRESSURE / factor, truth.loading(PRESSURE), 20.0 / factor, True)
    result = compared(truth, softer, target=15.0)
    assert result.stiffness is not None
    assert result.stiffness.inside
    assert result.stiffness.factor == pytest.approx(factor, rel=2e-3)
    assert result.stiffness.rms < 0.03
    assert result.overall is not None
    assert result.stiffness.rms <= result.overall.rms


def test_stiffness_beyond_the_range_is_told() -> None:
    result = compared(Truth(linear=2.0))
    assert result.stiffness is not None
    assert not result.stiffness.inside


@pytest.mark.parametrize("late", [0.2, 0.6])
def test_lag_looks_like_hysteresis_and_can_be_taken_out(late: float) -> None:
    found = compared(Truth(late=late)).hysteresis
    assert found is not None
    assert found.area > 2.0
    assert found.lag == pytest.approx(late, rel=0.1)
    corrected = compared(Truth(late=late), lag=late).hysteresis
    assert corrected is not None
    assert corrected.area == pytest.approx(0.0, abs=0.15)


def test_spread_over_the_cycles() -> None:
    one, other = (recording(Truth(cycles=1, linear=linear)) for linear in (27.0, 28.0))
    both = Recording(np.tile(one.pressure, 2), np.concatenate([one.displacement, other.displacement]))
    result = compare.run(both, CURVE, Settings())
    np.testing.assert_allclose(result.target.measured, [0.8 * 27.0, 0.8 * 28.0], rtol=1e-6)
    assert result.target.spread == pytest.approx(0.8 / np.sqrt(2.0))
    assert any("no time column" in note for note in result.notes)
    assert result.hysteresis is not None
    assert result.hysteresis.lag is None


def test_few_rows_as_read_off_by_hand() -> None:
    truth = Truth(loop=1.0, cycles=1, seconds=20.0, rate=1.0, rest=2.0)
    result = compared(truth)
    assert result.target.mean == pytest.approx(22.0, abs=1e-6)
    assert result.hysteresis is not None
    assert result.hysteresis.area == pytest.approx(truth.area, rel=0.03)


def test_straight_response_in_noise_of_the_paper_s_sensors_has_no_hysteresis() -> None:
    found = compared(Truth(noise=(0.05, 0.02), rate=500.0)).hysteresis
    assert found is not None
    assert abs(found.area) < 0.1


# ------------------------------------------------------------------------------------------------ what must not matter


@given(
    pressure=st.floats(-100.0, 100.0),
    displacement=st.floats(-1000.0, 1000.0),
    falls=st.booleans(),
    dropped=st.integers(0, 55),
)
@settings(deadline=None, max_examples=12)
def test_zeros_sign_and_length_of_rest_do_not_matter(
    pressure: float, displacement: float, falls: bool, dropped: int
) -> None:
    plain = compared(dataclasses.replace(NOISY, zeros=(0.0, 0.0), falls=False, noise=(0.0, 0.0)))
    made = recording(dataclasses.replace(NOISY, zeros=(pressure, displacement), falls=falls, noise=(0.0, 0.0)))
    assert made.time is not None
    result = compare.run(
        Recording(made.pressure[dropped:], made.displacement[dropped:], made.time[dropped:]), CURVE, Settings()
    )
    assert result.alignment.turned == falls
    assert result.target.mean == pytest.approx(plain.target.mean, abs=1e-3)
    assert result.hysteresis is not None
    assert plain.hysteresis is not None
    assert result.hysteresis.area == pytest.approx(plain.hysteresis.area, abs=0.02)
    assert result.linearity.largest == pytest.approx(plain.linearity.largest, abs=0.02)


@given(slope=st.floats(-5.0, 5.0), intercept=st.floats(-10.0, 10.0), seed=st.integers(0, 100), rows=st.integers(5, 400))
@settings(deadline=None)
def test_straight_branch_is_kept(slope: float, intercept: float, seed: int, rows: int) -> None:
    """Wherever its rows lie, and in any order."""
    pressure = np.random.default_rng(seed).uniform(0.0, 25.0, rows)
    grid = np.linspace(pressure.min(), pressure.max(), 50)
    found = cycles.curve(pressure, slope * pressure + intercept, grid, 0.5)
    # Bins at the ends of few rows hold the end itself only on average.
    np.testing.assert_allclose(found, slope * grid + intercept, atol=0.13 * abs(slope) + 1e-9)


def test_pressure_held_at_a_level_counts_once() -> None:
    pressure = np.linspace(0.0, 25.0, 500)
    held = np.concatenate([pressure, np.full(20_000, 10.1)])
    grid = np.linspace(0.0, 25.0, 101)
    np.testing.assert_allclose(
        cycles.curve(held, held**2, grid, 0.5), cycles.curve(pressure, pressure**2, grid, 0.5), atol=0.3
    )


def test_zero_and_sensor_as_told() -> None:
    truth = Truth(zeros=(1.0, 2.0))
    as_recorded = compared(truth, zero="none")
    assert as_recorded.alignment.rows == 0
    assert as_recorded.target.mean == pytest.approx(2.0 + 1.1 * 19.0, abs=1e-6)
    assert compared(truth, zero="first").target.mean == pytest.approx(22.0, abs=1e-6)
    assert compared(truth, sensor="falls").target.mean == pytest.approx(-22.0, abs=1e-6)
    late = recording(truth)
    begun = Recording(late.pressure[100:], late.displacement[100:])
    assert any("not all at rest" in note for note in compare.run(begun, CURVE, Settings(zero="first")).notes)


# ------------------------------------------------------------------------------------------------ parts of recordings


def rows_of(truth: Truth, start: int = 0, stop: int | None = None) -> Recording:
    made = recording(truth)
    assert made.time is not None
    return Recording(made.pressure[start:stop], made.displacement[start:stop], made.time[start:stop])


def test_loading_alone_is_compared_without_hysteresis() -> None:
    result = compare.run(rows_of(Truth(cycles=1, loop=1.0), 0, 360), CURVE, Settings())
    assert result.hysteresis is None
    assert result.target.mean == pytest.approx(22.0, abs=1e-6)
    assert np.isnan(result.mean_unloading).all()
    assert any("without whole unloading" in note for note in result.notes)


def test_recording_that_stops_on_the_way_down() -> None:
    result = compare.run(rows_of(Truth(loop=1.0), 0, 3 * 600 - 60), CURVE, Settings())
    assert len(result.cycles) == 3
    assert result.hysteresis is not None
    assert len(result.hysteresis.areas) == 2
    assert result.hysteresis.area == pytest.approx(Truth(loop=1.0).area, rel=0.01)


def test_recording_that_begins_at_the_highest_pressure() -> None:
    result = compare.run(rows_of(Truth(), 360), CURVE, Settings())
    assert len(result.cycles) == 2
    assert result.target.mean == pytest.approx(22.0, abs=1e-3)


def test_rise_that_does_not_begin_at_rest_is_left_out() -> None:
    result = compare.run(rows_of(Truth(), 240), CURVE, Settings())  # from 15 kPa upwards
    assert len(result.cycles) == 2
    assert "left out: 1 rise of the pressure that did not begin near rest" in result.notes
    assert result.target.mean == pytest.approx(22.0, abs=1e-3)


def test_cycle_that_does_not_reach_the_target_is_left_out() -> None:
    first, second = recording(Truth(peak=12.0, cycles=1)), recording(Truth(cycles=2))
    both = Recording(
        np.concatenate([first.pressure, second.pressure]), np.concatenate([first.displacement, second.displacement])
    )
    result = compare.run(both, CURVE, Settings())
    assert len(result.cycles) == 2
    assert "left out: 1 cycle that did not reach 20 kPa" in result.notes
    assert len(compare.run(both, CURVE, Settings(target=10.0)).cycles) == 3


def test_hand_that_wavers_at_the_regulator() -> None:
    """Plateaus and steps back of 2 kPa are no turning points."""
    made = recording(Truth(loop=1.0))
    assert made.time is not None
    wavering = Recording(made.pressure + np.sin(made.time), made.displacement + 1.1 * np.sin(made.time), made.time)
    result = compare.run(wavering, CURVE, Settings())
    assert len(result.cycles) == 3
    assert result.hysteresis is not None
    assert result.hysteresis.area == pytest.approx(Truth(loop=1.0).area, abs=0.7)


def test_point_is_no_curve() -> None:
    result = compared(Truth(loop=1.0), POINT)
    assert result.target.deviation == pytest.approx(22.0 - 23.0, abs=1e-6)
    assert result.target.percent == pytest.approx(100.0 * (22.0 / 23.0 - 1.0), abs=1e-4)
    assert (result.overall, result.stiffness, result.predicted_linearity) == (None, None, None)
    assert np.isnan(result.predicted).all()
    assert compared(Truth(), POINT, target=15.0).target.predicted is None


def test_prediction_that_ends_below_the_measurement_is_not_continued() -> None:
    short = Prediction(CURVE.pressure[:17], CURVE.displacement[:17], 20.0, True)
    result = compared(Truth(), short)
    assert result.overall is not None
    assert result.overall.pressures[1] <= 16.0
    assert result.target.predicted is None
    assert np.isnan(result.predicted[result.pressure > 16.01]).all()


def test_snap_through_is_passed_at_its_pressure() -> None:
    pressure, displacement = np.array([5.0, 10.0, 8.0, 9.0, 12.0]), np.array([1.0, 2.0, 6.0, 8.0, 10.0])
    found = deviations.rising(pressure, displacement)
    np.testing.assert_array_equal(found[0], [0.0, 5.0, 10.0, 12.0])
    np.testing.assert_array_equal(found[1], [0.0, 1.0, 2.0, 10.0])


# ------------------------------------------------------------------------------------------------ what is refused

GOOD = recording(Truth())
ROWS = len(GOOD.pressure)
SPIKED = GOOD.pressure.copy()
SPIKED[20:24] = [25.0, 24.9, 24.8, 24.7]  # and the displacement with it: no lost sample
REFUSED = {
    "there are 9 rows, and 10 are needed": Recording(GOOD.pressure[:9], GOOD.displacement[:9]),
    "the pressure is constant": Recording(np.full(ROWS, 3.0), GOOD.displacement),
    "no more than its noise; check sensor": Recording(np.random.default_rng(1).normal(size=ROWS), GOOD.displacement),
    "the displacement is constant": Recording(GOOD.pressure, np.full(ROWS, 3.0)),
    "the pressure only falls": Recording(GOOD.pressure[360:600], GOOD.displacement[360:600]),
    "no loading part that begins at rest": Recording(GOOD.pressure[240:600], GOOD.displacement[240:600]),
    "a whole loading part of fewer than 5 rows": Recording(SPIKED[:-50], 1.1 * SPIKED[:-50]),
    "leaves out 25 kPa between two rows": Recording(np.where(GOOD.pressure > 12.5, 25.0, 0.0), GOOD.displacement),
    "the displacement is constant while the pressure rises": Recording(
        GOOD.pressure, np.concatenate([np.zeros(660), GOOD.displacement[660:]])
    ),
    "the target pressure of 20 kPa is never reached, the highest is 12.5 kPa": Recording(
        0.5 * GOOD.pressure, GOOD.displacement
    ),
}


@pytest.mark.parametrize("sentence", REFUSED)
def test_unusable_recordings_are_refused_with_a_remedy(sentence: str) -> None:
    with pytest.raises(UnusableRecording, match=sentence) as caught:
        compare.run(REFUSED[sentence], CURVE, Settings())
    assert str(caught.value).endswith(".")
    assert ";" in str(caught.value)


def test_lag_needs_times() -> None:
    with pytest.raises(UnusableRecording, match="leave the lag at 0"):
        compare.run(Recording(GOOD.pressure, GOOD.displacement), CURVE, Settings(lag=0.1))


# ------------------------------------------------------------------------------------------------ sign, cuts, several


@pytest.mark.parametrize("offset", [0.0, 25.0, 101.3])
def test_reversed_pressure_sensor_is_turned(offset: float) -> None:
    made = recording(Truth(linear=5.0, quadratic=37.5, noise=(0.01, 0.0)))
    result = compare.run(Recording(offset - made.pressure, made.displacement), CURVE, Settings())
    assert result.alignment.pressure_turned
    assert result.alignment.pressure == pytest.approx(offset, abs=0.02)
    assert result.target.mean == pytest.approx(28.0, abs=0.05)
    upright = compare.run(made, CURVE, Settings())
    assert not upright.alignment.pressure_turned
    told = Settings(pressure_sensor="falls")
    assert compare.run(Recording(offset - made.pressure, made.displacement), CURVE, told).alignment.pressure_turned


def test_last_cycle_cut_on_its_way_up_does_not_shorten_the_others() -> None:
    result = compare.run(rows_of(Truth(loop=1.0), 0, 1520), CURVE, Settings())  # at 21.7 kPa
    assert len(result.cycles) == 2
    assert any("cuts on its way up" in note for note in result.notes)
    assert result.hysteresis is not None
    assert result.hysteresis.area == pytest.approx(Truth(loop=1.0).area, rel=0.01)


def test_several_recordings_are_averaged_each_from_its_own_zero() -> None:
    truths = [Truth(linear=linear, cycles=2, zeros=(linear, -linear)) for linear in (27.0, 28.0, 29.5)]
    result = compare.run([recording(truth) for truth in truths], CURVE, Settings())
    assert len(result.cycles) == 6
    np.testing.assert_allclose(result.at_target, [0.8 * truth.linear for truth in truths], atol=1e-6)
    assert result.target.mean == pytest.approx(0.8 * np.mean([truth.linear for truth in truths]))
    assert [part.alignment.displacement for part in result.recordings] == pytest.approx([-27.0, -28.0, -29.5])
