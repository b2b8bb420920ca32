"""Overhangs: facets that face the platform and are too close to level to carry themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.geometry.normals import triangle_normals
from actuator.geometry.printing.directions import Direction, unit
from actuator.geometry.solid import component_labels
from actuator.geometry.zero_set import Surface

#: Height above the lowest point, as a fraction of the part's height, up to which a facet rests on the platform.
RESTING = 1.0e-4


@dataclass(frozen=True)
class Overhangs:
    """What needs supports.

    Attributes:
        area: mm².
        share: of the part's whole surface.
        largest: area of the largest patch that hangs together, mm².
        centre: of that patch, mm; None if nothing overhangs.
    """

    area: float
    share: float
    largest: float
    centre: tuple[float, float, float] | None


def overhangs(surface: Surface, direction: Direction, angle: float) -> Overhangs:
    """Facets at less than an angle from level whose outer side faces the platform.

    What lies in the lowest plane is not counted: it rests on the platform, or on the supports that carry the part.

    Args:
        surface: closed, oriented outwards.
        direction: from the platform to the part.
        angle: least angle from level at which a facet carries itself, degrees.
    """
    corners = surface.vertices[surface.triangles]
    normal = triangle_normals(corners)
    area = 0.5 * np.linalg.norm(normal, axis=1)
    upwards = unit(direction)
    height = surface.vertices @ upwards
    resting = (height[surface.triangles] - height.min()).max(axis=1) <= RESTING * np.ptp(height)
    # The cosine of the angle between a facet and level is that between its normal and the vertical.
    hanging = (-0.5 * normal @ upwards > np.cos(np.radians(angle)) * area) & ~resting
    if not hanging.any():
        return Overhangs(0.0, 0.0, 0.0, None)
    used, triangles = np.unique(surface.triangles[hanging], return_inverse=True)
    patch = component_labels(Surface(surface.vertices[used], triangles.reshape(-1, 3)))[triangles.reshape(-1, 3)[:, 0]]
    patches = np.bincount(patch, area[hanging])
    largest = hanging.nonzero()[0][patch == np.argmax(patches)]
    x, y, z = np.average(corners[largest].mean(axis=1), axis=0, weights=area[largest]).tolist()
    total = float(area[hanging].sum())
    return Overhangs(total, total / float(area.sum()), float(patches.max()), (x, y, z))
