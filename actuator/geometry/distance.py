"""Distance of points to a triangulated surface."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.geometry.zero_set import Surface


def signed_distance(points: Floats, surface: Surface) -> Floats:
    """Distance of points (n, 3) to the nearest point of a surface, (n,), mm, negative inside of it; by VTK."""
    import pyvista  # slow to load: only where something is measured

    there = pyvista.PolyData.from_regular_faces(surface.vertices, surface.triangles)
    found = pyvista.PolyData(np.ascontiguousarray(points)).compute_implicit_distance(there)
    return np.asarray(found["implicit_distance"], dtype=np.float64)


def distance(points: Floats, surface: Surface) -> Floats:
    """Distance of points (n, 3) to the nearest point of a surface, (n,), mm."""
    return np.abs(signed_distance(points, surface))


def samples(surface: Surface) -> Floats:
    """Vertices, middles of edges and centroids of triangles, (n, 3), mm."""
    corners = surface.vertices[surface.triangles]
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1)).reshape(-1, 3)
    return np.concatenate([surface.vertices, middles, corners.mean(axis=1)])


def separation(one: Surface, other: Surface) -> float:
    """Hausdorff distance of two surfaces as their :func:`samples` show it, mm."""
    there, back = distance(samples(one), other), distance(samples(other), one)
    return float(max(there.max(initial=0.0), back.max(initial=0.0)))
