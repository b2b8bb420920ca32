"""Where points lie in a mesh of tetrahedra."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from actuator.arrays import Floats, Ints


class Location(NamedTuple):
    """Places in tetrahedra.

    Attributes:
        corners: vertices of the tetrahedron that each lies in, (n, 4).
        shares: barycentric coordinates, (n, 4), which add up to 1.
        cells: numbers of the tetrahedra, (n,).
    """

    corners: Ints
    shares: Floats
    cells: Ints

    def of(self, values: Floats) -> Floats:
        """Values (n_vertices,), linear in every tetrahedron, at the places, (n,)."""
        found = values[self.corners]
        return np.asarray(found[:, 0] + (self.shares[:, 1:] * (found[:, 1:] - found[:, :1])).sum(axis=1))


def located(points: Floats, tetrahedra: Ints, places: Floats) -> Location:
    """Find the tetrahedra that places (n, 3) lie in, by VTK; one outside of all stands for the nearest place.

    Args:
        points: (n_vertices, 3), mm.
        tetrahedra: (m, 4).
        places: (n, 3), mm.
    """
    import pyvista  # slow to load

    there = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: tetrahedra}, points)
    cells, nearest = there.find_closest_cell(places, return_closest_point=True)
    corners = tetrahedra[cells]
    origin, edges = points[corners[:, 0]], points[corners[:, 1:]] - points[corners[:, :1]]
    shares = np.linalg.solve(edges.transpose(0, 2, 1), (nearest - origin)[..., None])[..., 0]
    return Location(corners, np.concatenate([1.0 - shares.sum(axis=1, keepdims=True), shares], axis=1), cells)
