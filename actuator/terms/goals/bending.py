"""C_0 of Eq. (9), the paper's goal: how far the arm is turned down and how little its root is lifted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator.equations.arm import COORDINATES
from actuator.parameters import Load
from actuator.terms.goals.interface import Goal

#: Factor of Eq. (9) on the squared lift of the arm's root, which keeps it from rising.
LIFT_WEIGHT = 500.0
_T3, _THETA2 = COORDINATES.index("T3"), COORDINATES.index("theta2")


@dataclass(frozen=True)
class Bending(Goal):
    """C_0 = T3 / L_arm - sin θ2 + 500 ⟨T3 / L_arm⟩²."""

    def value(self, motion: NDArray[Any], load: Load) -> float:
        """C_0."""
        lift = motion[_T3] / load.arm_length
        return float(lift - np.sin(motion[_THETA2]) + LIFT_WEIGHT * max(lift, 0.0) ** 2)

    def gradient(self, motion: NDArray[Any], load: Load) -> NDArray[Any]:
        """∂C_0/∂T."""
        lift = motion[_T3] / load.arm_length
        positive = lift if lift.real > 0.0 else 0.0 * lift
        gradient = np.zeros(len(COORDINATES), motion.dtype)
        gradient[_T3] = (1.0 + 2.0 * LIFT_WEIGHT * positive) / load.arm_length
        gradient[_THETA2] = -np.cos(motion[_THETA2])
        return gradient


#: What C_0 is unless something else is wanted.
PAPER_GOAL = Bending()
