"""Floating islands: bodies that nothing connects with the largest one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator.geometry.solid import component_labels, signed_volumes
from actuator.geometry.zero_set import Surface

Floats = NDArray[np.float64]

#: Triangles looked at together when the winding number of many points is summed; bounds the memory.
CHUNK = 1 << 22


@dataclass(frozen=True)
class Island:
    """A body beside the largest one.

    Attributes:
        volume: of what its outer surface encloses, mm³.
        centre: middle of its bounding box, (3,), mm.
    """

    volume: float
    centre: tuple[float, float, float]


def without_islands(surface: Surface) -> tuple[Surface, list[Island]]:
    """The largest body with its cavities, and the bodies left out, largest first.

    Args:
        surface: closed, oriented 2-manifold.
    """
    label = component_labels(surface)
    of_triangle = label[surface.triangles[:, 0]]
    volume = signed_volumes(surface, of_triangle)
    bodies = np.flatnonzero(volume > 0.0)
    largest = int(bodies[np.argmax(volume[bodies])])
    islands = sorted((_island(surface, label, int(k), volume[k]) for k in bodies if k != largest), key=_largest_first)
    if not islands:
        return surface, []
    cavities = np.flatnonzero(volume < 0.0)
    first = np.array([np.flatnonzero(label == k)[0] for k in cavities], dtype=np.int64)
    shell = surface.vertices[surface.triangles[of_triangle == largest]]
    own = cavities[winding_number(shell, surface.vertices[first]) > 0.5]
    kept = surface.triangles[np.isin(of_triangle, [largest, *own])]
    used, triangles = np.unique(kept, return_inverse=True)
    return Surface(surface.vertices[used], triangles.reshape(-1, 3)), islands


def winding_number(corners: Floats, points: Floats) -> Floats:
    """How often a closed surface winds around points, (m,): 1 inside, 0 outside.

    Sum of solid angles (Van Oosterom & Strackee 1983, doi:10.1109/TBME.1983.325207).

    Args:
        corners: of the triangles, (n, 3, 3), counter-clockwise seen from outside.
        points: (m, 3), not on the surface.
    """
    found = np.zeros(len(points))
    step = max(1, CHUNK // max(len(corners), 1))
    for first in range(0, len(points), step):
        a, b, c = np.moveaxis(corners[None] - points[first : first + step, None, None], 2, 0)
        la, lb, lc = (np.linalg.norm(v, axis=-1) for v in (a, b, c))
        triple = np.einsum("...i,...i", a, np.cross(b, c))
        dots = (np.einsum("...i,...i", u, v) * w for u, v, w in ((a, b, lc), (b, c, la), (c, a, lb)))
        found[first : first + step] = np.arctan2(triple, la * lb * lc + sum(dots)).sum(axis=1) / (2.0 * np.pi)
    return found


def _island(surface: Surface, label: NDArray[np.int64], number: int, volume: float) -> Island:
    points = surface.vertices[label == number]
    x, y, z = (0.5 * (points.min(axis=0) + points.max(axis=0))).tolist()
    return Island(float(volume), (x, y, z))


def _largest_first(island: Island) -> tuple[float, tuple[float, float, float]]:
    return -island.volume, island.centre
