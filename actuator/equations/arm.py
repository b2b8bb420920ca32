"""The rigid arm of Eqs. (6) to (8): translation and rotation of the plate Γ that it is glued on, and its spring.

The motion of a half has the coordinates T1, T3, θ2 of the paper; a whole has all six. The rotation is
R = R_2(θ2) R_3(θ3) R_1(θ1) about the plate's centre, of which θ2 alone is the paper's. All functions of T take complex
ones too, so that the complex step gives derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator.arrays import Floats, Ints

#: All coordinates, and those of a half.
COORDINATES = ("T1", "T2", "T3", "theta1", "theta2", "theta3")
OF_HALF = ("T1", "T3", "theta2")
#: Where the coordinates of a half, the paper's, stand among all.
PAPER_COORDINATES: Ints = np.array([COORDINATES.index(name) for name in OF_HALF])
#: The axes that the factors of R turn about, the last one first applied.
_FACTORS = (1, 2, 0)


def is_angle(name: str) -> bool:
    """Whether a coordinate is an angle, rad, and not a length, mm."""
    return name.startswith("theta")


@dataclass(frozen=True)
class RigidArm:
    """Plate, arm and spring.

    Attributes:
        length: distance of the plates, mm: the plate's centre at rest is (length, 0, 0).
        reach: L_arm, mm, along the axis from the plate's centre to the spring.
        stiffness: of the spring, N/mm; for a half, half of it.
        names: coordinates that are free.
    """

    length: float
    reach: float
    stiffness: float
    names: tuple[str, ...] = OF_HALF

    def full(self, T: Floats) -> Floats:
        """All six coordinates, mm and rad, of the free ones (m,)."""
        q = np.zeros(6, dtype=np.asarray(T).dtype)
        q[[COORDINATES.index(name) for name in self.names]] = T
        return q

    def free(self, full: Floats) -> Floats:
        """Of six entries those of the free coordinates, (m,)."""
        return full[[COORDINATES.index(name) for name in self.names]]

    def rotations(self, T: Floats) -> tuple[Floats, Floats, Floats]:
        """R (3, 3), ∂R/∂T (m, 3, 3) and ∂²R/∂T² (m, m, 3, 3)."""
        angles = self.full(T)[3:]
        factors = {axis: _turn(axis, angles[axis]) for axis in _FACTORS}
        m, kind = len(self.names), angles.dtype
        first, second = np.zeros((m, 3, 3), kind), np.zeros((m, m, 3, 3), kind)
        turned = [COORDINATES.index(name) - 3 for name in self.names]
        for j, axis in enumerate(turned):
            if axis < 0:
                continue
            first[j] = _product(factors, {axis: 1})
            for k, other in enumerate(turned):
                if other >= 0:
                    orders = {axis: 2} if other == axis else {axis: 1, other: 1}
                    second[j, k] = _product(factors, orders)
        return _product(factors, {}), first, second

    def displacement(self, T: Floats, points: Floats) -> Floats:
        """u of points of the plate, (n, 3), mm."""
        R, _, _ = self.rotations(T)
        offset = self._offset(points)
        moved: Floats = self.full(T)[:3] + offset @ (R - np.eye(3)).T
        return moved

    def directions(self, T: Floats, points: Floats) -> Floats:
        """∂u/∂T of points of the plate, (n, 3, m)."""
        _, dR, _ = self.rotations(T)
        directions = np.einsum("jik,nk->nij", dR, self._offset(points))
        for j, name in enumerate(self.names):
            if not is_angle(name):
                directions[:, COORDINATES.index(name), j] = 1.0
        return directions

    def second_variation(self, T: Floats, points: Floats, force: Floats) -> Floats:
        """Σ force · ∂²u/∂T² over points of the plate, (m, m)."""
        _, _, ddR = self.rotations(T)
        moment = force.T @ self._offset(points)
        return np.asarray(np.einsum("jkil,il->jk", ddR, moment))

    def _offset(self, points: Floats) -> Floats:
        return points - np.array([self.length, 0.0, 0.0])

    # ---------------------------------------------------------------- spring, Eq. (8)

    def elongation(self, T: Floats) -> Any:
        """Vertical displacement T3 - L_arm sin θ2 of the spring's end, mm; negative is downwards."""
        return self._along(T)[0]

    def rise(self, T: Floats) -> Floats:
        """Derivative of :meth:`elongation` with respect to T, (m,)."""
        return self._along(T)[1]

    def spring(self, T: Floats) -> tuple[Any, Floats, Floats]:
        """Energy of the spring, N mm, and its first (m,) and second (m, m) derivative with respect to T."""
        value, slope, curvature = self._along(T)
        return (
            0.5 * self.stiffness * value**2,
            self.stiffness * value * slope,
            self.stiffness * (np.outer(slope, slope) + value * curvature),
        )

    def pulled(self, T: Floats, force: Floats) -> tuple[Floats, Floats]:
        """First (m,) and second (m, m) derivative of -F · u of the arm's end.

        Args:
            T: free coordinates, (m,).
            force: F, (3,), N: it keeps its size and direction while the arm moves.
        """
        end = np.array([[self.length + self.reach, 0.0, 0.0]])
        return -(force @ self.directions(T, end)[0]), -self.second_variation(T, end, force[None])

    def _along(self, T: Floats) -> tuple[Any, Floats, Floats]:
        R, dR, ddR = self.rotations(T)
        slope = self.reach * dR[:, 2, 0]
        if "T3" in self.names:
            slope[self.names.index("T3")] += 1.0
        return self.full(T)[2] + self.reach * R[2, 0], slope, self.reach * ddR[:, :, 2, 0]


def _turn(axis: int, angle: Any) -> tuple[Floats, Floats, Floats]:
    """The rotation about a coordinate axis, and its first and second derivative by the angle."""
    i, k = (axis + 1) % 3, (axis + 2) % 3
    cosine, sine = np.cos(angle), np.sin(angle)
    turns = []
    for c, s, rest in ((cosine, sine, 1.0), (-sine, cosine, 0.0), (-cosine, -sine, 0.0)):
        R = np.zeros((3, 3), np.asarray(angle).dtype)
        R[axis, axis] = rest
        R[i, i] = R[k, k] = c
        R[k, i], R[i, k] = s, -s
        turns.append(R)
    return turns[0], turns[1], turns[2]


def _product(factors: dict[int, tuple[Floats, Floats, Floats]], orders: dict[int, int]) -> Floats:
    a, b, c = (factors[axis][orders.get(axis, 0)] for axis in _FACTORS)
    product: Floats = a @ b @ c
    return product
