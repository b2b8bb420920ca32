"""A part under pressure, drawn by VTK: whole and cut open at X2 = 0, coloured by its strain.

Run in a process of its own with the file of the arrays and that of the figure (:mod:`pipeline.figures.offscreen`).
"""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
from PIL import Image

from pipeline.figures.offscreen import drawn_apart
from pipeline.figures.part import INSIDE, OUTSIDE, SMOOTH, two_views
from pipeline.results.inflation import Inflated

#: Blue below the limit of the strain, red above it; the bar ends at twice the limit.
COLOURS, END = "RdYlBu_r", 2.0
BAR = {
    "title": "strain\n",
    "color": "black",
    "vertical": True,
    "position_x": 0.9,
    "position_y": 0.2,
    "height": 0.6,
    "n_labels": 5,
    "fmt": "%.2f",
}


def inflated(state: Inflated) -> Image.Image:
    """Draw a state of a part.

    Raises:
        CannotDraw: if VTK cannot draw on this machine.
    """
    return drawn_apart("pipeline.figures.inflated", {name: np.asarray(value) for name, value in asdict(state).items()})


def _draw(arrays: dict[str, np.ndarray], png: Path) -> None:
    cells = np.column_stack([np.full(len(arrays["cells"]), 10), arrays["cells"]])
    kinds = np.full(len(cells), pyvista.CellType.QUADRATIC_TETRA, dtype=np.uint8)
    grid = pyvista.UnstructuredGrid(cells.ravel(), kinds, arrays["points"])
    for name in ("strain", "displacement"):
        grid.point_data[name] = arrays[name]
    half = bool(arrays["half"])

    def add(plotter: Any, view: tuple[float, float, float]) -> None:
        shown = grid if half or view is OUTSIDE else grid.clip("-y", origin=(0.0, 0.0, 0.0))
        surface = shown.warp_by_vector("displacement").extract_surface(algorithm="dataset_surface")
        mirrored = [surface.reflect((0.0, 1.0, 0.0), point=(0.0, 0.0, 0.0))] if half and view is OUTSIDE else []
        for piece in (surface, *mirrored):
            plotter.add_mesh(
                piece,
                scalars="strain",
                clim=(0.0, END * float(arrays["limit"])),
                cmap=COLOURS,
                **SMOOTH,
                ambient=0.25,
                diffuse=0.8,
                show_scalar_bar=view is INSIDE,
                scalar_bar_args=BAR,
            )

    two_views(png, add, zoom=0.95)


if __name__ == "__main__":
    with np.load(sys.argv[1], allow_pickle=False) as found:
        _draw(dict(found), Path(sys.argv[2]))
