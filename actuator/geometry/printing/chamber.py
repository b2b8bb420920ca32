"""Whether a part holds air once plates are glued on its two end faces.

The plates are boxes that reach into the part by the thickness of the glue, and the union with them is exact on the
triangles (manifold3d). What was open at the end faces and nowhere else is then a closed cavity. That cavity is the
chamber if it touches both plates or holds a point of the axis in the middle part of the length; the axis goes through
the middle of the bounding box. An opening is a hole in the section of the part at the depth of the glue.

Where the air gets out is then looked for on voxels: it is the narrowest place on the widest way from the openings to
the outside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold, OpType
from scipy import ndimage

from actuator.arrays import Floats
from actuator.geometry.bodies import Shell, shells
from actuator.geometry.islands import winding_number
from actuator.geometry.printing.directions import Axis
from actuator.geometry.printing.drains import Necks
from actuator.geometry.printing.voxels import Voxels
from actuator.geometry.solid import manifold_of, surface_of
from actuator.geometry.zero_set import Surface

#: Where on the axis a chamber is looked for, as fractions of the length.
MIDDLE = (0.35, 0.45, 0.5, 0.55, 0.65)


@dataclass(frozen=True)
class Sealing:
    """What glued plates make of a part.

    Attributes:
        openings: area of the holes in the section at the lower and at the upper end, mm².
        bore: whether the axis lies outside the material at both ends, as in a tube with a slit from end to end, whose
            sections have no holes.
        chambers: volume of every closed chamber between the plates, mm³, largest first.
        both_ends: whether one of them touches both plates.
        others: volume of other cavities that the plates close, mm³, largest first.
    """

    openings: tuple[float, float]
    bore: bool
    chambers: tuple[float, ...]
    both_ends: bool
    others: tuple[float, ...]


@dataclass(frozen=True)
class Leak:
    """Where a part with plates on leaks.

    Attributes:
        width: diameter of the largest ball that gets out, mm, to about one pitch.
        at: where this ball is stopped, mm.
    """

    width: float
    at: tuple[float, float, float]


def sealing(surface: Surface, axis: Axis, glue: float) -> Sealing:
    """Glue plates over both end faces.

    Args:
        surface: closed, oriented 2-manifold.
        axis: along which the end faces lie opposite.
        glue: depth by which the plates enter the part, mm.
    """
    turned = _along_z(surface, axis)
    low, high = turned.vertices.min(axis=0), turned.vertices.max(axis=0)
    part = manifold_of(turned)
    openings = (_holes(part, low[2] + glue), _holes(part, high[2] - glue))
    size = high - low + 2.0 * glue
    plates = [
        Manifold.cube(size.tolist()).translate([low[0] - glue, low[1] - glue, low[2] + glue - size[2]]),
        Manifold.cube(size.tolist()).translate([low[0] - glue, low[1] - glue, high[2] - glue]),
    ]
    glued = surface_of(Manifold.batch_boolean([part, *plates], OpType.Add))
    cavities = [shell for shell in shells(glued) if shell.volume < 0.0]
    near = 1.0e-3 * glue
    ends = [(s.low[2] < low[2] + glue + near, s.high[2] > high[2] - glue - near) for s in cavities]
    closed = [(shell, end) for shell, end in zip(cavities, ends, strict=True) if any(end)]
    points = np.array([[*(0.5 * (low + high))[:2], low[2] + share * (high[2] - low[2])] for share in MIDDLE])
    ends_of_axis = np.array([[*points[0, :2], low[2] + glue], [*points[0, :2], high[2] - glue]])
    outside = winding_number(turned.vertices[turned.triangles], ends_of_axis) < 0.5
    is_chamber = [all(end) or _holds(shell, points) for shell, end in closed]
    return Sealing(
        openings,
        bool(outside.all()),
        tuple(-shell.volume for (shell, _), yes in zip(closed, is_chamber, strict=True) if yes),
        any(all(end) for _, end in closed),
        tuple(-shell.volume for (shell, _), yes in zip(closed, is_chamber, strict=True) if not yes),
    )


def leak(voxels: Voxels, axis: Axis) -> Leak | None:
    """The widest leak between plates on both ends; None if it is too narrow for the voxels.

    Args:
        voxels: of the part.
        axis: along which the end faces lie opposite.
    """
    solid = np.moveaxis(voxels.solid, "xyz".index(axis), 0)
    plates = np.zeros_like(solid)
    plates[[0, -1]] = True
    open_ends = np.zeros_like(solid)
    for end in (1, -2):
        open_ends[end] = ndimage.binary_fill_holes(solid[end]) & ~solid[end]
    necks = Necks(solid, plates)
    starts = np.flatnonzero(open_ends & necks.reached)
    if not len(starts):
        return None
    # Of the widest ways one that starts in the open, so that it meets the neck and not the wall beside its start.
    widest = int(starts[np.lexsort((necks.clearance.flat[starts], necks.way_out.flat[starts]))[-1]])
    place = necks.place(widest)
    index = np.insert(place[1:], "xyz".index(axis), place[0])
    return Leak(necks.width(widest) * voxels.pitch, voxels.position(index))


def _along_z(surface: Surface, axis: Axis) -> Surface:
    """The part turned so that its axis is the third; a cyclic exchange of coordinates keeps the orientation."""
    return Surface(np.roll(surface.vertices, 2 - "xyz".index(axis), axis=1), surface.triangles)


def _holes(part: Manifold, height: float) -> float:
    """Area of the holes in a section, mm²."""
    outlines = [np.asarray(outline) for outline in part.slice(height).to_polygons()]
    areas = [0.5 * float(np.sum(p[:, 0] * np.roll(p[:, 1], -1) - p[:, 1] * np.roll(p[:, 0], -1))) for p in outlines]
    return -sum(area for area in areas if area < 0.0)


def _holds(shell: Shell, points: Floats) -> bool:
    corners = shell.surface.vertices[shell.surface.triangles]
    return bool(np.any(winding_number(corners, points) < -0.5))
