"""Where a surface goes through itself: pairs of triangles each of which lies on both sides of the other.

Candidates are pairs whose bounding boxes overlap, found by a sweep along the longest side of the part (Cohen et al.
1995, doi:10.1145/199404.199437). A pair crosses if each triangle has corners on both sides of the other's plane and the
pieces of the line that both have in common overlap (Möller 1997, doi:10.1080/10867651.1997.10487472), all by more than
a tolerance: what only touches does not cross.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from actuator.arrays import Floats
from actuator.geometry.merging import FRACTIONS
from actuator.geometry.normals import triangle_normals
from actuator.geometry.zero_set import Surface


@dataclass(frozen=True)
class Crossings:
    """Pairs of triangles that go through each other.

    Attributes:
        pairs: their number.
        first: a point on one of the lines in which they meet, mm; None if there is none.
    """

    pairs: int
    first: tuple[float, float, float] | None


def crossings(surface: Surface) -> Crossings:
    """Look for pairs of triangles that cross by more than the precision of a file.

    Args:
        surface: triangles, mm, whose equal vertices are merged.
    """
    tolerance = FRACTIONS[0] * float(np.abs(surface.vertices).max())
    corners = surface.vertices[surface.triangles]
    axis = int(np.ptp(surface.vertices, axis=0).argmax())
    order = np.argsort(corners[:, :, axis].min(axis=1), kind="stable")
    corners = np.ascontiguousarray(np.roll(corners, -axis, axis=2)[order])
    normals = triangle_normals(corners)
    length = np.linalg.norm(normals, axis=1)
    # What is less high than the tolerance has no normal that means anything.
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    normals[length <= tolerance * longest] = 0.0
    normals /= np.where(length > 0.0, length, 1.0)[:, None]
    count, place = _sweep(corners, normals, corners.min(axis=1), corners.max(axis=1), tolerance)
    if not count:
        return Crossings(0, None)
    x, y, z = np.roll(place, axis).tolist()
    return Crossings(count, (x, y, z))


@njit(cache=True)
def _sweep(corners: Floats, normals: Floats, low: Floats, high: Floats, tolerance: float) -> tuple[int, Floats]:
    """How many pairs of triangles (n, 3, 3), by their lowest first coordinate, cross, and where one does."""
    count, place, first = 0, np.zeros(3), np.zeros(3)
    for i in range(len(corners)):
        for j in range(i + 1, len(corners)):
            if low[j, 0] > high[i, 0]:
                break
            if low[j, 1] > high[i, 1] or low[i, 1] > high[j, 1] or low[j, 2] > high[i, 2] or low[i, 2] > high[j, 2]:
                continue
            if _cross(corners[i], corners[j], normals[i], normals[j], tolerance, place):
                if count == 0:
                    first[:] = place
                count += 1
    return count, first


@njit(cache=True)
def _cross(one: Floats, other: Floats, n: Floats, m: Floats, tolerance: float, place: Floats) -> bool:
    """Whether two triangles with their unit normals cross; a point where they do is written to ``place``."""
    off_one, off_other = _off(other, one[0], n, tolerance), _off(one, other[0], m, tolerance)
    if not (_both_sides(off_one) and _both_sides(off_other)):
        return False
    line = (n[1] * m[2] - n[2] * m[1], n[2] * m[0] - n[0] * m[2], n[0] * m[1] - n[1] * m[0])
    length = (line[0] ** 2 + line[1] ** 2 + line[2] ** 2) ** 0.5
    if length == 0.0:
        return False
    direction = (line[0] / length, line[1] / length, line[2] / length)
    (from_one, to_one), (from_other, to_other) = _piece(one, off_other, direction), _piece(other, off_one, direction)
    start, end = max(from_one, from_other), min(to_one, to_other)
    if end - start <= tolerance:
        return False
    _point(one, off_other, direction, 0.5 * (start + end), place)
    return True


@njit(cache=True)
def _off(corners: Floats, point: Floats, normal: Floats, tolerance: float) -> tuple[float, float, float]:
    """Distances of the corners from a plane, with their sign; 0 within the tolerance."""
    a, b, c = 0.0, 0.0, 0.0
    for i in range(3):
        a += (corners[0, i] - point[i]) * normal[i]
        b += (corners[1, i] - point[i]) * normal[i]
        c += (corners[2, i] - point[i]) * normal[i]
    return (
        a if abs(a) > tolerance else 0.0,
        b if abs(b) > tolerance else 0.0,
        c if abs(c) > tolerance else 0.0,
    )


@njit(cache=True)
def _both_sides(off: tuple[float, float, float]) -> bool:
    return min(off) < 0.0 < max(off)


@njit(cache=True)
def _piece(
    corners: Floats, off: tuple[float, float, float], direction: tuple[float, float, float]
) -> tuple[float, float]:
    """Where along a direction the piece of a triangle in a plane begins and ends, given how far its corners are off."""
    start, end = np.inf, -np.inf
    for k in range(3):
        p, q = off[k], off[(k + 1) % 3]
        if p == 0.0 or p * q < 0.0:
            share = p / (p - q) if p != 0.0 else 0.0
            along = 0.0
            for i in range(3):
                along += (corners[k, i] + share * (corners[(k + 1) % 3, i] - corners[k, i])) * direction[i]
            start, end = min(start, along), max(end, along)
    return start, end


@njit(cache=True)
def _point(
    corners: Floats,
    off: tuple[float, float, float],
    direction: tuple[float, float, float],
    along: float,
    place: Floats,
) -> None:
    """Write the point of a triangle's piece in a plane that is so far along a direction to ``place``."""
    for k in range(3):
        p, q = off[k], off[(k + 1) % 3]
        if p == 0.0 or p * q < 0.0:
            share = p / (p - q) if p != 0.0 else 0.0
            for i in range(3):
                place[i] = corners[k, i] + share * (corners[(k + 1) % 3, i] - corners[k, i])
            break
    here = place[0] * direction[0] + place[1] * direction[1] + place[2] * direction[2]
    for i in range(3):
        place[i] += (along - here) * direction[i]
