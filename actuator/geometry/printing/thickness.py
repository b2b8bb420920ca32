"""Thickness of walls and width of gaps.

From points all over the surface a ray goes straight into the solid, for walls, or straight out of it, for gaps, and the
distance to the surface it meets is the thickness there, if that surface is the other side of the same wall. It is, if

- the two sides are parallel to within :data:`PARALLEL`; the thinnest place of a smooth wall is always such a one, for
  there the shortest way from side to side is perpendicular to both; or
- the two sides do not hang together around the ray: within a ball around its middle, of :data:`REACH` times its length
  as radius, no way over the surface leads from one to the other. That is so at the bottom of a notch that nearly cuts
  a wall.

Otherwise the ray has met the next face around an edge. Without these conditions every edge below 90 degrees would be a
wall of thickness 0; with them a cube is as thick as its edge is long, and only edges sharper than about 30 degrees
count as thin. Grooves and gaps are treated likewise. The smallest thickness found is an upper bound: thinner places
that are smaller than the spacing of the points may be missed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numba import njit

from actuator.arrays import Bools, Floats, Ints
from actuator.geometry.normals import triangle_normals
from actuator.geometry.printing.rays import Points, first_hits
from actuator.geometry.zero_set import Surface

#: Largest angle between two sides that count as parallel, degrees.
PARALLEL = 30.0
#: Radius of the ball in which two sides must be apart, over their distance.
REACH = 2.0


@dataclass(frozen=True)
class Thickness:
    """Walls or gaps of a part.

    Attributes:
        minimum: mm; None if no two sides face each other.
        at: middle between the two sides at the minimum, mm; None likewise.
        share: of the surface, on which the thickness is below the limit.
        percentile: thickness below which one in a hundred of the points with a parallel opposite side are, mm; None if
            there are none.
    """

    minimum: float | None
    at: tuple[float, float, float] | None
    share: float
    percentile: float | None


def thickness(surface: Surface, points: Points, kind: Literal["wall", "gap"], limit: float) -> Thickness:
    """Measure walls or gaps.

    Args:
        surface: closed, oriented 2-manifold.
        points: on it.
        kind: ``wall``, in the solid, or ``gap``, outside of it.
        limit: mm, for the share.
    """
    ray = -points.normal if kind == "wall" else points.normal
    distance, facet = first_hits(surface, points.position, ray)
    corners = surface.vertices[surface.triangles]
    normal = triangle_normals(corners)
    length = np.linalg.norm(normal, axis=1)
    met = facet >= 0
    # Along the ray a wall is left through a side that faces as the ray goes, a gap through one that faces it.
    cosine = np.einsum("ij,ij->i", normal[facet], -points.normal) / np.maximum(length[facet], np.finfo(float).tiny)
    opposite = met & (cosine >= np.cos(np.radians(PARALLEL)))
    middle = points.position + 0.5 * np.where(met, distance, 0.0)[:, None] * ray
    doubtful = np.flatnonzero(met & ~opposite)
    doubtful = doubtful[np.argsort(distance[doubtful], kind="stable")]
    sides = np.stack([points.facet[doubtful], facet[doubtful]], axis=1)
    smallest = float(distance[opposite].min(initial=np.inf))
    percentile = float(np.percentile(distance[opposite], 1.0)) if opposite.any() else None
    neighbours = neighbouring(surface.triangles)
    opposite[doubtful] = _apart(corners, neighbours, sides, middle[doubtful], distance[doubtful], smallest, limit)
    if not opposite.any():
        return Thickness(None, None, 0.0, None)
    thinnest = int(np.argmin(np.where(opposite, distance, np.inf)))
    x, y, z = middle[thinnest].tolist()
    return Thickness(float(distance[thinnest]), (x, y, z), float(np.mean(opposite & (distance < limit))), percentile)


def neighbouring(triangles: Ints) -> Ints:
    """Triangles across the edges of each triangle of a 2-manifold, (m, 3); edge i leads from corner i to the next."""
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    size = int(triangles.max()) + 1
    across = np.empty(triangles.size, dtype=np.int64)
    across[np.argsort(start * size + end)] = np.argsort(end * size + start) // 3
    return across.reshape(-1, 3)


@njit(cache=True)
def _apart(
    corners: Floats, neighbours: Ints, sides: Ints, middle: Floats, distance: Floats, smallest: float, limit: float
) -> Bools:
    """Which pairs of facets do not hang together around their middle.

    Pairs come by distance, and those that change neither the smallest distance nor what is below the limit are left.
    """
    found = np.zeros(len(sides), np.bool_)
    seen = np.full(len(neighbours), -1, np.int64)
    waiting = np.empty(len(neighbours), np.int64)
    for pair in range(len(sides)):
        if distance[pair] > max(smallest, limit):
            break
        waiting[0] = sides[pair, 0]
        seen[sides[pair, 0]] = pair
        left = 1
        while left > 0 and seen[sides[pair, 1]] != pair:
            left -= 1
            facet = waiting[left]
            for edge in range(3):
                across = neighbours[facet, edge]
                start, end = corners[facet, edge], corners[facet, (edge + 1) % 3]
                if seen[across] != pair and _near(start, end, middle[pair], REACH * distance[pair]):
                    seen[across] = pair
                    waiting[left] = across
                    left += 1
        found[pair] = seen[sides[pair, 1]] != pair
        if found[pair]:
            smallest = min(smallest, distance[pair])
    return found


@njit(cache=True)
def _near(start: Floats, end: Floats, point: Floats, radius: float) -> bool:
    """Whether a segment comes closer to a point than a radius."""
    along, length, square = 0.0, 0.0, 0.0
    for i in range(3):
        along += (point[i] - start[i]) * (end[i] - start[i])
        length += (end[i] - start[i]) ** 2
    fraction = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    for i in range(3):
        square += (start[i] + fraction * (end[i] - start[i]) - point[i]) ** 2
    return square < radius * radius
