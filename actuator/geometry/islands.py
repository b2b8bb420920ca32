"""Floating islands: bodies that nothing connects with the largest one."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.geometry.bodies import Shell, joined, shells
from actuator.geometry.zero_set import Surface

#: Triangles looked at together when the winding number of many points is summed; bounds the memory.
CHUNK = 1 << 22


def without_islands(surface: Surface) -> tuple[Surface, list[Shell]]:
    """The largest body with its cavities, and the bodies left out, largest first.

    Args:
        surface: closed, oriented 2-manifold.
    """
    parts = shells(surface)
    largest, *islands = [part for part in parts if part.volume > 0.0]
    if not islands:
        return surface, []
    cavities = [part for part in parts if part.volume < 0.0]
    corners = largest.surface.vertices[largest.surface.triangles]
    places = np.array([cavity.surface.vertices[0] for cavity in cavities]).reshape(-1, 3)
    inside = winding_number(corners, places) > 0.5
    kept = [largest, *(cavity for cavity, own in zip(cavities, inside, strict=True) if own)]
    return joined(kept), islands


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
