"""A part under pressure: whole and cut open at X2 = 0, coloured by its strain."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure

from pipeline.figures.offscreen import Scale, Shot
from pipeline.figures.part import INSIDE, OUTSIDE
from pipeline.figures.sheet import Place, draw_shots, padded, sheet
from pipeline.figures.states import cut_open, whole
from pipeline.results.inflation import Inflated

#: Blue below the limit of the strain, red above it; the bar ends at twice the limit.
COLOURS, END = "RdYlBu_r", 2.0


def strain_scale(limit: float) -> Scale:
    """Colours of a strain with a limit."""
    return Scale(COLOURS, END * limit, f"strain, limit {limit:g}")


def grid_of(state: Inflated) -> Any:
    """The mesh of a state for VTK, with ``strain`` and ``displacement``."""
    import pyvista  # slow to load: only where a solid is drawn

    grid = pyvista.UnstructuredGrid({pyvista.CellType.QUADRATIC_TETRA: state.cells}, state.points)
    grid.point_data["strain"], grid.point_data["displacement"] = state.strain, state.displacement
    return grid


def inflated(state: Inflated, title: str = "") -> Figure:
    """Draw a state of a part.

    Args:
        state: what is drawn.
        title: above the figure, such as the name of the part.
    """
    grid, scale = grid_of(state), strain_scale(state.limit)
    shots = [
        Shot(whole(grid, state.half, "strain", scale), OUTSIDE),
        Shot(cut_open(grid, state.half, "strain", scale), INSIDE),
    ]
    words = ("under pressure", "cut open at X2 = 0")
    places = [Place(padded(shot.extent()), each) for shot, each in zip(shots, words, strict=True)]
    found = sheet(places, title, bar=True)
    draw_shots(found, found.panels, shots)
    found.colour_bar(scale)
    return found.figure
