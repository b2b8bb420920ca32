"""States of solids as they are drawn: a half is completed without a seam, or a whole cut open at X2 = 0."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.failure import EmptySolid
from actuator.geometry.sampling import MIRROR
from actuator.geometry.zero_set import Surface
from pipeline.figures.offscreen import BODY, Piece, Scale, piece
from stages.datasets import vtk_order

if TYPE_CHECKING:
    from actuator.domains.interface import Domain

CUT = "#e8a33d"

#: What counts as on the plane X2 = 0, over the size of the solid: VTK's points are of single precision.
ON_PLANE = 1e-6


def completed(points: Floats, triangles: Ints, *fields: Floats) -> tuple[Floats, Ints, list[Floats]]:
    """A surface of the half X2 >= 0 with its mirror image, sharing the vertices on the plane X2 = 0.

    Args:
        points: (n, 3), mm.
        triangles: (m, 3); those in the plane are left out.
        fields: at the points, (n,) or, vectors, (n, 3).

    Returns:
        The same of the whole.
    """
    beside = np.abs(points[:, 1]) > ON_PLANE * np.ptp(points)
    triangles = triangles[beside[triangles].any(axis=1)]
    other = np.flatnonzero(beside)
    image = np.arange(len(points))
    image[other] = len(points) + np.arange(len(other))
    both = [
        np.concatenate([each, each[other] * MIRROR if each.ndim == 2 else each[other]]) for each in (points, *fields)
    ]
    return both[0], np.concatenate([triangles, image[triangles][:, ::-1]]), both[1:]


def solid_of(domain: Domain, chi: Floats, **fields: Floats) -> Any:
    """What is solid, χ > 0, as a grid of pyvista.

    Args:
        domain: the meshed domain.
        chi: at its vertices, (n_vertices,).
        fields: at them, (n_vertices,) or, vectors, (n_vertices, 3).

    Raises:
        actuator.failure.EmptySolid: if nothing is solid.
    """
    import pyvista  # slow to load: only where a solid is drawn

    if not (chi > 0.0).any():
        raise EmptySolid(f"Nothing is solid: χ is at most {chi.max():.3g}.")
    cells = np.ascontiguousarray(domain.cells[:, vtk_order()[:8]])
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: cells}, domain.points)
    for name, values in {"chi": chi, **fields}.items():
        grid.point_data[name] = values
    return grid.clip_scalar(scalars="chi", value=0.0, invert=False)


def whole(grid: Any, half: bool, name: str, scale: Scale | None) -> list[Piece]:
    """A solid under load, coloured by a field, or in one colour.

    Args:
        grid: of pyvista, with ``displacement``, mm, and the field at its points.
        half: whether it is the half X2 >= 0.
        name: of the field.
        scale: of its colours; one colour for all if there is none.
    """
    return [_coloured(grid, half, name, scale)]


def cut_open(grid: Any, half: bool, name: str, scale: Scale) -> list[Piece]:
    """The half X2 >= 0 of the same."""
    return [_coloured(grid if half else grid.clip("-y", origin=(0.0, 0.0, 0.0)), False, name, scale)]


def opened(half: Surface) -> list[Piece]:
    """A closed surface of the half X2 >= 0, its face on the plane X2 = 0 in another colour."""
    on_cut = np.abs(half.vertices[half.triangles, 1]).max(axis=1) < ON_PLANE * np.ptp(half.vertices)
    found = [(~on_cut, BODY), (on_cut, CUT)]
    return [
        piece(Surface(half.vertices, half.triangles[mask]), colour, lit=colour != CUT)
        for mask, colour in found
        if mask.any()
    ]


def surface_of(grid: Any) -> tuple[Surface, dict[str, Floats]]:
    """The surface of a grid, undeformed, triangles counter-clockwise from outside, and its fields at its vertices."""
    found = grid.extract_surface(algorithm="dataset_surface").triangulate()
    # The pieces of clipped cells are turned either way.
    found = found.compute_normals(point_normals=False, consistent_normals=True, auto_orient_normals=True)
    points, triangles = np.asarray(found.points, dtype=np.float64), np.asarray(found.regular_faces, dtype=np.int64)
    fields = {name: np.asarray(values, dtype=np.float64) for name, values in found.point_data.items()}
    return Surface(points, triangles), fields


def _coloured(grid: Any, complete: bool, name: str, scale: Scale | None) -> Piece:
    surface, fields = surface_of(grid)
    points, triangles, (values, moved) = surface.vertices, surface.triangles, (fields[name], fields["displacement"])
    if complete:
        points, triangles, (values, moved) = completed(points, triangles, values, moved)
    moved_surface = Surface(points + moved, triangles)
    return piece(moved_surface, values=np.clip(values, 0.0, scale.high), scale=scale) if scale else piece(moved_surface)
