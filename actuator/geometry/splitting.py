"""Triangles split where a field on them is not linear: flat faces may need few triangles, a field on them may not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from actuator.arrays import Floats, Ints
from actuator.geometry.zero_set import Surface


def split_where_curved(
    surface: Surface, field: Callable[[Floats], Floats], tolerance: float, shortest: float, rounds: int = 6
) -> tuple[Surface, Floats]:
    """Halve edges until a field is linear along each of them.

    Both triangles of an edge are split at the same place, so that a closed surface stays closed, and all new vertices
    lie on the surface.

    Args:
        surface: the triangles.
        field: values (n, k) at points (n, 3).
        tolerance: largest difference between the field in the middle of an edge and the mean of its ends.
        shortest: edges shorter than this are not halved, mm.
        rounds: how often an edge of the surface may be halved.

    Returns:
        The surface, the old vertices first, and the field at its vertices.
    """
    vertices, triangles = surface.vertices, np.asarray(surface.triangles, dtype=np.int64)
    values = field(vertices)
    for _ in range(rounds):
        sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        edges, side = np.unique(sides, axis=0, return_inverse=True)
        long = np.flatnonzero(np.linalg.norm(np.diff(vertices[edges], axis=1)[:, 0], axis=1) > shortest)
        middles = vertices[edges[long]].mean(axis=1)
        found = field(middles)
        curved = np.abs(found - values[edges[long]].mean(axis=1)).max(axis=1) > tolerance
        if not curved.any():
            break
        middle = np.full(len(edges), -1)
        middle[long[curved]] = len(vertices) + np.arange(np.count_nonzero(curved))
        vertices, values = np.concatenate([vertices, middles[curved]]), np.concatenate([values, found[curved]])
        triangles = _split(triangles, middle[side.ravel()].reshape(-1, 3))
    return Surface(vertices, triangles), values


def _split(triangles: Ints, middle: Ints) -> Ints:
    """Triangles (m, 3) cut at the middles (m, 3) of their sides 01, 12 and 20, -1 where a side stays whole."""
    cut = middle >= 0
    count = cut.sum(axis=1)
    parts = [triangles[count == 0]]
    for first in range(3):
        (a, b, c), (ab, bc, ca) = np.roll(triangles, -first, axis=1).T, np.roll(middle, -first, axis=1).T
        one = (count == 1) & (ab >= 0)
        parts += [_columns(one, a, ab, c), _columns(one, ab, b, c)]
        two = (count == 2) & (ca < 0)
        parts += [_columns(two, ab, b, bc), _columns(two, a, ab, bc), _columns(two, a, bc, c)]
    (a, b, c), (ab, bc, ca) = triangles.T, middle.T
    all_ = count == 3
    parts += [_columns(all_, *corners) for corners in ((a, ab, ca), (ab, b, bc), (bc, c, ca), (ab, bc, ca))]
    return np.concatenate(parts)


def _columns(wanted: NDArray[np.bool_], *corners: Ints) -> Ints:
    return np.stack([corner[wanted] for corner in corners], axis=1)
