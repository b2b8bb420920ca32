"""The isoparametric field in hexahedra: χ and place trilinear in the same reference coordinates.

Hexahedra come as corners (n, 8, 4), places in mm and then χ, in scikit-fem's local order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from skfem import ElementHex1

from actuator.arrays import Floats

#: Last step of a projection that has settled, in reference coordinates; the distance is off by its square then.
SETTLED = 1.0e-3
#: Takes the place of smaller derivatives; its inverse does not overflow.
TINY = 1.0e-300
_HEXAHEDRON = ElementHex1()


def projected(
    corners: Floats, place: Floats, target: Floats, steps: int, part: float
) -> tuple[Floats, NDArray[np.bool_]]:
    """Distance (n,) of targets to the zero set in one hexahedron each, and whether the foot has settled inside it.

    A step goes to the zero set along ∇χ and, by a part of the way, to where the target is seen along ∇χ; it ends at the
    sides of the hexahedron.

    Args:
        corners: of the hexahedra, (n, 8, 4); χ is scaled to be at most 1.
        place: reference coordinates to start from, (n, 3).
        target: (n, 3), mm.
        steps: how many.
        part: of the way along the zero set, 1 for Newton's method.

    Returns:
        The distance to the nearest foot met, mm, infinite if there was none in the hexahedron; and whether the last
        step was small and inside.
    """
    distances, last, wanted = np.full(len(place), np.inf), place, place
    for step in range(steps + 1):
        last, place = place, np.clip(wanted, 0.0, 1.0)
        point, edges, value, slope = field(corners, place)
        foot = _on_zero_set(place, point, edges, value, slope)
        distances = np.minimum(distances, np.linalg.norm(foot - target, axis=1))
        if step == steps:
            break
        cofactors = cofactor_matrices(edges)
        volume = np.einsum("ni,ni->n", cofactors[:, :, 0], edges[:, :, 0])[:, None]
        gradient = np.einsum("nik,nk->ni", cofactors, slope) / volume
        along = part * (target - point)
        excess = np.einsum("ni,ni->n", along, gradient) + value
        along -= (excess / np.maximum(np.einsum("ni,ni->n", gradient, gradient), TINY))[:, None] * gradient
        wanted = place + np.einsum("nik,ni->nk", cofactors, along) / volume
    settled = (np.abs(wanted - last).max(axis=1) < SETTLED) & (np.abs(wanted - place).max(axis=1) < 1.0e-9)
    return distances, settled


def _on_zero_set(place: Floats, point: Floats, edges: Floats, value: Floats, slope: Floats) -> Floats:
    """The root nearest to a point on the three lines of two constant reference coordinates through it, (n, 3), mm.

    Infinite where no line has a root inside the hexahedron.
    """
    move = -value[:, None] / np.where(np.abs(slope) < TINY, TINY, slope)
    length = np.abs(move) * np.linalg.norm(edges, axis=1)
    length[(place + move < 0.0) | (place + move > 1.0)] = np.inf
    axis = length.argmin(axis=1)
    each = np.arange(len(axis))
    found = point + edges[each, :, axis] * move[each, axis, None]
    return np.where(np.isfinite(length[each, axis, None]), found, np.inf)


def field(corners: Floats, place: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Points (n, 3), their derivatives (n, 3, 3), χ (n,) and its derivatives (n, 3) at reference coordinates (n, 3)."""
    shapes, slopes = shape_functions(place)
    # One product for all of them: rows are the value and the derivatives, columns the place and χ.
    found = np.concatenate([shapes[:, None], slopes], axis=1).transpose(2, 1, 0) @ corners
    return found[:, 0, :3], found[:, 1:, :3].transpose(0, 2, 1), found[:, 0, 3], found[:, 1:, 3]


def shape_functions(place: Floats) -> tuple[Floats, Floats]:
    """Trilinear shape functions (8, n) and their derivatives (8, 3, n) at reference coordinates (n, 3)."""
    values, slopes = zip(*(_HEXAHEDRON.lbasis(place.T, corner) for corner in range(8)), strict=True)
    return np.stack(values), np.stack(slopes)


def cofactor_matrices(edges: Floats) -> Floats:
    """Cofactor matrices of (n, 3, 3) matrices."""
    first, second, third = np.moveaxis(edges, 2, 0)
    return np.stack([np.cross(second, third), np.cross(third, first), np.cross(first, second)], axis=2)
