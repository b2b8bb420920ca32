"""Pockets that drain through necks narrower than a drain hole.

A neck is as wide as the largest ball that passes it, whose diameter is found on voxels by a Euclidean distance
transform and a flood from the outside that prefers wide ways; it is right to about one pitch. A pocket is void with
room for a ball of the size of the drain hole that such a ball cannot leave. Void that is narrower everywhere is a gap,
not a pocket, and closed cavities have no neck; neither is listed here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from actuator.arrays import Bools, Floats
from actuator.geometry.printing.flood import flooded
from actuator.geometry.printing.voxels import Voxels


@dataclass(frozen=True)
class Pocket:
    """A wide region behind a narrow neck.

    Attributes:
        volume: of the balls of the size of the drain hole that fit in, mm³, by counting voxels.
        centre: mean position of the centres of those balls, mm.
        neck: diameter of the largest ball that leaves, mm.
        neck_at: where this ball is stopped, mm.
    """

    volume: float
    centre: tuple[float, float, float]
    neck: float
    neck_at: tuple[float, float, float]


def pockets(voxels: Voxels, diameter: float) -> list[Pocket]:
    """Pockets of the void, largest first.

    Args:
        voxels: of the part.
        diameter: of the drain hole, mm.
    """
    necks = Necks(voxels.solid)
    # Between two solid voxels, n void ones apart, the middle is (n + 1) / 2 from either.
    radius = 0.5 * (diameter / voxels.pitch + 1.0)
    core = (necks.clearance >= radius**2) & (necks.way_out < radius**2) & necks.reached
    if not core.any():
        return []
    near = ndimage.distance_transform_edt(~core) < radius
    labels, count = ndimage.label(near & ~voxels.solid)
    found = []
    for number in range(1, count + 1):
        members = np.flatnonzero((labels == number) & core)
        widest = int(members[np.argmax(necks.way_out.ravel()[members])])
        middle = np.array([axis.mean() for axis in np.unravel_index(members, core.shape)])
        found.append(
            Pocket(
                int(np.count_nonzero(labels == number)) * voxels.pitch**3,
                voxels.position(middle),
                necks.width(widest) * voxels.pitch,
                voxels.position(necks.place(widest)),
            )
        )
    return sorted(found, key=lambda pocket: (-pocket.volume, pocket.centre))


class Necks:
    """The widest way from every void voxel to the border of a grid.

    Args:
        solid: (n1, n2, n3).
        barred: void that ways may not go through, (n1, n2, n3); it makes none of them narrower.

    Attributes:
        clearance: squared distance of every voxel to the nearest solid one, in pitches, (n1, n2, n3); 0 in the solid.
        way_out: the smallest clearance on the widest way out, (n1, n2, n3).
        reached: whether there is a way out, (n1, n2, n3).
    """

    def __init__(self, solid: Bools, barred: Bools | None = None) -> None:
        self.clearance = np.rint(ndimage.distance_transform_edt(~solid) ** 2).astype(np.int32)
        largest = int(self.clearance.max())
        closed = solid if barred is None else solid | barred
        height, self._following = flooded(np.where(closed, -1, largest - self.clearance).astype(np.int32))
        self.reached = height >= 0
        self.way_out = largest - height

    def width(self, voxel: int) -> float:
        """Diameter of the largest ball that gets out from a voxel, given by its number in C order, in pitches."""
        return float(2.0 * np.sqrt(self.way_out.flat[voxel]) - 1.0)

    def place(self, voxel: int) -> Floats:
        """Index (3,) of the place at which that ball is stopped."""
        clearance, following = self.clearance.ravel(), self._following.ravel()
        neck = self.way_out.flat[voxel]
        while clearance[voxel] > neck:
            voxel = int(following[voxel])
        return np.array(np.unravel_index(voxel, self.clearance.shape), dtype=np.float64)
