"""The initial design of Appendix C in the design domain: as a solid, and its sections across and along the axis."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path
from scipy.special import expit

from actuator.arrays import Floats
from pipeline.figures.offscreen import ABOVE, CannotDraw, Piece, Scale, Shot, piece
from pipeline.figures.shading import projection
from pipeline.figures.sheet import Place, directions, padded, sheet, show
from pipeline.figures.states import opened, solid_of, surface_of
from pipeline.results.design import OptimisedDesign
from stages.chambers import posed

EDGE, DOMAIN, SOURCE = "#2f7fc1", "#3a3f45", "#c00000"
DENSITY = Scale("Greys", 1.0, "density ρ")
#: Points across a section.
FINE = 401
#: Turn of the outline at a point from which an edge of the domain runs along X1, as its cosine.
SHARP = np.cos(np.radians(30.0))


def initial(design: OptimisedDesign) -> Figure:
    """The initial solid in the domain, half of it if half is modelled; sections across the axis and in X2 = 0.

    Raises:
        CannotDraw: if the case does not begin with the domain's own design.
    """
    if not design.case.initial.own:
        raise CannotDraw("The case begins with a wall or a file of its own (section 'initial').")
    domain = design.domain
    rings = [domain.outline()]
    if domain.mirrored:
        rings.append(rings[0] * (-1.0, 1.0))
    (left, low), (right, high) = (function(np.concatenate(rings), axis=0) for function in (np.min, np.max))
    around = np.concatenate([_end(design, 0.0), _end(design, domain.length)]) @ projection(ABOVE)[:2].T
    places = [
        Place(
            padded(np.array([*around.min(axis=0), *around.max(axis=0)])[[0, 2, 1, 3]]), "initial solid in the domain"
        ),
        Place(padded(np.array([left, right, low, high])), "section across the axis", ("X2 [mm]", "X3 [mm]")),
        Place(padded(np.array([0.0, domain.length, low, high])), "plane X2 = 0", ("X1 [mm]", "X3 [mm]")),
    ]
    found = sheet(places, design.name, bar=True)
    solid, across, along = found.panels
    directions(solid, ABOVE)
    show([solid], [Shot(_solid(design), ABOVE)], [None])  # simple enough to do without VTK
    _frame(solid, design)
    x2, x3 = np.meshgrid(np.linspace(left, right, FINE), np.linspace(low, high, FINE))
    middle = np.stack([np.full_like(x2, 0.5 * domain.length), x2, x3], axis=-1)
    inside = np.any([Path(ring).contains_points(middle[..., 1:].reshape(-1, 2), radius=1e-9) for ring in rings], axis=0)
    image = _density(across, design, (x2, x3), middle, inside.reshape(x2.shape))
    outline = Path.make_compound_path(*(Path(ring, closed=False) for ring in rings))
    frame = PathPatch(outline, fill=False, edgecolor=DOMAIN, linewidth=1.0)
    across.add_patch(frame)
    image.set_clip_path(frame)
    if domain.mirrored:
        across.axvline(0.0, color=DOMAIN, linewidth=0.7, linestyle=":")
    x1, x3 = np.meshgrid(np.linspace(0.0, domain.length, FINE), np.linspace(low, high, FINE))
    _density(along, design, (x1, x3), np.stack([x1, 0.0 * x1, x3], axis=-1))
    along.add_patch(Rectangle((0.0, low), domain.length, high - low, fill=False, edgecolor=DOMAIN, linewidth=1.0))
    found.colour_bar(DENSITY)
    return found.figure


def _density(
    axes: Axes, design: OptimisedDesign, plane: tuple[Floats, Floats], places: Floats, inside: Any = True
) -> Any:
    """Density, outline of the solid and source of Eq. (18) where it has at least half its strength, in a plane.

    Args:
        axes: to draw on.
        design: whose initial design it is.
        plane: coordinates in the plane, (n, m) each.
        places: the same points in the domain, (n, m, 3), or their mirror images.
        inside: which of them lie in the domain, (n, m).
    """
    domain, (_, _, limits) = posed(design.case.optimize), design.case.optimize.parameters()
    if domain.mirrored:
        places = np.stack([places[..., 0], np.abs(places[..., 1]), places[..., 2]], axis=-1)
    chi = domain.initial_design(places, limits.interface_width, limits.length_unit)
    image = axes.pcolormesh(
        *plane, expit(chi), cmap=DENSITY.colours, vmin=0.0, vmax=1.0, shading="gouraud", rasterized=True
    )
    axes.contour(*plane, np.where(inside, chi, np.nan), levels=[0.0], colors=EDGE, linewidths=1.4)
    for strength in domain.profiles(places):
        fed = strength >= 0.5
        if fed.any():  # not every chamber lies in the plane X2 = 0
            axes.contourf(*plane, strength, levels=[0.5, 2.0], colors=SOURCE, alpha=0.25)
            axes.text(plane[0][fed].mean(), plane[1][fed].mean(), "source", color=SOURCE, ha="center", va="center")
    return image


def _solid(design: OptimisedDesign) -> list[Piece]:
    domain, (_, _, limits) = posed(design.case.optimize), design.case.optimize.parameters()
    chi = domain.initial_design(domain.points, limits.interface_width, limits.length_unit)
    if not (chi > 0.0).any():
        return []  # the sections show why
    surface, _ = surface_of(solid_of(domain, chi))
    return opened(surface) if domain.mirrored else [piece(surface)]


def _end(design: OptimisedDesign, x1: float) -> Floats:
    """The outline of the domain at one end, closed, (n, 3)."""
    ring = design.domain.outline()
    closed = np.concatenate([ring, ring[:1]])
    return np.column_stack([np.full(len(closed), x1), closed])


def _frame(axes: Axes, design: OptimisedDesign) -> None:
    """The edges of the domain, those behind the solid too."""
    rows, ring, length = projection(ABOVE)[:2], design.domain.outline(), design.domain.length
    for x1, order in ((0.0, 0.2), (length, 3)):
        axes.plot(*(rows @ _end(design, x1).T), color=DOMAIN, linewidth=0.9, zorder=order)
    sides = np.roll(ring, -1, axis=0) - ring
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    for corner in ring[(sides * np.roll(sides, 1, axis=0)).sum(axis=1) < SHARP]:
        edge = np.array([[0.0, *corner], [length, *corner]])
        axes.plot(*(rows @ edge.T), color=DOMAIN, linewidth=0.9, zorder=3)
