"""Figures of an optimised design as the paper has them: histories, section, views.

Histories and section are drawn by matplotlib and can be vector graphics; the views need VTK.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from pipeline.atomic import replacing
from pipeline.design import Design, Floats
from pipeline.offscreen import drawn_apart, reduce_colours
from pipeline.vtkhdf import vtk_order

# Fonts that matplotlib looks for and that no figure uses are nothing to tell a user about.
logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)

#: Pieces per side that a facet of the section is drawn in.
PIECES = 6
MESH, OUTLINE = "#b9c2cc", "#3a3f45"


def plot_design(design: Design, folder: Path, format: str = "png") -> tuple[list[Path], list[str]]:
    """Draw all figures of a design.

    Args:
        design: the design.
        folder: where the figures go; their names begin with the case's.
        format: ``png`` or ``svg`` for histories and section; the views are always PNG.

    Returns:
        The files, and a sentence for each figure that could not be drawn.

    Raises:
        OSError: if the folder or the disk does not take a figure.
    """
    files, problems = [], []
    drawers: tuple[tuple[str, Callable[[Design], Figure]], ...] = (("history", history), ("section", section))
    for kind, draw in drawers:
        path = folder / f"{design.name}-{kind}.{format}"
        figure = draw(design)
        canvas: Any = (FigureCanvasSVG if format == "svg" else FigureCanvasAgg)(figure)
        with replacing(path) as temporary:
            canvas.print_figure(temporary, format=format)
            if format == "png":
                reduce_colours(temporary)
        files.append(path)
    path = folder / f"{design.name}-views.png"
    drawn = drawn_apart("pipeline.views", _corners(design))
    if drawn is None:
        problems.append(
            f"{path}: not drawn, as VTK cannot draw on this machine; an OpenGL library such as Mesa may be missing."
        )
    else:
        with replacing(path) as temporary:
            temporary.write_bytes(drawn)
            reduce_colours(temporary)
        files.append(path)
    return files, problems


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
    facets = mesh.facets[:, mesh.boundary_facets()]
    facets = facets[:, (mesh.p[1, facets] == 0.0).all(axis=0)].T  # (n_facets, 4)
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
    }
