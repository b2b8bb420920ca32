"""Vertices of a surface parted where it has sharp edges, so that shading is smooth elsewhere and only there."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from actuator.arrays import Floats, Ints
from actuator.geometry.zero_set import Surface

#: Edges between triangles whose normals differ by more are sharp, degrees.
SHARP = 35.0


def parted_at_creases(surface: Surface, sharp: float = SHARP) -> tuple[Ints, Ints]:
    """One vertex for each side of a sharp edge.

    Corners of triangles at one vertex stay together where they are joined through edges that are not sharp.

    Args:
        surface: the triangles.
        sharp: least angle between the normals of two triangles at a sharp edge, degrees.

    Returns:
        The vertex of the surface that each new vertex lies at, (k,), and the triangles on new vertices, (m, 3).
    """
    triangles = np.asarray(surface.triangles, dtype=np.int64)
    normals = triangle_normals(surface.vertices, triangles)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    # The three directed edges of every triangle, and the corners at their ends.
    starts, ends = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    corner = np.arange(triangles.size)
    corner_at_end = np.roll(corner.reshape(-1, 3), -1, axis=1).ravel()
    key = np.minimum(starts, ends) * len(surface.vertices) + np.maximum(starts, ends)
    order = np.argsort(key, kind="stable")
    pair = np.flatnonzero(key[order[1:]] == key[order[:-1]])
    one, other = order[pair], order[pair + 1]
    smooth = np.einsum("ij,ij->i", normals[one // 3], normals[other // 3]) >= np.cos(np.radians(sharp))
    smooth &= starts[one] == ends[other]  # of one orientation: the start of one is the end of the other
    one, other = one[smooth], other[smooth]
    joined = (np.concatenate([one, corner_at_end[one]]), np.concatenate([corner_at_end[other], other]))
    graph = sp.coo_array((np.ones(len(joined[0]), dtype=bool), joined), (corner.size, corner.size))
    count, parts = connected_components(graph, directed=False)
    origin = np.empty(count, dtype=np.int64)
    origin[parts] = starts
    return origin, parts.astype(np.int64).reshape(-1, 3)


def triangle_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Normals of triangles, (m, 3), as long as twice their area, mm²."""
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    return np.asarray(np.cross(b - a, c - a))


def vertex_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Unit normals at the vertices, (n, 3): the mean of their triangles' by area."""
    normals, summed = triangle_normals(vertices, triangles), np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(summed, triangles[:, corner], normals)
    return summed / np.maximum(np.linalg.norm(summed, axis=1, keepdims=True), np.finfo(float).tiny)
