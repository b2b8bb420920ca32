"""How hard the arm's end presses on its spring: with a stiff one, the blocked force of a held tip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from actuator.equations.arm import COORDINATES, RigidArm
from actuator.parameters import Load
from actuator.terms.goals.interface import Measured


@dataclass(frozen=True)
class Force(Measured):
    """m = -k_sp (T3 - L_arm sin θ2) / f, downwards.

    Attributes:
        unit: f, N; p_in R² where the goal is made from a case.
    """

    unit: float

    def measure(self, motion: NDArray[Any], load: Load) -> Any:
        """-k_sp (T3 - L_arm sin θ2) / f."""
        return -load.spring_stiffness * self._arm(load).elongation(motion) / self.unit

    def slope(self, motion: NDArray[Any], load: Load) -> NDArray[Any]:
        """Its derivative, that of the end's height."""
        slope: NDArray[Any] = -load.spring_stiffness * self._arm(load).rise(motion) / self.unit
        return slope

    @staticmethod
    def _arm(load: Load) -> RigidArm:
        return RigidArm(length=0.0, reach=load.arm_length, stiffness=load.spring_stiffness, names=COORDINATES)
