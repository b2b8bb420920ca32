"""The symmetry plane of a design, undeformed and deformed, with mesh and pressure, that of the air too."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation

from actuator.arrays import Floats
from pipeline.figures.offscreen import CannotDraw
from pipeline.figures.sheet import Place, padded, sheet
from pipeline.figures.views import PRESSURE
from pipeline.results.design import OptimisedDesign

#: Pieces per side that a facet of the section is drawn in.
PIECES = 6
MESH, OUTLINE = "#b9c2cc", "#3a3f45"
#: Void of at least this p / p_in is drawn too: the air in the chamber, whose pressure is 1 but near the walls, and what
#: leaks. Beside a tight part there is less than a thousandth.
AIR = 0.01
#: Room around the section over its extent.
ROOM = 0.04


def section(design: OptimisedDesign) -> Figure:
    """The plane X2 = 0: solid and air under pressure, coloured by p / p_in, with the mesh, undeformed and deformed."""
    points, chi, pressure, displacement = _pieces(design)
    n = PIECES + 1
    corner = np.arange(n * n).reshape(n, n)
    a, b, c, d = (part.ravel() for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]))
    local = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    first = n * n * np.arange(len(points) // (n * n))[:, None]
    triangles = (local + first[..., None]).reshape(-1, 3)
    outlines = first + corner[[0, -1, -1, 0], [0, 0, -1, -1]]
    states = {"undeformed": points, "deformed": points + displacement}
    axes_of = {"undeformed": ("X1 [mm]", "X3 [mm]"), "deformed": ("x1 [mm]", "x3 [mm]")}
    # Of the void that moves, only the air in the chamber is drawn.
    drawn = {"undeformed": points, "deformed": states["deformed"][(chi > 0.0) | (pressure > AIR)]}
    places = [
        Place(padded(np.array([*found.min(axis=0), *found.max(axis=0)])[[0, 2, 1, 3]], ROOM), title, axes_of[title])
        for title, found in drawn.items()
    ]
    found = sheet(places, design.name, bar=True)
    for axes, (title, moved) in zip(found.panels, states.items(), strict=True):
        mesh = Triangulation(moved[:, 0], moved[:, 1], triangles)
        for values, least in ((pressure, AIR), (chi, 0.0)):
            image = axes.tripcolor(
                mesh, np.clip(pressure, 0.0, 1.0), shading="gouraud", cmap=PRESSURE.colours, vmin=0.0, vmax=1.0
            )
            image.set_rasterized(True)  # as vectors it would take 100 MB
            there = axes.tricontourf(mesh, values, levels=[least, np.inf], colors="none")
            image.set_clip_path(there.get_paths()[0], axes.transData)
        axes.tricontour(mesh, chi, levels=[0.0], colors=OUTLINE, linewidths=0.8)
        frames = PolyCollection(list(moved[outlines]), facecolors="none", edgecolors=MESH, linewidths=0.25)
        if title == "deformed":  # the bent mesh of the void only confuses
            frames.set_clip_path(there.get_paths()[0], axes.transData)
        axes.add_collection(frames)
    found.colour_bar(PRESSURE)
    return found.figure


def _pieces(design: OptimisedDesign) -> tuple[Floats, Floats, Floats, Floats]:
    """Points (n, 2), χ, p/p_in and displacements (n, 2) of all facets in the plane, each cut into a square grid."""
    mesh = design.domain.mesh
    facets = mesh.facets[:, (mesh.p[1, mesh.facets] == 0.0).all(axis=0)].T  # (n_facets, 4)
    if not len(facets):
        raise CannotDraw("no facet of the mesh lies in the plane X2 = 0")
    corners = mesh.p[[0, 2]][:, facets].transpose(1, 2, 0)
    middle = corners.mean(axis=1, keepdims=True)
    around = np.argsort(np.arctan2(*np.moveaxis(corners - middle, 2, 0)[::-1]), axis=1)
    facets = np.take_along_axis(facets, around, axis=1)
    t, s = np.meshgrid(np.linspace(0.0, 1.0, PIECES + 1), np.linspace(0.0, 1.0, PIECES + 1), indexing="ij")
    weights = np.stack([(1 - t) * (1 - s), t * (1 - s), t * s, (1 - t) * s], axis=-1).reshape(-1, 4)

    def fine(values: Floats) -> Floats:
        found = np.einsum("qa,fa...->fq...", weights, values[facets])
        return found.reshape(-1, *values.shape[1:])

    points, displacement = mesh.p[[0, 2]].T, design.vertex_displacement[:, [0, 2]]
    return fine(points), fine(design.chi), fine(design.relative_pressure), fine(displacement)
