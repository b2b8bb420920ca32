"""Figures of an optimised design as the paper has them, to files or to bytes.

All but the views are drawn by matplotlib and can be vector graphics, with pixels inside for shaded solids and fields;
the views need VTK.
"""

from __future__ import annotations

import io
import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from actuator.arrays import Floats
from actuator.failure import Failure
from pipeline.figures.arm import arm_figure
from pipeline.figures.initial import initial_figure
from pipeline.figures.offscreen import drawn_apart, with_fewer_colours
from pipeline.figures.response import pressure_displacement
from pipeline.results.design import Design
from pipeline.results.simulation import read_simulation
from pipeline.store.atomic import write_bytes
from pipeline.store.tables import as_csv
from stages.datasets import vtk_order
from stages.design import HISTORY

# Fonts that matplotlib looks for and that no figure uses are nothing to tell a user about.
logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)

#: Pieces per side that a facet of the section is drawn in.
PIECES = 6
MESH, OUTLINE = "#b9c2cc", "#3a3f45"


class NoPicture(Exception):
    """Why a figure cannot be drawn, in a sentence."""


@dataclass(frozen=True)
class Drawing:
    """A figure as the bytes of a file.

    Attributes:
        kind: what it shows, a key of :data:`FIGURES` or ``views`` or ``pressure``.
        format: ``png`` or ``svg``.
        data: the bytes.
    """

    kind: str
    format: str
    data: bytes


def plot_design(
    design: Design, folder: Path, format: str = "png", simulation: Path | None = None
) -> tuple[list[Path], list[str]]:
    """Draw all figures of a design, and write its history as a table.

    Args:
        design: the design.
        folder: where the figures go; their names begin with the case's.
        format: ``png`` or ``svg`` for all but the views, which are always PNG.
        simulation: artifact of ``poro simulate``, if there is one.

    Returns:
        The files, and a sentence for each figure that could not be drawn.

    Raises:
        Fault: if the simulation is unreadable (ARTIFACT).
        OSError: if the folder or the disk does not take a figure.
    """
    table = folder / f"{design.name}-history.csv"
    write_bytes(table, history_table(design).encode())
    files, problems = [table], []
    for kind in (*FIGURES, *(["pressure"] if simulation else []), "views"):
        path = folder / f"{design.name}-{kind}.{'png' if kind == 'views' else format}"
        try:
            write_bytes(path, draw(design, kind, format, simulation).data)
            files.append(path)
        except (Failure, NoPicture) as failure:
            problems.append(f"{path}: not drawn: {failure}")
    return files, problems


def draw(design: Design, kind: str, format: str = "png", simulation: Path | None = None) -> Drawing:
    """Draw one figure.

    Args:
        design: the design.
        kind: a key of :data:`FIGURES`, ``views``, or ``pressure``.
        format: ``png`` or ``svg``; views are always PNG.
        simulation: artifact of ``poro simulate``, for ``pressure``.

    Raises:
        NoPicture: if it needs VTK and VTK cannot draw here.
        actuator.failure.Failure: if there is no solid to draw.
        Fault: if the simulation is unreadable (ARTIFACT).
    """
    if kind == "views":
        drawn = drawn_apart("pipeline.figures.views", _corners(design))
        if drawn is None:
            raise NoPicture("VTK cannot draw on this machine; an OpenGL library such as Mesa may be missing.")
        return Drawing(kind, "png", with_fewer_colours(drawn))
    if kind == "pressure":
        assert simulation is not None
        return _printed(kind, path_figure(simulation), format)
    return _printed(kind, FIGURES[kind](design), format)


def _printed(kind: str, figure: Figure, format: str) -> Drawing:
    canvas: Any = (FigureCanvasSVG if format == "svg" else FigureCanvasAgg)(figure)
    written = io.BytesIO()
    # Without a date and with names that are not drawn by lot, the same design gives the same bytes.
    with rc_context({"svg.hashsalt": kind}):
        canvas.print_figure(written, format=format, metadata={"Date": None} if format == "svg" else None)
    data = written.getvalue()
    return Drawing(kind, format, with_fewer_colours(data) if format == "png" else data)


def path_figure(simulation: Path) -> Figure:
    """Pressure against displacement, from the artifact of ``poro simulate``.

    Raises:
        Fault: if it is unreadable (ARTIFACT).
    """
    return pressure_displacement(read_simulation(simulation))


def history_table(design: Design) -> str:
    """All columns of the history as CSV, with their units in the first line."""
    units = HISTORY
    names = sorted(design.history, key=[*units, *design.history].index)
    rows = zip(*(design.history[name] for name in names), strict=True)
    heading = (f"{name} [{units.get(name, '1')}]" for name in names)
    return as_csv(heading, ([f"{value:.10g}" for value in row] for row in rows))


