"""Fixed designs on any mesh of the half cylinder, and directions in which to vary them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from actuator.arrays import Floats, Ints
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.geometry.trilinear import shape_functions

#: Cells whose centres are nearest to a point, among which the one that holds it is looked for.
CANDIDATES = 9
NEWTON_STEPS = 8


def carried(chi: Floats, source: HalfCylinder, points: Floats) -> Floats:
    """The trilinear field of one mesh at any points of the half cylinder.

    Finer meshes take it over but for the kinks within their cells; coarser ones sample it and lose what is narrower
    than a cell. Points between the wall and its chords take the value at the nearest place of the outermost cell.

    Args:
        chi: χ at the vertices of ``source``, (n_vertices,).
        points: (n, 3), mm.

    Returns:
        χ at the points, (n,).
    """
    layer = points[:, 0] / source.length * source.layers
    below = np.clip(layer.astype(int), 0, source.layers - 1)
    cell, place = _located(source, points[:, 1:])
    shapes, _ = shape_functions(np.column_stack([layer - below, place]))  # (8, n)
    corners = source.cells[below * source.section_cells + cell]
    return np.einsum("an,na->n", shapes, chi[corners])


def _located(source: HalfCylinder, points: Floats) -> tuple[Ints, Floats]:
    """Cell of the section (n,) and reference coordinates in it (n, 2) of points (n, 2)."""
    # In the plane X1 = 0 of the first layer the trilinear map is the bilinear one of the section.
    corners = source.points[source.cells[: source.section_cells], 1:]  # (cell, 8, 2)
    nearest = np.asarray(cKDTree(corners.mean(axis=1)).query(points, k=CANDIDATES)[1])
    place = np.full((*nearest.shape, 3), 0.5)
    place[..., 0] = 0.0
    box = corners[nearest]  # (n, candidate, 8, 2)
    for _ in range(NEWTON_STEPS):
        values, slopes = shape_functions(place.reshape(-1, 3))
        values, slopes = values.reshape(8, *nearest.shape), slopes.reshape(8, 3, *nearest.shape)[:, 1:]
        miss = points[:, None] - np.einsum("anc,ncai->nci", values, box)
        jacobian = np.einsum("aknc,ncai->ncik", slopes, box)
        # Candidates far from the point may run away: they are not taken, but must stay finite.
        place[..., 1:] = np.clip(place[..., 1:] + np.linalg.solve(jacobian, miss[..., None])[..., 0], -1.0, 2.0)
    outside = np.maximum(-place, place - 1.0)[..., 1:].max(axis=-1)
    best = outside.argmin(axis=1)
    each = np.arange(len(points))
    return nearest[each, best], np.clip(place[each, best, 1:], 0.0, 1.0)


def directions(domain: Domain) -> Floats:
    """Six smooth variations δχ of a design at the vertices, (6, n_vertices), each of size one.

    Constant; linear in X3; half a wave along X1; a wave along X3 with the same along X1; a wave in the radius; and one
    around the axis.
    """
    x1, x2, x3 = domain.points.T
    along, height = np.pi * x1 / domain.length, np.pi * x3 / domain.size
    radius, angle = np.hypot(x2, x3) / domain.size, np.arctan2(x3, x2)
    return np.stack(
        [
            np.ones_like(x1),
            x3 / domain.size,
            np.cos(along),
            np.cos(along) * np.sin(height),
            np.cos(2.0 * np.pi * radius**2),
            radius**3 * np.sin(3.0 * angle),
        ]
    )
