"""How far a point of the arm travels in a direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator.equations.arm import COORDINATES, RigidArm
from actuator.parameters import Load
from actuator.terms.goals.interface import Measured


@dataclass(frozen=True)
class Travel(Measured):
    """m = u · d / L_arm of a point that moves with the arm.

    Attributes:
        direction: d, a unit vector.
        point: at rest, from the middle of the glued face, mm; the arm's end, (L_arm, 0, 0), if None.
    """

    direction: tuple[float, ...]
    point: tuple[float, ...] | None = None

    def measure(self, motion: NDArray[Any], load: Load) -> Any:
        """u · d / L_arm."""
        return self._arm.displacement(motion, self._place(load))[0] @ np.array(self.direction) / load.arm_length

    def slope(self, motion: NDArray[Any], load: Load) -> NDArray[Any]:
        """∂u/∂T · d / L_arm."""
        directions: NDArray[Any] = self._arm.directions(motion, self._place(load))[0]
        return np.array(self.direction) @ directions / load.arm_length

    @property
    def _arm(self) -> RigidArm:
        return RigidArm(length=0.0, reach=0.0, stiffness=0.0, names=COORDINATES)

    def _place(self, load: Load) -> NDArray[Any]:
        return np.array([(load.arm_length, 0.0, 0.0) if self.point is None else self.point])
