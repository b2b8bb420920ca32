"""Solids drawn by matplotlib: parallel projection, the far triangles first, shaded smoothly but for sharp edges.

For figures that need words and lines around the solid, which stay vectors in an SVG; the solid itself is pixels there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.tri import Triangulation

from actuator.arrays import Floats, Ints
from actuator.geometry.normals import triangle_normals
from actuator.geometry.zero_set import Surface

#: Edges between triangles whose normals differ by more are sharp, degrees.
SHARP = 35.0
#: Share of the light that reaches every side.
AMBIENT = 0.4
#: To the light: to the right, up and to the eye.
LIGHT = np.array([0.3, 0.5, 1.0])
Direction = tuple[float, float, float]


def split_at_sharp_edges(surface: Surface, sharp: float = SHARP) -> tuple[Ints, Ints]:
    """One vertex for each side of a sharp edge, so that shading is smooth elsewhere and only there; by VTK.

    Args:
        surface: oriented triangles.
        sharp: least angle between the normals of two triangles at a sharp edge, degrees.

    Returns:
        The vertex of the surface that each new vertex lies at, (k,), and the triangles on new vertices, (m, 3).
    """
    import pyvista  # slow to load: only where a solid is drawn

    split = pyvista.PolyData.from_regular_faces(surface.vertices, surface.triangles).compute_normals(
        cell_normals=False,
        split_vertices=True,
        feature_angle=sharp,
        consistent_normals=False,
        non_manifold_traversal=False,
    )
    origin, triangles = split["pyvistaOriginalPointIds"], split.regular_faces
    return np.asarray(origin, dtype=np.int64), np.asarray(triangles, dtype=np.int64)


def vertex_normals(vertices: Floats, triangles: Ints) -> Floats:
    """Unit normals at the vertices, (n, 3): the mean of their triangles' by area.

    VTK's are means without weights, in which the slivers of a cut mesh show as spots.
    """
    normals, summed = triangle_normals(vertices[triangles]), np.zeros_like(vertices)
    for corner in range(3):
        np.add.at(summed, triangles[:, corner], normals)
    return summed / np.maximum(np.linalg.norm(summed, axis=1, keepdims=True), np.finfo(float).tiny)


def projection(direction: Direction, up: Direction = (0.0, 0.0, 1.0)) -> Floats:
    """Rows to the right, up and to the eye, (3, 3), for an eye in a direction and X3, or another one, upwards."""
    eye = np.array(direction) / np.linalg.norm(direction)
    right = np.cross(up, eye)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(eye, right), eye])


def draw_solid(axes: Axes, surface: Surface, direction: Direction, colour: str, zorder: float = 1.0) -> Any:
    """Draw a surface, seen from a direction, in the projection's millimetres.

    Args:
        axes: to draw on.
        surface: oriented; triangles that face away are left out.
        direction: to the eye.
        colour: where light falls straight on it.
        zorder: place among the other things drawn.
    """
    rows = projection(direction)
    origin, triangles = split_at_sharp_edges(surface)
    vertices = surface.vertices[origin]
    light = rows.T @ LIGHT / np.linalg.norm(LIGHT)
    shade = AMBIENT + (1.0 - AMBIENT) * np.clip(vertex_normals(vertices, triangles) @ light, 0.0, 1.0)
    seen = triangles[triangle_normals(vertices[triangles]) @ rows[2] > 0.0]
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
