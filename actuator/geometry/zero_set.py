"""The boundary of the solid {χ > threshold}: a closed, oriented 2-manifold by construction.

Marching tetrahedra (Doi & Koide, IEICE Trans. E74, 214 (1991)) on a conforming mesh, with one vertex per cut edge. The
triangles of the outer boundary are clipped at the same cut vertices, so the two parts share all their vertices.
A value equal to the threshold counts as void.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from actuator.arrays import Floats, Ints
from actuator.failure import InvalidField

#: Least distance of a cut from the ends of its edge, as a fraction of the edge. It keeps the vertices around a node
#: with a value at the threshold apart, also in the float32 of an STL file, and moves the surface by less than 0.1 µm.
CLEARANCE = 1.0e-4


@dataclass(frozen=True)
class Surface:
    """A triangulated surface.

    Attributes:
        vertices: (n, 3), mm.
        triangles: vertex numbers, (m, 3), counter-clockwise seen from outside.
    """

    vertices: Floats
    triangles: Ints


def check_field(chi: Floats, size: int) -> None:
    """Refuse a vertex field of the wrong size or with values that are not finite.

    Raises:
        InvalidField: with the number of bad values.
    """
    if chi.shape != (size,):
        raise InvalidField(
            f"The design field has shape {chi.shape} but the mesh has {size} vertices; "
            "give the field that belongs to this mesh."
        )
    bad = int(np.count_nonzero(~np.isfinite(chi)))
    if bad:
        raise InvalidField(
            f"The design field is not finite at {bad} of {size} vertices; repeat the stage that computed it."
        )


def solid_boundary(points: Floats, tets: Ints, outer: Ints, chi: Floats, threshold: float = 0.0) -> Surface:
    """Boundary of {χ > threshold} for χ linear in every tetrahedron.

    Args:
        points: (n, 3), mm.
        tets: (t, 4), positive volume, conforming.
        outer: boundary triangles of the mesh to close the solid at, (f, 3), oriented outwards; where boundary triangles
            are left out, the surface stays open.
        chi: field at the points, (n,), finite.
        threshold: level of the surface, in units of χ.

    Returns:
        The surface; empty if nothing is solid. Vertices are the solid points on ``outer``, then the cut edges.
    """
    value = chi - threshold
    solid = value > 0.0
    # A corner is a pair (solid point, void point) for a cut edge, or (solid point, same point) for the point itself.
    corners = np.concatenate([_march_tetrahedra(tets, solid), _clip_triangles(outer, solid)])
    kept, cut = corners[..., 0].ravel(), corners[..., 1].ravel()
    is_cut = kept != cut
    key = np.where(is_cut, kept * len(points) + cut + len(points), kept)
    keys, triangles = np.unique(key, return_inverse=True)
    n_points = int(np.searchsorted(keys, len(points)))
    start, end = np.divmod(keys[n_points:] - len(points), len(points))
    fraction = np.clip(value[start] / (value[start] - value[end]), CLEARANCE, 1.0 - CLEARANCE)[:, None]
    # In this form a coordinate that both ends share is kept to the last bit, so planes stay planes.
    cuts = points[start] + fraction * (points[end] - points[start])
    return Surface(np.concatenate([points[keys[:n_points]], cuts]), triangles.reshape(-1, 3))


def _march_tetrahedra(tets: Ints, solid: NDArray[np.bool_]) -> Ints:
    """Triangles of the level set, corners as (solid, void) pairs, (n, 3, 2)."""
    case = solid[tets] @ np.array([1, 2, 4, 8])
    parts = []
    for code, (order, triangles) in _TETRAHEDRON.items():
        found = tets[case == code][:, order]
        parts += [found[:, corners] for corners in triangles]
    return np.concatenate(parts)


def _clip_triangles(triangles: Ints, solid: NDArray[np.bool_]) -> Ints:
    """Solid part of boundary triangles, corners as (solid, solid or void) pairs, (n, 3, 2)."""
    case = solid[triangles] @ np.array([1, 2, 4])
    parts = [np.repeat(triangles[case == 7][:, :, None], 2, axis=2)]
    for first in range(3):
        turned = np.roll(triangles, -first, axis=1)
        one, two = turned[case == 1 << first], turned[case == 7 - (1 << (first + 2) % 3)]
        parts.append(one[:, np.array([(0, 0), (0, 1), (0, 2)])])
        parts.append(two[:, np.array([(0, 0), (1, 1), (1, 2)])])
        parts.append(two[:, np.array([(0, 0), (1, 2), (0, 2)])])
    return np.concatenate(parts)


def _tetrahedron_cases() -> dict[int, tuple[Ints, list[Ints]]]:
    """Per sign pattern (bit i: vertex i is solid): an even order with the odd ones out first, and the triangles.

    Triangles are outward, from solid to void; a corner is a pair (solid, void) of positions in that order.
    """
    # Even permutations of (0, 1, 2, 3) that bring each vertex, or each pair, to the front.
    first = [(0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0)]
    pairs = [(0, 1, 2, 3), (0, 2, 3, 1), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 2, 0), (2, 3, 0, 1)]
    one_solid = [np.array([(0, 1), (0, 2), (0, 3)])]
    one_void = [np.array([(1, 0), (3, 0), (2, 0)])]
    two_solid = [np.array([(0, 2), (0, 3), (1, 3)]), np.array([(0, 2), (1, 3), (1, 2)])]
    cases = {}
    for order in first:
        cases[1 << order[0]] = (np.array(order), one_solid)
        cases[15 - (1 << order[0])] = (np.array(order), one_void)
    for order in pairs:
        cases[(1 << order[0]) + (1 << order[1])] = (np.array(order), two_solid)
    return cases


_TETRAHEDRON = _tetrahedron_cases()


def reflected(half: Surface) -> Surface:
    """The half and its mirror image about X2 = 0, sharing the vertices on that plane.

    The image has the same triangles, turned around, on vertices with the sign of X2 changed: the result is symmetric to
    the last bit, and closed if the half is open on the plane X2 = 0 only.
    """
    beside = half.vertices[:, 1] != 0.0
    image = np.arange(len(beside))
    image[beside] = len(beside) + np.arange(np.count_nonzero(beside))
    vertices = np.concatenate([half.vertices, half.vertices[beside] * (1.0, -1.0, 1.0)])
    return Surface(vertices, np.concatenate([half.triangles, image[half.triangles[:, ::-1]]]))
