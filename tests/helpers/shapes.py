"""Solids whose walls, volumes and cups are known."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from actuator.geometry.solid import surface_of
from actuator.geometry.zero_set import Surface

#: Corners of the polygons that stand for circles.
CORNERS = 64


def block(x: float, y: float, z: float, *centre: float) -> Manifold:
    """A box around a point, by default the origin."""
    return Manifold.cube([x, y, z], True).translate(list(centre) or [0.0, 0.0, 0.0])


def rod(radius: float, length: float) -> Manifold:
    """A cylinder along x around the origin."""
    return Manifold.cylinder(length, radius, radius, CORNERS, True).rotate([0.0, 90.0, 0.0])


def tube() -> Manifold:
    """A tube along x, 30 mm long, with radii of 5 and 10 mm."""
    return rod(10.0, 30.0) - rod(5.0, 40.0)


def cup() -> Manifold:
    """A cup that is open upwards: 10 mm cube, walls and floor of 1 mm."""
    return block(10.0, 10.0, 10.0) - block(8.0, 8.0, 10.0, 0.0, 0.0, 1.0)


def polygon_area(radius: float) -> float:
    """Area of the polygon that stands for a circle."""
    return 0.5 * CORNERS * radius**2 * float(np.sin(2.0 * np.pi / CORNERS))


def turned(vertices: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Points turned by 90 degrees about an axis."""
    one, other = (axis + 1) % 3, (axis + 2) % 3
    result = vertices.copy()
    result[..., one], result[..., other] = -vertices[..., other], vertices[..., one]
    return result


def surface(solid: Manifold) -> Surface:
    """The boundary of a solid."""
    return surface_of(solid)
