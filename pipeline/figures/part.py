"""The figure of the part: VTK draws it where it can, and else matplotlib a plainer one."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from matplotlib.figure import Figure

from actuator.arrays import Floats, Ints
from actuator.geometry.normals import triangle_normals
from actuator.geometry.solid import manifold_of
from actuator.geometry.zero_set import Surface
from pipeline.figures.offscreen import ABOVE, BODY, PAPER, CannotDraw, drawn_apart
from pipeline.figures.saving import Drawn, save

SIZE = (1400, 700)
CUT = "#e8a33d"
#: Directions to the eye: for the whole, and for the half that is cut open.
OUTSIDE, INSIDE = ABOVE, (0.35, -1.0, 0.3)
#: Shading that keeps edges sharper than this angle, degrees.
SMOOTH: dict[str, Any] = {"smooth_shading": True, "split_sharp_edges": True, "feature_angle": 35.0}


def draw_part(file: Path, target: Path) -> None:
    """Draw the part in a file, STL or 3MF as exported, into a PNG.

    Raises:
        OSError: if the part cannot be read, or the folder or the disk does not take the figure.
    """
    solid = trimesh.load_mesh(file)
    save(part(np.array(solid.vertices), np.array(solid.faces)), target)


def part(vertices: Floats, triangles: Ints) -> Drawn:
    """A part twice, whole and cut open at X2 = 0.

    Args:
        vertices: (n, 3), mm.
        triangles: (m, 3), closed, counter-clockwise seen from outside.
    """
    try:
        return drawn_apart("pipeline.figures.part", {"vertices": vertices, "triangles": triangles})
    except CannotDraw:
        return _drawn_by_matplotlib(vertices, triangles)


def _draw_with_vtk(vertices: Floats, triangles: Ints, png: Path) -> None:
    import pyvista

    def add(plotter: Any, view: tuple[float, float, float]) -> None:
        for corners, colour in _pieces(vertices, triangles, cut=view is INSIDE):
            piece = pyvista.PolyData.from_regular_faces(
                corners.reshape(-1, 3), np.arange(corners.size // 3).reshape(-1, 3)
            )
            look = {"specular": 0.2, "specular_power": 20, "ambient": 0.2, "lighting": colour != CUT}
            plotter.add_mesh(piece.clean(), color=colour, **SMOOTH, **look)

    two_views(png, add, zoom=1.05)


def two_views(png: Path, add: Callable[[Any, tuple[float, float, float]], None], zoom: float) -> None:
    """Draw a part from outside and from within, side by side; ``add`` puts into a plotter what one view shows."""
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2), border=False, window_size=list(SIZE))
    for column, view in enumerate((OUTSIDE, INSIDE)):
        plotter.subplot(0, column)
        plotter.set_background(PAPER)
        add(plotter, view)
        plotter.enable_parallel_projection()
        plotter.view_vector(view, (0.0, 0.0, 1.0))
        plotter.add_axes(xlabel="X1", ylabel="X2", zlabel="X3", color="black")
        plotter.camera.zoom(zoom)
    plotter.enable_anti_aliasing("ssaa", all_renderers=True)
    plotter.screenshot(png)


def _drawn_by_matplotlib(vertices: Floats, triangles: Ints) -> Figure:
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    low, high = vertices.min(axis=0), vertices.max(axis=0)
    figure = Figure(figsize=(SIZE[0] / 100, SIZE[1] / 100), dpi=100, facecolor=PAPER)
    for column, view in enumerate((OUTSIDE, INSIDE)):
        axes: Any = figure.add_axes((0.5 * column, 0.0, 0.5, 1.0), projection="3d", proj_type="ortho")
        direction = np.array(view) / np.linalg.norm(view)
        pieces = _pieces(vertices, triangles, cut=view is INSIDE)
        corners = np.concatenate([piece for piece, _ in pieces])
        body = np.concatenate([np.tile(to_rgb(colour), (len(piece), 1)) for piece, colour in pieces])
        normals = triangle_normals(corners)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
        facing = normals @ direction > 0.0  # of a closed surface the rest is hidden
        light = 0.35 + 0.65 * (normals @ direction)[facing, None]
        # Edges in the colour of their triangle close the hairlines between triangles.
        colours = light * body[facing]
        axes.add_collection3d(Poly3DCollection(corners[facing], facecolors=colours, edgecolors=colours, linewidths=0.4))
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(high - low, zoom=1.2)
        azimuth = float(np.degrees(np.arctan2(direction[1], direction[0])))
        axes.view_init(elev=float(np.degrees(np.arcsin(direction[2]))), azim=azimuth)
        axes.set_axis_off()
    return figure


def _pieces(vertices: Floats, triangles: Ints, cut: bool) -> list[tuple[Floats, str]]:
    """Corners (n, 3, 3) of the triangles to be drawn and their colour: all, or the half X2 > 0 and its cut face."""
    if not cut:
        return [(vertices[triangles], BODY)]
    half = manifold_of(Surface(vertices, triangles)).trim_by_plane((0.0, 1.0, 0.0), 0.0).to_mesh64()
    corners = half.vert_properties[:, :3][half.tri_verts]
    on_cut = np.abs(corners[:, :, 1]).max(axis=1) < 1e-6 * np.ptp(vertices)
    return [(corners[~on_cut], BODY), (corners[on_cut], CUT)]


if __name__ == "__main__":
    with np.load(sys.argv[1]) as found:
        _draw_with_vtk(found["vertices"], found["triangles"], Path(sys.argv[2]))
