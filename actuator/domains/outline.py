"""The wall of a section as a line of straight pieces: distances from it, and a section's mesh inside it.

A wall is that of the half X2 >= 0, (n, 2) as (X2, X3), from its lowest point on the plane X2 = 0 to its highest there.
Seen from the axis, (0, X3), it is star-shaped: a ray from there meets it once.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.domains import o_grid

#: Directions that differ by more, in degrees, meet in a corner, at which there is a vertex of every mesh; flatter ones
#: are a curve, of whose length a chord across them loses at most 1.5 %.
CORNER = 20.0
#: Pieces of a rounded edge, 11.25° each.
ROUNDED = 8


def box(width: float, height: float, edge: float) -> tuple[Floats, Ints]:
    """The wall of a box whose edges along X1 are rounded, (n, 2), mm, and its points in the middles of the two edges.

    Args:
        width, height: along X2, of both halves, and along X3, mm.
        edge: radius of the edges, mm; 0 for sharp ones.
    """
    turn = np.linspace(-0.5 * np.pi, 0.0, ROUNDED + 1 if edge else 1)
    arc = edge * np.stack([np.cos(turn), np.sin(turn)], axis=-1) if edge else np.zeros((1, 2))
    low = np.array([0.5 * width - edge, edge - 0.5 * height]) + arc
    high = low[::-1] * (1.0, -1.0)
    wall = np.concatenate([[[0.0, -0.5 * height]], low, high, [[0.0, 0.5 * height]]])
    middle = 1 + len(arc) // 2
    return wall, np.array([middle, len(wall) - 1 - middle])


def fault(wall: Floats, axis: float) -> str:
    """What is wrong with a wall, as the end of a sentence; empty if nothing is."""
    if wall.ndim != 2 or wall.shape[1:] != (2,) or len(wall) < 3:
        return "must be three points [X2, X3] or more"
    if wall[0, 0] != 0.0 or wall[-1, 0] != 0.0 or (wall[1:-1, 0] <= 0.0).any():
        return "must begin and end on the plane X2 = 0 and have X2 > 0 in between, as it is that of the half X2 >= 0"
    if not wall[0, 1] < axis < wall[-1, 1]:
        return f"must go from below the axis at X3 = {axis:g} to above it"
    ray = wall - (0.0, axis)
    turned = ray[:-1, 0] * ray[1:, 1] - ray[:-1, 1] * ray[1:, 0]
    if (hidden := np.flatnonzero(turned <= 0.0)).size:
        return (
            f"must be seen whole from the axis at X3 = {axis:g}, and its piece {hidden[0] + 1} is hidden or runs "
            "backwards; choose another axis, or mesh it yourself (shape: mesh)"
        )
    return ""


def distance(wall: Floats, places: Floats) -> Floats:
    """Distance of places (..., 2) from a wall, or from its mirror image for those at X2 < 0; (...)."""
    return from_pieces(pairwise(wall), np.stack([np.abs(places[..., 0]), places[..., 1]], axis=-1))


def from_pieces(pieces: Iterable[tuple[Floats, Floats]], places: Floats) -> Floats:
    """Distance of places (..., 2) from the nearest of straight pieces, given by their ends (2,); (...)."""
    nearest = np.full(places.shape[:-1], np.inf)
    for start, end in pieces:
        along, from_start = end - start, places - start
        share = np.clip(from_start @ along / (along @ along), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(from_start - share[..., None] * along, axis=-1))
    return nearest


def corners(wall: Floats) -> Ints:
    """Numbers of the points in which a wall has a corner, (n,)."""
    piece = np.diff(wall, axis=0)
    direction = np.arctan2(piece[:, 1], piece[:, 0])
    turned = np.abs((np.diff(direction) + np.pi) % (2.0 * np.pi) - np.pi)
    return 1 + np.flatnonzero(turned > np.radians(CORNER))


def meshed(
    wall: Floats, axis: float, core_cells: tuple[int, int], rings: int, refinement: int, fixed: Ints | None = None
) -> tuple[Floats, Ints]:
    """Points and cells inside a wall, as of :func:`actuator.domains.o_grid.within`.

    Vertices on the wall have equal distances along it between one corner and the next.

    Args:
        wall, axis: see above.
        core_cells, rings: m2, m3 and k of the mesh that is refined.
        refinement: into how many cells each of that mesh is divided along either of its sides.
        fixed: numbers of the wall's points that the core's two corners look at; by default its corners lie where they
            fall.

    Raises:
        ValueError: if there are more corners than cells, or a cell would be turned inside out.
    """
    m2, m3 = core_cells
    around = 2 * (m2 + m3)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(wall, axis=0), axis=1))])
    at = corners(wall) if fixed is None else fixed
    if len(at) >= around:
        raise ValueError(f"has {len(at)} corners and {around} cells along the wall; raise across or up")
    if fixed is None:
        number = np.arange(1, len(at) + 1)
        # The nearest vertex, each corner with one of its own.
        grid = np.maximum.accumulate(np.rint(around * along[at] / along[-1]).astype(int) - number) + number
        grid = np.minimum(np.maximum(grid, number), around - len(at) - 1 + number)
    else:
        grid = np.array([m2, m2 + 2 * m3])
    steps = np.interp(np.arange(around * refinement + 1) / refinement, [0, *grid, around], [0.0, *along[at], along[-1]])
    vertices = np.stack([np.interp(steps, along, wall[:, axis_]) for axis_ in (0, 1)], axis=-1)
    points, cells = o_grid.within(vertices, axis, (m2 * refinement, m3 * refinement), rings * refinement)
    ring = points[cells.reshape(-1, 4)[:, [0, 2, 3, 1]]]
    before, after = ring - np.roll(ring, 1, axis=1), np.roll(ring, -1, axis=1) - ring
    if (before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0]).min() <= 0.0:
        raise ValueError(
            "has a section whose cells would be turned inside out; change the axis, across, up or rings, or mesh it "
            "yourself (shape: mesh)"
        )
    return points, cells
