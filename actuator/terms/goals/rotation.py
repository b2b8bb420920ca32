"""How far the arm turns about an axis: bending without the lift's penalty, sideways, or twist."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator.equations.arm import COORDINATES
from actuator.parameters import Load
from actuator.terms.goals.interface import Measured


@dataclass(frozen=True)
class Rotation(Measured):
    """m = s θ, rad, an angle of R = R_2(θ2) R_3(θ3) R_1(θ1): θ1 is twist.

    Attributes:
        coordinate: its name, ``theta1``, ``theta2`` or ``theta3``.
        sense: s, 1 or -1.
    """

    coordinate: str
    sense: float = 1.0

    def measure(self, motion: NDArray[Any], load: Load) -> Any:
        """s θ."""
        return self.sense * motion[COORDINATES.index(self.coordinate)]

    def slope(self, motion: NDArray[Any], load: Load) -> NDArray[Any]:
        """s, where the angle stands among the coordinates."""
        slope = np.zeros(len(COORDINATES), motion.dtype)
        slope[COORDINATES.index(self.coordinate)] = self.sense
        return slope
