"""Synthetic tests of an actuator: made by formulas, so that what a comparison must find is known. Nothing is measured.

Run as a program, it writes the example of the documents.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from actuator.arrays import Floats
from stages.compare import Prediction, Recording

EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "synthetic-measurement.csv"


@dataclass(frozen=True)
class Truth:
    """What a synthetic test is made of.

    With x = p / peak, loading is ``linear`` x + ``quadratic`` x², and unloading lies 4 ``loop`` x (1 - x) above it, mm.

    Attributes:
        peak: highest pressure, kPa.
        cycles: number of triangles of the pressure over time.
        seconds, rest, rate: of a cycle, at rest before and after them, and rows a second.
        noise: standard deviations of pressure and displacement, kPa and mm.
        zeros: pressure and displacement at rest, kPa and mm.
        falls: whether the displacement's signal falls as the spring extends.
        late: by which the displacement is recorded late, s.
    """

    peak: float = 25.0
    linear: float = 27.5
    quadratic: float = 0.0
    loop: float = 0.0
    cycles: int = 3
    seconds: float = 30.0
    rest: float = 3.0
    rate: float = 20.0
    noise: tuple[float, float] = (0.0, 0.0)
    zeros: tuple[float, float] = (0.0, 0.0)
    falls: bool = False
    late: float = 0.0

    def loading(self, pressure: Floats) -> Floats:
        """Displacement, mm, at pressures, kPa."""
        x = pressure / self.peak
        return self.linear * x + self.quadratic * x**2

    @property
    def area(self) -> float:
        """Hysteresis, %: the area between the branches, 2/3 loop, over that under loading."""
        return 100.0 * (2.0 / 3.0 * self.loop) / (self.linear / 2.0 + self.quadratic / 3.0)

    @property
    def width(self) -> float:
        """Largest distance of the branches over full scale, %."""
        return 100.0 * self.loop / (self.linear + self.quadratic)

    @property
    def off_line(self) -> float:
        """Largest distance from the best line over full scale, %: that of x² from x - 1/6, at both ends."""
        return 100.0 * (self.quadratic / 6.0) / (self.linear + self.quadratic)

    @property
    def r_squared(self) -> float:
        """Of the best line, from the moments of x and x² on (0, 1)."""
        a, b = self.linear, self.quadratic
        return 1.0 - (b**2 / 180.0) / (a**2 / 12.0 + a * b / 6.0 + 4.0 * b**2 / 45.0)


def recording(truth: Truth, seed: int = 1) -> Recording:
    """A synthetic test."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 2.0 * truth.rest + truth.cycles * truth.seconds, 1.0 / truth.rate)
    pressure, _ = _true(truth, time)
    _, displacement = _true(truth, time - truth.late)
    signal = truth.zeros[1] + (-displacement if truth.falls else displacement)
    return Recording(
        pressure + truth.zeros[0] + truth.noise[0] * random.normal(size=len(time)),
        signal + truth.noise[1] * random.normal(size=len(time)),
        time,
    )


def _true(truth: Truth, time: Floats) -> tuple[Floats, Floats]:
    """Pressure and displacement without zeros and noise."""
    phase = np.clip((time - truth.rest) / truth.seconds, 0.0, truth.cycles) % 1.0
    pressure = truth.peak * (1.0 - np.abs(2.0 * phase - 1.0))
    x = pressure / truth.peak
    return pressure, truth.loading(pressure) + np.where(phase > 0.5, 4.0 * truth.loop * x * (1.0 - x), 0.0)


#: An S-shaped prediction up to 25 kPa, as the paper's is.
PRESSURE = np.linspace(0.0, 25.0, 26)
CURVE = Prediction(PRESSURE, 28.0 * (PRESSURE / 25.0) ** 1.5, 20.0, True)

#: What the example is made of: about what the paper's 14 % case and its sensors would give.
EXAMPLE_TRUTH = Truth(
    linear=25.0, quadratic=2.0, loop=0.9, rate=10.0, noise=(0.03, 0.02), zeros=(1.3, 47.0), falls=True
)


def main() -> None:
    """Write the example, in volts of the paper's sensors."""
    made = recording(EXAMPLE_TRUTH)
    assert made.time is not None
    rows = zip(made.time.tolist(), (made.pressure / 19.17).tolist(), (made.displacement / 12.5).tolist(), strict=True)
    lines = [
        "# SYNTHETIC, not measured: made by tests/helpers/synthetic.py",
        "time [s],pressure_voltage [V],displacement_voltage [V]",
        *(f"{time:.1f},{pressure:.4f},{displacement:.4f}" for time, pressure, displacement in rows),
    ]
    EXAMPLE.parent.mkdir(exist_ok=True)
    EXAMPLE.write_text("\n".join([*lines, ""]), encoding="utf-8")


if __name__ == "__main__":
    main()
