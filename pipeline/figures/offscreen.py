"""Solids as pixels, by VTK in a process of its own: without any OpenGL library it does not fail but crash.

Every picture is a parallel projection of known millimetres, around which matplotlib then sets axes, bars and words.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator.arrays import Floats, Ints
from actuator.geometry.zero_set import Surface
from pipeline.figures.shading import Direction, projection, split_at_sharp_edges, vertex_normals

#: What all figures of solids share: colours, and the direction to the eye that shows one from above.
BODY, PAPER = "#7fa7c9", "#ffffff"
ABOVE: Direction = (1.0, -1.3, 0.75)
LONGEST_DRAWING = 120.0  # s; a driver that hangs must not hang the pipeline

Pixels = NDArray[np.uint8]


class CannotDraw(Exception):
    """Why a figure cannot be drawn, in a sentence."""


@dataclass(frozen=True)
class Scale:
    """What the colours of a field mean.

    Attributes:
        colours: name of matplotlib's map.
        high: value of its last colour; the first is zero.
        label: beside the bar.
    """

    colours: str
    high: float
    label: str


@dataclass(frozen=True)
class Piece:
    """A surface as it is drawn: split at its sharp edges.

    Attributes:
        vertices: (n, 3), mm.
        normals: to the outside, (n, 3).
        triangles: (m, 3), counter-clockwise seen from outside.
        colour: of all of it, where there are no values.
        values: of a field, (n,).
        scale: what they mean.
        lit: whether it is shaded; a cut face is not.
    """

    vertices: Floats
    normals: Floats
    triangles: Ints
    colour: str = BODY
    values: Floats | None = None
    scale: Scale | None = None
    lit: bool = True


@dataclass(frozen=True)
class Shot:
    """Pieces seen from a direction.

    Attributes:
        pieces: what is there.
        direction: to the eye.
        up: what is up in the picture.
    """

    pieces: Sequence[Piece]
    direction: Direction
    up: Direction = (0.0, 0.0, 1.0)

    def extent(self) -> Floats:
        """Left, right, bottom and top of what is drawn, in the projection's mm, (4,)."""
        place = np.concatenate([piece.vertices for piece in self.pieces]) @ projection(self.direction, self.up)[:2].T
        (left, bottom), (right, top) = place.min(axis=0), place.max(axis=0)
        return np.array([left, right, bottom, top])


def piece(
    surface: Surface, colour: str = BODY, values: Floats | None = None, scale: Scale | None = None, *, lit: bool = True
) -> Piece:
    """A surface to be drawn in one colour, or by values at its vertices, (n_vertices,)."""
    origin, triangles = split_at_sharp_edges(surface)
    vertices = surface.vertices[origin]
    found = None if values is None else values[origin]
    return Piece(vertices, vertex_normals(vertices, triangles), triangles, colour, found, scale, lit)


def pictures(shots: Sequence[Shot], extents: Sequence[Floats], pixels_per_mm: float) -> list[Pixels]:
    """Have VTK draw shots on nothing.

    Args:
        shots: what is seen.
        extents: left, right, bottom and top of each picture, in the projection's mm.
        pixels_per_mm: of all of them.

    Returns:
        Pictures, (height, width, 4) each, transparent where there is nothing.

    Raises:
        CannotDraw: if VTK ended badly.
    """
    arrays: dict[str, NDArray[Any]] = {}
    plan = []
    for shot, extent in zip(shots, extents, strict=True):
        found = []
        for each in shot.pieces:
            name = str(len(arrays))
            arrays |= {f"{name} vertices": each.vertices, f"{name} normals": each.normals}
            arrays[f"{name} triangles"] = each.triangles
            look: dict[str, Any] = {"name": name, "colour": each.colour, "lit": each.lit}
            if each.values is not None and each.scale is not None:
                arrays[f"{name} values"] = each.values
                look |= {"colours": each.scale.colours, "high": each.scale.high}
            found.append(look)
        rows = projection(shot.direction, shot.up)
        size = np.maximum(np.round(np.diff(extent)[::2] * pixels_per_mm), 1).astype(int).tolist()
        plan.append({"pieces": found, "rows": rows.tolist(), "extent": extent.tolist(), "size": size})
    with tempfile.TemporaryDirectory() as folder:
        given, drawn = Path(folder) / "given.npz", Path(folder) / "drawn.npz"
        np.savez(given, allow_pickle=False, plan=np.array(json.dumps(plan)), **arrays)
        command = [sys.executable, "-P", "-m", "pipeline.figures.rendering", str(given), str(drawn)]
        try:
            subprocess.run(command, capture_output=True, timeout=LONGEST_DRAWING, check=True)
            with np.load(drawn, allow_pickle=False) as found_pictures:
                return [found_pictures[str(number)] for number in range(len(shots))]
        except (OSError, subprocess.SubprocessError):
            sentence = "VTK cannot draw on this machine; an OpenGL library such as Mesa may be missing."
            raise CannotDraw(sentence) from None
