"""What keeps triangles from bounding a solid, edge by edge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.geometry.solid import is_two_manifold
from actuator.geometry.zero_set import Surface


@dataclass(frozen=True)
class Flaws:
    """Edges at fault.

    Attributes:
        open: edges of one triangle.
        crowded: edges of more than two triangles.
        turned: edges of two triangles that disagree on which side is outside.
        pinched: whether sheets touch at a vertex only; looked at where all edges are sound.
        first: middle of one edge at fault, mm; None if there is none.
    """

    open: int
    crowded: int
    turned: int
    pinched: bool
    first: tuple[float, float, float] | None

    @property
    def any(self) -> bool:
        """Whether there is one."""
        return bool(self.open or self.crowded or self.turned or self.pinched)


def flaws(surface: Surface) -> Flaws:
    """Look at every edge of a surface whose equal vertices are merged."""
    start, end = surface.triangles.ravel(), np.roll(surface.triangles, -1, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    edges, number, count = np.unique(low * len(surface.vertices) + high, return_inverse=True, return_counts=True)
    forward = np.bincount(number, start < end, len(edges))
    is_open, crowded, turned = count == 1, count > 2, (count == 2) & (forward != 1)
    faulty = edges[is_open | crowded | turned]
    first = None
    if len(faulty):
        x, y, z = surface.vertices[list(divmod(int(faulty[0]), len(surface.vertices)))].mean(axis=0).tolist()
        first = (x, y, z)
    pinched = not len(faulty) and not is_two_manifold(surface.triangles)
    return Flaws(int(is_open.sum()), int(crowded.sum()), int(turned.sum()), pinched, first)
