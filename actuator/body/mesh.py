"""Meshes of 10-node tetrahedra that fit a body, and what of their boundary the mechanics asks for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from actuator.arrays import Bools, Floats, Ints

#: Ends of the edges of a tetrahedron in the order of its nodes 4 to 9, as VTK has them (vtkQuadraticTetra).
EDGES = np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)])
#: Corners of the faces of a tetrahedron, counter-clockwise seen from outside, then the nodes on their edges.
FACES = np.array([(0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (0, 3, 2, 7, 9, 6)])


class Tetrahedra(NamedTuple):
    """Linear tetrahedra.

    Attributes:
        points: (n_vertices, 3), mm.
        corners: (n, 4), all of positive volume.
    """

    points: Floats
    corners: Ints


@dataclass(frozen=True)
class BodyMesh:
    """A body between two plates, in coordinates whose first axis runs from the fixed plate at 0 to the arm's.

    Attributes:
        nodes: (n_nodes, 3), mm; the vertices first, then one in the middle of every edge.
        cells: (n_cells, 10), in VTK's order.
        vertices: how many of the nodes are vertices.
        walls: boundary faces that the air presses on, (n_walls, 6), normals out of the body, in the order of
            :data:`FACES`.
        boundary: all boundary faces, (n_faces, 6), but those on the symmetry plane.
        fixed, tip: nodes on the fixed plate and on the arm's.
        symmetry: nodes on the plane X2 = 0, if the mesh is a half.
        opening: area of the arm's plate that closes the chamber, mm².
        length: distance of the plates, mm.
        half: whether the mesh is the half X2 >= 0 of a symmetric body.
    """

    nodes: Floats
    cells: Ints
    vertices: int
    walls: Ints
    boundary: Ints
    fixed: Ints
    tip: Ints
    symmetry: Ints
    opening: float
    length: float
    half: bool

    @property
    def free(self) -> Bools:
        """Which displacements of nodes are unknowns of their own, (n_nodes, 3)."""
        free = np.ones(self.nodes.shape, dtype=bool)
        free[self.fixed] = free[self.tip] = False
        free[self.symmetry, 1] = False
        return free


def quadratic(tetrahedra: Tetrahedra) -> tuple[Floats, Ints]:
    """Nodes (n_nodes, 3), the vertices first, and cells (n, 10) of the same tetrahedra with nodes on their edges."""
    points, corners = tetrahedra
    ends = np.sort(corners[:, EDGES].reshape(-1, 2).astype(np.int64), axis=1)
    _, first, number = np.unique(ends[:, 0] * len(points) + ends[:, 1], return_index=True, return_inverse=True)
    middle = points[ends[first]].mean(axis=1)
    cells = np.concatenate([corners, len(points) + number.reshape(len(corners), len(EDGES))], axis=1)
    return np.concatenate([points, middle]), cells.astype(np.int64)


def boundary_faces(cells: Ints) -> Ints:
    """Faces (m, 6) that belong to one cell only."""
    faces = cells[:, FACES].reshape(-1, FACES.shape[1])
    _, first, count = np.unique(np.sort(faces[:, :3], axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]


def signed_volumes(points: Floats, corners: Ints) -> Floats:
    """Volume of every tetrahedron, (n,), mm³; negative where it is inside out."""
    edges = points[corners[:, 1:4]] - points[corners[:, :1]]
    volumes: Floats = np.linalg.det(edges) / 6.0
    return volumes


def on_plane(points: Floats, faces: Ints, axis: int, at: float, tolerance: float) -> Bools:
    """Which faces lie in the plane where a coordinate has a value, (m,)."""
    return np.asarray((np.abs(points[faces[:, :3], axis] - at) <= tolerance).all(axis=1))
