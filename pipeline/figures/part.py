"""The figure of the part: whole, and cut open at X2 = 0."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from matplotlib.figure import Figure

from actuator.arrays import Floats, Ints
from actuator.geometry.solid import manifold_of
from actuator.geometry.zero_set import Surface
from pipeline.figures.offscreen import ABOVE, Shot, piece
from pipeline.figures.saving import save
from pipeline.figures.shading import Direction
from pipeline.figures.sheet import Place, draw_shots, padded, sheet
from pipeline.figures.states import opened

#: Directions to the eye: for the whole, and for the half that is cut open.
OUTSIDE: Direction = ABOVE
INSIDE: Direction = (0.35, -1.0, 0.3)


def draw_part(file: Path, target: Path) -> None:
    """Draw the part in a file, STL or 3MF as exported, into a figure of its name.

    Raises:
        OSError: if the part cannot be read, or the folder or the disk does not take the figure.
    """
    solid = trimesh.load_mesh(file)
    save(part(np.array(solid.vertices), np.array(solid.faces), file.name), target)


def part(vertices: Floats, triangles: Ints, title: str = "") -> Figure:
    """A part twice, whole and cut open at X2 = 0.

    Args:
        vertices: (n, 3), mm.
        triangles: (m, 3), closed, counter-clockwise seen from outside.
        title: above the figure, followed by the lengths of the part's sides.
    """
    whole = Surface(vertices, triangles)
    shots = [Shot([piece(whole)], OUTSIDE), Shot(opened(_half(whole)), INSIDE)]
    words = ("from outside", "cut open at X2 = 0")
    places = [Place(padded(shot.extent()), each) for shot, each in zip(shots, words, strict=True)]
    sides = " × ".join(f"{side:.3g}" for side in np.ptp(vertices, axis=0))
    found = sheet(places, ", ".join(filter(None, (title, f"{sides} mm"))))
    draw_shots(found, found.panels, shots)
    return found.figure


def _half(whole: Surface) -> Surface:
    """The half X2 > 0, closed."""
    half = manifold_of(whole).trim_by_plane((0.0, 1.0, 0.0), 0.0).to_mesh64()
    return Surface(np.asarray(half.vert_properties[:, :3]), np.asarray(half.tri_verts, dtype=np.int64))
