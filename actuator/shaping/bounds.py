"""Walls and gaps that must stay as wide as they are: where a surface may move, and where it has to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.geometry.normals import triangle_normals
from actuator.geometry.printing.rays import first_hits
from actuator.geometry.zero_set import Surface

#: Largest angle between two sides whose distance counts as a width, degrees: wider than in the checks, so that walls
#: are held where they run out into one another too.
PARALLEL = 60.0
#: How far off the surface rays start, over the size of the part: nodes lie off the triangles by the mesh's rounding.
LIFT = 5e-4


@dataclass(frozen=True)
class Widths:
    """Walls and gaps at places of a surface.

    Attributes:
        wall, gap: straight into and out of the solid to where an opposite side is, (n,), mm; infinite where there is
            none within :data:`PARALLEL`.
    """

    wall: Floats
    gap: Floats

    def held(self, derivative: Floats, least_wall: float, least_gap: float, margin: float) -> Floats:
        """A derivative by the motion along the normals, (n,), without what would make walls or gaps too narrow.

        Descent moves the surface against the derivative. What narrows a wall is taken away in the measure in which the
        wall is near its least width, all of it at that width; gaps likewise.

        Args:
            derivative: (n,).
            least_wall, least_gap: mm.
            margin: mm above the least width within which motions are held back.
        """
        into = np.clip((self.wall - least_wall) / margin, 0.0, 1.0)
        out = np.clip((self.gap - least_gap) / margin, 0.0, 1.0)
        return derivative * np.where(derivative > 0.0, into, out)

    def lack(self, least_wall: float, least_gap: float, margin: float) -> Floats:
        """What walls lack to their least width, (n,), mm; in narrow gaps it is left to the wall's other side."""
        out = np.clip((self.gap - least_gap) / margin, 0.0, 1.0)
        return out * np.maximum(least_wall - self.wall, 0.0)


def widths(surface: Surface, places: Floats, outward: Floats) -> Widths:
    """Thickness of the wall and width of the gap at places of a surface.

    Args:
        surface: closed.
        places: on it, (n, 3), mm.
        outward: unit normals there, (n, 3).
    """
    normal = triangle_normals(surface.vertices[surface.triangles])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    lift = LIFT * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    found = []
    for side in (-1.0, 1.0):
        ray = side * outward
        distance, facet = first_hits(surface, places + lift * ray, ray)
        cosine = -side * np.einsum("ni,ni->n", normal[facet], ray)
        opposite = (facet >= 0) & (cosine >= np.cos(np.radians(PARALLEL)))
        found.append(np.where(opposite, distance + lift, np.inf))
    return Widths(*found)
