"""Views of a design, drawn by VTK: from the side, from the front, from above, and deformed with its pressure.

Run in a process of its own with the file of the arrays and that of the figure (:mod:`pipeline.figures.offscreen`).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyvista
from PIL import Image

from pipeline.figures.offscreen import ABOVE, BODY, PAPER, drawn_apart
from pipeline.results.design import OptimisedDesign
from stages.datasets import vtk_order

SIZE = (1400, 1000)
ZOOM = 1.3
#: Name, direction to the eye and direction that is up.
VIEWS = (
    ("side", (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    ("front", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    ("top", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
)
BAR = {"title": "p / p_in\n", "color": "black", "vertical": True, "position_x": 0.85, "position_y": 0.2, "height": 0.6}


def views(design: OptimisedDesign) -> Image.Image:
    """Draw a design from three sides, and deformed from above, coloured by p / p_in.

    Raises:
        CannotDraw: if VTK cannot draw on this machine.
    """
    arrays = {
        "points": design.domain.points,
        "cells": design.domain.cells[:, vtk_order()[:8]],
        "chi": design.chi,
        "pressure": design.relative_pressure,
        "displacement": design.vertex_displacement,
        "mirrored": np.array(design.domain.mirrored),
    }
    return drawn_apart("pipeline.figures.views", arrays)


def _draw(arrays: dict[str, np.ndarray], png: Path) -> None:
    cells = np.column_stack([np.full(len(arrays["cells"]), 8), arrays["cells"]])
    kinds = np.full(len(cells), pyvista.CellType.HEXAHEDRON, dtype=np.uint8)
    grid = pyvista.UnstructuredGrid(cells.ravel(), kinds, arrays["points"])
    for name in ("chi", "pressure", "displacement"):
        grid.point_data[name] = arrays[name]
    solid = grid.clip_scalar(scalars="chi", value=0.0, invert=False)
    bent = solid.warp_by_vector("displacement")
    plotter = pyvista.Plotter(off_screen=True, shape=(2, 2), border=False, window_size=list(SIZE))
    for place, (name, direction, up) in enumerate(VIEWS):
        plotter.subplot(*divmod(place, 2))
        for piece in _whole(solid, arrays["mirrored"]):
            plotter.add_mesh(piece, color=BODY, smooth_shading=True, split_sharp_edges=True, ambient=0.2)
        _look(plotter, direction, up, name)
    plotter.subplot(1, 1)
    for piece in _whole(bent, arrays["mirrored"]):
        plotter.add_mesh(
            piece,
            scalars="pressure",
            clim=(0.0, 1.0),
            cmap="viridis",
            smooth_shading=True,
            split_sharp_edges=True,
            ambient=0.2,
            scalar_bar_args=BAR,
        )
    _look(plotter, ABOVE, (0.0, 0.0, 1.0), "deformed")
    plotter.enable_anti_aliasing("ssaa", all_renderers=True)
    plotter.screenshot(png)


def _whole(solid: pyvista.UnstructuredGrid, mirrored: np.ndarray) -> list[pyvista.PolyData]:
    """Surface of what is modelled, and of its mirror image if that is a half."""
    surface = solid.extract_surface(algorithm="dataset_surface")
    return [surface, surface.reflect((0.0, 1.0, 0.0), point=(0.0, 0.0, 0.0))] if mirrored else [surface]


def _look(plotter: pyvista.Plotter, direction: tuple[float, ...], up: tuple[float, ...], name: str) -> None:
    plotter.set_background(PAPER)
    plotter.enable_parallel_projection()
    plotter.view_vector(direction, up)
    plotter.camera.zoom(ZOOM)
    plotter.add_text(name, color="black", font_size=12)
    plotter.add_axes(xlabel="X1", ylabel="X2", zlabel="X3", color="black")


if __name__ == "__main__":
    with np.load(sys.argv[1], allow_pickle=False) as found:
        _draw(dict(found), Path(sys.argv[2]))
