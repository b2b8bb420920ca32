"""Points spread over a surface, and what rays from them meet; VTK finds it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.geometry.normals import triangle_normals
from actuator.geometry.zero_set import Surface

#: Where a ray starts, as a fraction of the size of the surface, so that it does not meet the facet it leaves.
LIFT = 1.0e-7


@dataclass(frozen=True)
class Points:
    """Points on facets.

    Attributes:
        position: (n, 3), mm.
        facet: number of the triangle under each, (n,).
        normal: of that triangle, outwards, (n, 3), unit length.
    """

    position: Floats
    facet: Ints
    normal: Floats


def spread(surface: Surface, count: int) -> Points:
    """Random points, as many per area everywhere; the same ones for the same surface."""
    import trimesh

    mesh = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    position, facet = trimesh.sample.sample_surface(mesh, count, seed=0)
    corners = surface.vertices[surface.triangles[facet]]
    normal = triangle_normals(corners)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    return Points(np.asarray(position), np.asarray(facet, dtype=np.int64), normal / length)


def first_hits(surface: Surface, origins: Floats, directions: Floats) -> tuple[Floats, Ints]:
    """Distance to what each ray meets first, (n,), mm, infinite for nothing, and the triangle met, -1 for none.

    Args:
        surface: triangles.
        origins: (n, 3), mm, on the surface.
        directions: (n, 3), unit length.
    """
    import pyvista
    from vtkmodules.vtkCommonCore import reference
    from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

    size = float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    locator = vtkStaticCellLocator()
    locator.SetDataSet(pyvista.PolyData.from_regular_faces(surface.vertices, surface.triangles))
    locator.BuildLocator()
    starts = (origins + LIFT * size * directions).tolist()
    ends = (origins + 2.0 * size * directions).tolist()
    distance = np.full(len(origins), np.inf)
    facet = np.full(len(origins), -1, dtype=np.int64)
    fraction: Any = reference(0.0)  # VTK writes into these
    part: Any = reference(0)
    cell: Any = reference(0)
    point, local = [0.0] * 3, [0.0] * 3
    for number, (start, end) in enumerate(zip(starts, ends, strict=True)):
        if locator.IntersectWithLine(start, end, 1e-12 * size, fraction, point, local, part, cell):
            distance[number] = size * (LIFT + float(fraction) * (2.0 - LIFT))
            facet[number] = int(cell)
    return distance, facet
