"""Solids drawn by matplotlib: parallel projection, the far triangles first, shaded smoothly but for sharp edges.

For figures that need words and lines around the solid, which stay vectors in an SVG; the solid itself is pixels there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.tri import Triangulation

from actuator.arrays import Floats
from actuator.geometry.creases import parted_at_creases, triangle_normals, vertex_normals
from actuator.geometry.zero_set import Surface

#: Share of the light that reaches every side.
AMBIENT = 0.4
#: To the light: to the right, up and to the eye.
LIGHT = np.array([0.3, 0.5, 1.0])


def projection(direction: tuple[float, float, float]) -> Floats:
    """Rows to the right, up and to the eye, (3, 3), for an eye in a direction and X3 upwards."""
    eye = np.array(direction) / np.linalg.norm(direction)
    right = np.cross((0.0, 0.0, 1.0), eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def paint(axes: Axes, surface: Surface, direction: tuple[float, float, float], colour: str, zorder: float = 1.0) -> Any:
    """Draw a surface, seen from a direction, in the projection's millimetres.

    Args:
        axes: to draw on.
        surface: oriented; triangles that face away are left out.
        direction: to the eye.
        colour: where light falls straight on it.
        zorder: place among the other things drawn.
    """
    rows = projection(direction)
    origin, triangles = parted_at_creases(surface)
    vertices = surface.vertices[origin]
    light = rows.T @ LIGHT / np.linalg.norm(LIGHT)
    shade = AMBIENT + (1.0 - AMBIENT) * np.clip(vertex_normals(vertices, triangles) @ light, 0.0, 1.0)
    seen = triangles[triangle_normals(vertices, triangles) @ rows[2] > 0.0]
    place = vertices @ rows.T
    seen = seen[np.argsort(place[seen, 2].sum(axis=1))]
    colours = LinearSegmentedColormap.from_list("shades", [(0.0, "black"), (1.0, colour)])
    # A triangulation wants each point used; unused ones are left out.
    used, seen = np.unique(seen, return_inverse=True)
    mesh = Triangulation(place[used, 0], place[used, 1], seen.reshape(-1, 3))
    drawn = axes.tripcolor(mesh, shade[used], shading="gouraud", cmap=colours, vmin=0.0, vmax=1.0)
    drawn.set_zorder(zorder)
    drawn.set_rasterized(True)
    return drawn
