"""Vertices of a file that are meant to be one: where triangles that should share an edge do not quite."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from actuator.arrays import Floats, Ints
from actuator.geometry.solid import is_two_manifold, rounded
from actuator.geometry.zero_set import Surface

#: Distances within which vertices on open edges are merged, as fractions of the largest coordinate: what is left of
#: single precision (6e-8 of it) after some arithmetic, and half a unit in the last of the six digits that text has.
FRACTIONS = (1.0e-6, 1.0e-5)


@dataclass(frozen=True)
class Merged:
    """A surface whose vertices are merged.

    Attributes:
        surface: in single precision.
        within: distance within which vertices on open edges were merged, mm; 0 if only equal ones had to be.
    """

    surface: Surface
    within: float


def merged(vertices: Floats, triangles: Ints) -> Merged:
    """Merge equal vertices and, if the surface is open, those on open edges that are as near as the file's precision.

    Of the distances the first that closes the surface is taken. If none does, only equal vertices are merged.

    Args:
        vertices: (n, 3), mm, finite.
        triangles: (m, 3).
    """
    exact = rounded(vertices, triangles)
    if not len(exact.triangles) or is_two_manifold(exact.triangles):
        return Merged(exact, 0.0)
    largest = float(np.abs(exact.vertices).max())
    for fraction in FRACTIONS:
        sewn = _sewn(exact, fraction * largest)
        if len(sewn.triangles) and is_two_manifold(sewn.triangles):
            return Merged(sewn, fraction * largest)
    return Merged(exact, 0.0)


def _open_edges(triangles: Ints) -> Ints:
    """Ends (k, 2) of the edges that belong to one triangle only."""
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    size = int(triangles.max()) + 1
    edges, count = np.unique(sides[:, 0] * size + sides[:, 1], return_counts=True)
    return np.stack(np.divmod(edges[count == 1], size), axis=1)


def _sewn(surface: Surface, distance: float) -> Surface:
    """The surface with vertices of open edges merged that lie within a distance of each other."""
    rim = np.unique(_open_edges(surface.triangles))
    pairs = cKDTree(surface.vertices[rim]).query_pairs(distance, output_type="ndarray")
    ones = np.ones(len(pairs), dtype=bool)
    _, group = connected_components(coo_array((ones, pairs.T), (len(rim),) * 2), directed=False)
    _, first = np.unique(group, return_index=True)
    number = np.arange(len(surface.vertices))
    number[rim] = rim[first][group]
    return rounded(surface.vertices[number], surface.triangles)
