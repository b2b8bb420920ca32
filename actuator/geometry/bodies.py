"""The shells of a solid: outer ones bound bodies, inner ones closed cavities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from actuator.geometry.solid import component_labels, signed_volumes
from actuator.geometry.zero_set import Surface


@dataclass(frozen=True)
class Shell:
    """A connected component of a closed surface.

    Attributes:
        volume: enclosed, mm³; negative for a cavity.
        low, high: corners of its bounding box, mm.
        surface: the component itself.
    """

    volume: float
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    surface: Surface

    @property
    def centre(self) -> tuple[float, float, float]:
        """Middle of the bounding box, mm."""
        x, y, z = (0.5 * (a + b) for a, b in zip(self.low, self.high, strict=True))
        return x, y, z

    @property
    def turned(self) -> Shell:
        """The same shell facing the other way."""
        return replace(
            self, volume=-self.volume, surface=Surface(self.surface.vertices, self.surface.triangles[:, ::-1])
        )


def joined(parts: Sequence[Shell]) -> Surface:
    """One surface of several shells."""
    offsets = np.cumsum([0, *(len(part.surface.vertices) for part in parts)])
    triangles = [part.surface.triangles + offset for part, offset in zip(parts, offsets[:-1], strict=True)]
    return Surface(np.concatenate([part.surface.vertices for part in parts]), np.concatenate(triangles))


def shells(surface: Surface) -> list[Shell]:
    """The connected components of a closed, oriented 2-manifold, by volume without its sign, largest first."""
    _, label = np.unique(component_labels(surface)[surface.triangles[:, 0]], return_inverse=True)
    volumes = signed_volumes(surface, label)
    members = np.split(np.argsort(label, kind="stable"), np.cumsum(np.bincount(label))[:-1])
    found = []
    for number in np.argsort(-np.abs(volumes), kind="stable"):
        used, triangles = np.unique(surface.triangles[members[number]], return_inverse=True)
        points = surface.vertices[used]
        low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        own = Surface(points, triangles.reshape(-1, 3))
        found.append(Shell(float(volumes[number]), (low[0], low[1], low[2]), (high[0], high[1], high[2]), own))
    return found
