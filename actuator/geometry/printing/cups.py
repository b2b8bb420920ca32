"""Cups: void that holds resin while the part is built, because its only ways out lead upwards.

Layers are added from the platform upwards. What is measured is the void in a layer that no way through this layer and
those below it connects with the outside of the part; ways go through the faces of voxels. It is the volume that would
hold a liquid if the part stood on its platform. In a printer that cures the layers on the floor of a tank, it is the
volume that the part encloses against this floor as it grows, and that pulls like a suction cup when the floor is peeled
off; 3D Systems calls it cupping, "a trapped volume of print material between the current layer and the membrane"
(infocenter.3dsystems.com, best practices of the NextDent 5100, read in November 2026). A bowl whose opening faces the
platform is none: resin flows in below its rim, if the part stands on supports.

Closed cavities never have a way out, and are not counted here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from actuator.arrays import Bools, Floats
from actuator.geometry.printing.directions import Direction
from actuator.geometry.printing.flood import flooded
from actuator.geometry.printing.voxels import Voxels


@dataclass(frozen=True)
class Cup:
    """A connected region that holds resin.

    Attributes:
        volume: mm³, by counting voxels.
        heights: of its bottom and of its brim above the lowest point of the part, mm.
        centre: mean position, mm.
    """

    volume: float
    heights: tuple[float, float]
    centre: tuple[float, float, float]


def cups(voxels: Voxels, direction: Direction, *, on_platform: bool) -> list[Cup]:
    """Cups of a part, largest first.

    Args:
        voxels: of the part.
        direction: from the platform to the part, along which the layers follow each other.
        on_platform: whether the part is printed flat on the platform, which then closes every opening in its lowest
            face; otherwise it stands on supports, and resin flows below it.
    """
    upwards = _upwards(voxels.solid, direction)
    layers = upwards.shape[0]
    level = np.broadcast_to(np.arange(layers, dtype=np.int32)[:, None, None], upwards.shape).copy()
    level[upwards] = -1
    if on_platform:
        level[0] = layers  # the way below the part opens when it is taken off
    height, _ = flooded(level)
    labels, count = ndimage.label(height > level)
    indices = np.arange(1, count + 1)
    found = []
    for number, box in zip(indices, ndimage.find_objects(labels), strict=True):
        member = labels[box] == number
        bottom, top = box[0].start - 1, box[0].stop - 1  # the layer below the part is none of its own
        middle = np.array([axis.mean() for axis in np.nonzero(member)]) + [side.start for side in box]
        found.append(
            Cup(
                int(member.sum()) * voxels.pitch**3,
                (bottom * voxels.pitch, top * voxels.pitch),
                voxels.position(_back(middle, layers, direction)),
            )
        )
    return sorted(found, key=lambda cup: (-cup.volume, cup.centre))


def _upwards(solid: Bools, direction: Direction) -> Bools:
    """The grid with its first axis along the direction."""
    moved = np.moveaxis(solid, "xyz".index(direction[-1]), 0)
    return np.ascontiguousarray(moved[::-1] if direction.startswith("-") else moved)


def _back(index: Floats, layers: int, direction: Direction) -> Floats:
    """An index of the turned grid as one of the grid."""
    along = layers - 1 - index[0] if direction.startswith("-") else index[0]
    return np.insert(index[1:], "xyz".index(direction[-1]), along)
