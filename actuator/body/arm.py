"""The rigid arm of a body: its plate closes the air chamber, whose volume follows the plate's motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.equations.arm import RigidArm


@dataclass(frozen=True)
class Arm(RigidArm):
    """Plate, arm and spring.

    Attributes:
        opening: area of the plate that closes the chamber, mm².
    """

    opening: float = 0.0

    def chamber(self, T: Floats) -> tuple[float, Floats, Floats]:
        """1/3 ∮ x · n dA over the plate, mm³, with first (m,) and second (m, m) derivative with respect to T."""
        R, dR, ddR = self.rotations(T)
        place = self.full(T)[:3] + np.array([self.length, 0.0, 0.0])
        shifts = np.array([[float(name == f"T{i}") for i in (1, 2, 3)] for name in self.names])
        normal, slopes = R[:, 0], dR[:, :, 0]
        cross = shifts @ slopes.T
        return (
            self.opening / 3.0 * float(normal @ place),
            self.opening / 3.0 * (slopes @ place + shifts @ normal),
            self.opening / 3.0 * (np.einsum("jki,i->jk", ddR[:, :, :, 0], place) + cross + cross.T),
        )
