"""The slices of a solid that stands in its build direction: what a printer adds layer by layer.

manifold3d cuts the triangles exactly (Lalish, github.com/elalish/manifold); its outlines are rounded to about 1e-8 of
the size of the part.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from actuator.arrays import Floats
from actuator.geometry.printing.directions import Direction
from actuator.geometry.solid import manifold_of
from actuator.geometry.zero_set import Surface


@dataclass(frozen=True)
class Slice:
    """A cut through a solid.

    Attributes:
        height: above the lowest point, mm.
        area: mm².
        outlines: corners of the closed outlines, (n, 2) each, mm; counter-clockwise around material, clockwise around
            holes.
    """

    height: float
    area: float
    outlines: tuple[Floats, ...]


@dataclass(frozen=True)
class Standing:
    """A solid that stands on the plane of height 0 with its build direction up.

    Attributes:
        solid: the solid.
        height: of its highest point, mm.
        low, high: corners of its outline's bounding box, seen from above, (2,), mm.
    """

    solid: Manifold
    height: float
    low: Floats
    high: Floats

    def cut(self, height: float) -> Slice:
        """The slice at a height, mm; empty from the highest point upwards."""
        outline = self.solid.slice(height)
        return Slice(height, outline.area(), tuple(outline.to_polygons()))


def standing(surface: Surface, direction: Direction) -> Standing:
    """Turn a solid so that its build direction is up, and put it on the plane of height 0.

    Seen from above, the two axes of the plane are those that follow the build direction in the order x, y, z, x, y; for
    a negative direction the second is reversed as well, so that nothing is mirrored.

    Args:
        surface: 2-manifold, oriented outwards.
        direction: from the platform to the part.
    """
    up = "xyz".index(direction[-1])
    turn = np.zeros((3, 4))
    turn[range(3), [(up + 1) % 3, (up + 2) % 3, up]] = 1.0
    if direction.startswith("-"):
        turn[1:] *= -1.0
    turned = manifold_of(surface).transform(turn)
    x0, y0, z0, x1, y1, z1 = turned.bounding_box()
    return Standing(turned.translate((0.0, 0.0, -z0)), z1 - z0, np.array([x0, y0]), np.array([x1, y1]))


def middles(height: float, thickness: float) -> Floats:
    """Heights of the middles of all layers whose middle lies inside, (n,), mm; none if a half layer is too thick."""
    count = int(np.ceil(height / thickness - 0.5))
    return np.asarray(thickness * (np.arange(count) + 0.5), dtype=np.float64)


def mask(outlines: tuple[Floats, ...], low: Floats, shape: tuple[int, int], pixel: float) -> NDArray[np.bool_]:
    """Which pixels have their middle inside the outlines, by the even-odd rule.

    Args:
        outlines: closed outlines, (n, 2) each, mm.
        low: lower left corner of the picture, (2,), mm.
        shape: rows and columns.
        pixel: side of a pixel, mm.

    Returns:
        Rows from top to bottom, columns from left to right.
    """
    rows, columns = shape
    # In pixels, with the middles at whole numbers.
    corners = [(outline - low) / pixel - 0.5 for outline in outlines]
    start = np.concatenate([np.zeros((0, 2)), *corners])
    end = np.concatenate([np.zeros((0, 2)), *(np.roll(corner, -1, axis=0) for corner in corners)])
    first, last = np.clip(np.ceil(np.sort([start[:, 1], end[:, 1]], axis=0)), 0, rows).astype(np.int64)
    count = last - first
    edge = np.repeat(np.arange(len(count)), count)
    row = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count - first, count)
    (x0, y0), (x1, y1) = start[edge].T, end[edge].T
    crossing = x0 + (row - y0) / (y1 - y0) * (x1 - x0)
    column = np.clip(np.ceil(crossing), 0, columns).astype(np.int64)
    # A row is inside between its first and second crossing with an outline, its third and fourth, and so on.
    crossings = np.bincount(row * (columns + 1) + column, minlength=rows * (columns + 1)).reshape(rows, columns + 1)
    inside = np.bitwise_xor.accumulate((crossings % 2).astype(np.uint8), axis=1)[:, :columns]
    return inside[::-1].astype(bool)