def history(design: Design) -> Figure:
    """C and C0, and the other terms, against the number of the design update."""
    columns = design.history
    figure = Figure(figsize=(10.0, 4.2), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(columns["update"], columns["C"], color="#1f4e79", label="C")
    left.plot(columns["update"], columns["C0"], color="#c55a11", label="C0")
    low, high = columns["C0"].min(), max(0.02, float(columns["C0"].max()))
    left.set(xlabel="design update", ylabel="objective", ylim=(1.1 * low if low < 0.0 else low, high))
    for name in ("C_A", "C_i", "C_psi", "C_p"):
        right.plot(columns["update"], np.where(columns[name] > 0.0, columns[name], np.nan), label=name)
    right.set(xlabel="design update", ylabel="terms", yscale="log", ylim=(1e-6, 1e-1))
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)
    return figure


def section(design: Design) -> Figure:
    """The symmetry plane X2 = 0: the solid with the mesh, undeformed and deformed, coloured by p / p_in."""
    points, chi, pressure, displacement = _pieces(design)
    n = PIECES + 1
    corner = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]))
    local = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    first = n * n * np.arange(len(points) // (n * n))[:, None]
    triangles = (local + first[..., None]).reshape(-1, 3)
    outlines = first + corner[[0, -1, -1, 0], [0, 0, -1, -1]]
    figure = Figure(figsize=(10.0, 5.2), dpi=110, layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, title, moved in zip(panels, ("undeformed", "deformed"), (points, points + displacement), strict=True):
        mesh = Triangulation(moved[:, 0], moved[:, 1], triangles)
        image = axes.tripcolor(mesh, np.clip(pressure, 0.0, 1.0), shading="gouraud", cmap="viridis", vmin=0.0, vmax=1.0)
        solid = axes.tricontourf(mesh, chi, levels=[0.0, np.inf], colors="none")
        image.set_rasterized(True)  # as vectors it would take 100 MB
        image.set_clip_path(solid.get_paths()[0], axes.transData)
        axes.tricontour(mesh, chi, levels=[0.0], colors=OUTLINE, linewidths=0.8)
        frames = PolyCollection(list(moved[outlines]), facecolors="none", edgecolors=MESH, linewidths=0.25)
        if title == "deformed":  # the bent mesh of the void only confuses
            frames.set_clip_path(solid.get_paths()[0], axes.transData)
        axes.add_collection(frames)
        axes.set(aspect="equal", title=title, xlabel="x1 [mm]")
        axes.autoscale_view()
    panels[0].set_ylabel("x3 [mm]")
    figure.colorbar(image, ax=panels, label="p / p_in", shrink=0.8)
    return figure


def _pieces(design: Design) -> tuple[Floats, Floats, Floats, Floats]:
    """Points (n, 2), χ, p/p_in and displacements (n, 2) of all facets in the plane, each cut into a square grid."""
    mesh = design.domain.mesh
    facets = mesh.facets[:, (mesh.p[1, mesh.facets] == 0.0).all(axis=0)].T  # (n_facets, 4)
    if not len(facets):
        raise NoPicture("no facet of the mesh lies in the plane X2 = 0")
    corners = mesh.p[[0, 2]][:, facets].transpose(1, 2, 0)
    middle = corners.mean(axis=1, keepdims=True)
    around = np.argsort(np.arctan2(*np.moveaxis(corners - middle, 2, 0)[::-1]), axis=1)
    facets = np.take_along_axis(facets, around, axis=1)
    t, s = np.meshgrid(np.linspace(0.0, 1.0, PIECES + 1), np.linspace(0.0, 1.0, PIECES + 1), indexing="ij")
    weights = np.stack([(1 - t) * (1 - s), t * (1 - s), t * s, (1 - t) * s], axis=-1).reshape(-1, 4)

    def fine(values: Floats) -> Floats:
        found = np.einsum("qa,fa...->fq...", weights, values[facets])
        return found.reshape(-1, *values.shape[1:])

    points, displacement = mesh.p[[0, 2]].T, design.displacement[:, [0, 2]]
    return fine(points), fine(design.chi), fine(design.pressure), fine(displacement)


def _corners(design: Design) -> dict[str, NDArray[np.generic]]:
    """What the views are drawn from."""
    return {
        "points": design.domain.points,
        "cells": design.domain.cells[:, vtk_order()[:8]],
        "chi": design.chi,
        "pressure": design.pressure,
        "displacement": design.displacement,
        "mirrored": np.array(design.domain.mirrored),
    }


#: What matplotlib draws of a design, by kind.
FIGURES: dict[str, Callable[[Design], Figure]] = {
    "initial": initial_figure,
    "history": history,
    "section": section,
    "arm": arm_figure,
}
