"""How a measured response differs from a predicted one: the numbers of ``poro compare``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats

#: Pressures (m,), kPa, strictly increasing, and displacements (m,), mm.
Path = tuple[Floats, Floats]

#: Range in which a stiffness factor is looked for, and the number of steps of the first look.
FACTORS, STEPS = (0.25, 4.0), 241


@dataclass(frozen=True)
class Target:
    """At the target pressure, while loading.

    Attributes:
        pressure: kPa.
        measured: (c,), in each cycle, mm.
        predicted: mm; None where the prediction does not say.
    """

    pressure: float
    measured: Floats
    predicted: float | None

    @property
    def mean(self) -> float:
        """Of the cycles, mm."""
        return float(self.measured.mean())

    @property
    def spread(self) -> float | None:
        """Standard deviation over the cycles, mm; None for one cycle."""
        return float(self.measured.std(ddof=1)) if len(self.measured) > 1 else None

    @property
    def deviation(self) -> float | None:
        """Measured minus predicted, mm."""
        return None if self.predicted is None else self.mean - self.predicted

    @property
    def percent(self) -> float | None:
        """The deviation over the prediction, %."""
        return 100.0 * (self.mean / self.predicted - 1.0) if self.predicted else None


@dataclass(frozen=True)
class Overall:
    """Averaged loading minus prediction, over all pressures where both are known.

    Attributes:
        pressures: the lowest and the highest of them, kPa.
        rms: root mean square, mm.
        largest: of largest size, with its sign, mm.
        at: where that is, kPa.
    """

    pressures: tuple[float, float]
    rms: float
    largest: float
    at: float


@dataclass(frozen=True)
class Hysteresis:
    """Unloading against loading, averaged over the cycles with a whole unloading.

    Attributes:
        area: between the branches, over that under loading, %.
        areas: (c,), the same for each of these cycles, %.
        width: largest distance of the branches over the full scale of loading, %.
        at: where that is, kPa.
        lag: by which the displacement's signal would have to be late to explain all of it, s; None without times.
    """

    area: float
    areas: Floats
    width: float
    at: float
    lag: float | None


@dataclass(frozen=True)
class Linearity:
    """The straight line that fits a loading curve best.

    Attributes:
        slope: mm/kPa.
        intercept: mm.
        r_squared: share of the displacement's variance that the line explains.
        largest: largest distance from the line over the full scale, %.
    """

    slope: float
    intercept: float
    r_squared: float
    largest: float


@dataclass(frozen=True)
class Stiffness:
    """The stiffness at which the prediction fits best, all its pressures being proportional to it.

    Attributes:
        factor: over that of the prediction.
        rms: root mean square deviation that is left, mm.
        inside: whether it lies inside the range that was looked through.
    """

    factor: float
    rms: float
    inside: bool


def rising(pressure: Floats, displacement: Floats) -> Path:
    """The part of a path that is seen while the pressure rises: points above all pressures before; from the origin.

    Where equilibrium would need a falling pressure, a part under controlled pressure jumps to the next such point.
    """
    p, d = np.concatenate([[0.0], pressure]), np.concatenate([[0.0], displacement])
    higher = np.concatenate([[True], p[1:] > np.maximum.accumulate(p)[:-1]])
    return p[higher], d[higher]


def response(path: Path) -> Callable[[Floats], Floats]:
    """Displacements on a path at pressures (g,); NaN where it does not reach.

    Piecewise cubic, without overshoot between the points (Fritsch & Butland 1984, doi:10.1137/0905021).
    """
    from scipy.interpolate import PchipInterpolator  # slow to load: only where a recording is compared

    cubic, last = PchipInterpolator(*path), path[0][-1]

    def at(pressure: Floats) -> Floats:
        # The last pressure may have been computed in two ways.
        covered = (pressure >= 0.0) & (pressure <= last * (1.0 + 1e-9))
        return np.where(covered, cubic(np.clip(pressure, 0.0, last)), np.nan)

    return at


def at_target(path: Path, target: float, curve: bool, known: float) -> float | None:
    """Predicted displacement at the target, mm; of a prediction without a curve only at the pressure ``known``."""
    if not curve:
        return float(path[1][-1]) if abs(target - known) <= 1e-3 * known and np.isfinite(path[1][-1]) else None
    found = float(response(path)(np.array([target]))[0])
    return found if np.isfinite(found) else None


def overall(pressure: Floats, measured: Floats, predicted: Floats) -> Overall:
    """Deviation over all pressures (g,) where both displacements (g,) are known."""
    known = np.isfinite(predicted)
    deviation, p = (measured - predicted)[known], pressure[known]
    worst = int(np.abs(deviation).argmax())
    rms = float(np.sqrt(np.mean(deviation**2)))
    return Overall((float(p[0]), float(p[-1])), rms, float(deviation[worst]), float(p[worst]))


def hysteresis(
    pressure: Floats, loading: Floats, unloading: Floats, times: tuple[Floats, Floats] | None
) -> Hysteresis | None:
    """Area and width of the loop.

    Args:
        pressure: (g,), kPa.
        loading, unloading: (c, g), mm; NaN for cycles without whole unloading.
        times: on loading and on unloading, (c, g) each, s; None if they are not known.
    """
    whole = np.isfinite(unloading).all(axis=1)
    if not whole.any():
        return None
    gaps = unloading[whole] - loading[whole]
    areas = [
        float(np.trapezoid(gap, pressure) / np.trapezoid(under, pressure))
        for gap, under in zip(gaps, loading[whole], strict=True)
    ]
    gap, mean = gaps.mean(axis=0), loading[whole].mean(axis=0)
    widest = int(np.abs(gap).argmax())
    lag = None
    if times is not None:
        # A displacement that is late by tau lies below the true one by d' p' tau on loading, above it on unloading.
        # In steps of a tenth of the pressure, since between neighbours of the grid a hand at a regulator may turn back.
        steps = slice(None, None, (len(pressure) - 1) // 10)
        rise = np.diff(loading[whole][:, steps], axis=1)
        passed = [np.abs(np.diff(side[whole][:, steps], axis=1)) for side in times]
        speed = sum(np.divide(np.diff(pressure[steps]), dt, where=dt > 0.0, out=np.zeros_like(dt)) for dt in passed)
        late = float((rise * speed).sum(axis=1).mean())
        lag = float(np.trapezoid(gap, pressure)) / late if late > 0.0 else None
    return Hysteresis(
        area=100.0 * float(np.trapezoid(gap, pressure) / np.trapezoid(mean, pressure)),
        areas=100.0 * np.array(areas),
        width=100.0 * float(np.abs(gap[widest]) / np.ptp(mean)),
        at=float(pressure[widest]),
        lag=lag,
    )


def linearity(pressure: Floats, displacement: Floats) -> Linearity:
    """The best straight line through a curve (g,)."""
    slope, intercept = np.polyfit(pressure, displacement, 1)
    off = displacement - (slope * pressure + intercept)
    variance = float(np.sum((displacement - displacement.mean()) ** 2))
    return Linearity(
        slope=float(slope),
        intercept=float(intercept),
        r_squared=1.0 - float(np.sum(off**2)) / variance if variance > 0.0 else 1.0,  # of a level curve nothing is left
        largest=100.0 * float(np.abs(off).max() / np.ptp(displacement)) if variance > 0.0 else 0.0,
    )


def stiffness(pressure: Floats, measured: Floats, path: Path) -> Stiffness:
    """Least squares over one factor on all predicted pressures.

    Args:
        pressure, measured: (g,), kPa and mm.
        path: of the prediction.
    """
    from scipy.optimize import minimize_scalar  # slow to load: only where a recording is compared

    # Else a soft part, whose prediction ends early, would be judged by its first points.
    uncovered = 10.0 * float(np.abs(measured).max() + np.abs(path[1]).max())
    predicted = response(path)
    fewest = np.isfinite(predicted(pressure)).sum() / 2

    def rms(factor: float) -> float:
        left = measured - predicted(pressure / factor)
        known = np.isfinite(left)
        return float(np.sqrt(np.mean(left[known] ** 2))) if known.sum() >= fewest else uncovered

    # There may be several minima: first a look at all of the range, in equal ratios; 1 is one of them.
    looked = np.geomspace(*FACTORS, STEPS)
    best = int(np.argmin([rms(factor) for factor in looked.tolist()]))
    bounds = looked[max(best - 1, 0)], looked[min(best + 1, STEPS - 1)]
    found = minimize_scalar(rms, bounds=bounds, method="bounded", options={"xatol": 1e-6})
    factor = min((float(found.x), float(looked[best])), key=rms)
    return Stiffness(factor, rms(factor), 0 < best < STEPS - 1)


def mean_of_whole(curves: Floats) -> Floats:
    """Mean (g,) of the curves (c, g) that are known; NaN if there is none."""
    whole = np.isfinite(curves).all(axis=1)
    return curves[whole].mean(axis=0) if whole.any() else np.full(curves.shape[1], np.nan)
