"""What a goal is: value, gradient and curvature of a function of the arm's motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator.parameters import Load


class Goal(ABC):
    """A function of the six coordinates of the arm (:data:`actuator.equations.arm.COORDINATES`), in mm and rad.

    Its gradient takes complex coordinates, so that the complex step on it is the goal's exact curvature.
    """

    @abstractmethod
    def value(self, motion: NDArray[Any], load: Load) -> float:
        """What is to become small, dimensionless, at a real motion (6,)."""

    @abstractmethod
    def gradient(self, motion: NDArray[Any], load: Load) -> NDArray[Any]:
        """Its derivative with respect to the coordinates, (6,), at a real or complex motion (6,)."""


@dataclass(frozen=True)
class Sum(Goal):
    """Several goals, each with its weight.

    Attributes:
        parts: weights and goals.
    """

    parts: tuple[tuple[float, Goal], ...]

    def value(self, motion: NDArray[Any], load: Load) -> float:
        """Σ w C."""
        return sum(weight * goal.value(motion, load) for weight, goal in self.parts)

    def gradient(self, motion: NDArray[Any], load: Load) -> NDArray[Any]:
        """Σ w ∂C/∂T."""
        return np.asarray(sum(weight * goal.gradient(motion, load) for weight, goal in self.parts))


@dataclass(frozen=True)
class Measured(Goal):
    """A quantity m of the motion, dimensionless: made as large as can be, -m, or brought to a target, ½ (m - m*)².

    Attributes:
        target: m*; None to make m large.
    """

    target: float | None

    @abstractmethod
    def measure(self, motion: NDArray[Any], load: Load) -> Any:
        """m at a real or complex motion (6,)."""

    @abstractmethod
    def slope(self, motion: NDArray[Any], load: Load) -> NDArray[Any]:
        """∂m/∂T, (6,)."""

    def value(self, motion: NDArray[Any], load: Load) -> float:
        """-m or ½ (m - m*)²."""
        found = float(self.measure(motion, load))
        return -found if self.target is None else 0.5 * (found - self.target) ** 2

    def gradient(self, motion: NDArray[Any], load: Load) -> NDArray[Any]:
        """-∂m/∂T or (m - m*) ∂m/∂T."""
        slope = self.slope(motion, load)
        return -slope if self.target is None else (self.measure(motion, load) - self.target) * slope
