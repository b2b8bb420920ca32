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
from actuator.geometry.outer_triangles import outer_triangles
from actuator.geometry.zero_set import solid_boundary
from pipeline.figures.offscreen import ABOVE, BODY, CannotDraw
from pipeline.figures.shading import draw_solid, projection
from pipeline.results.design import OptimisedDesign

EDGE, DOMAIN, SOURCE = "#2f7fc1", "#3a3f45", "#c00000"
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
    figure = Figure(figsize=(11.0, 4.2), dpi=110, layout="constrained")
    solid, across, along = figure.subplots(1, 3, width_ratios=(1.25, 1.3, 1.0))
    _solid(solid, design)
    rings = [domain.outline()]
    if domain.mirrored:
        rings.append(rings[0] * (-1.0, 1.0))
    (left, low), (right, high) = (function(np.concatenate(rings), axis=0) for function in (np.min, np.max))
    x2, x3 = np.meshgrid(np.linspace(left, right, FINE), np.linspace(low, high, FINE))
    places = np.stack([np.full_like(x2, 0.5 * domain.length), x2, x3], axis=-1)
    inside = np.any([Path(ring).contains_points(places[..., 1:].reshape(-1, 2), radius=1e-9) for ring in rings], axis=0)
    image = _density(across, design, (x2, x3), places, inside.reshape(x2.shape))
    outline = Path.make_compound_path(*(Path(ring, closed=False) for ring in rings))
    frame = PathPatch(outline, fill=False, edgecolor=DOMAIN, linewidth=1.0)
    across.add_patch(frame)
    image.set_clip_path(frame)
    if domain.mirrored:
        across.axvline(0.0, color=DOMAIN, linewidth=0.7, linestyle=":")
    across.set(aspect="equal", title="section across the axis", xlabel="X2 [mm]", ylabel="X3 [mm]")
    across.margins(0.04)
    x1, x3 = np.meshgrid(np.linspace(0.0, domain.length, FINE), np.linspace(low, high, FINE))
    _density(along, design, (x1, x3), np.stack([x1, 0.0 * x1, x3], axis=-1))
    along.add_patch(Rectangle((0.0, low), domain.length, high - low, fill=False, edgecolor=DOMAIN, linewidth=1.0))
    along.set(aspect="equal", title="plane X2 = 0", xlabel="X1 [mm]")
    along.margins(0.04)
    figure.colorbar(image, ax=[across, along], label="density ρ", shrink=0.8)
    return figure


def _density(
    axes: Axes, design: OptimisedDesign, plane: tuple[Floats, Floats], places: Floats, inside: Any = True
) -> Any:
    """Density, outline of the solid and source of Eq. (A.1) where it has at least half its strength, in a plane.

    Args:
        axes: to draw on.
        design: whose initial design it is.
        plane: coordinates in the plane, (n, m) each.
        places: the same points in the domain, (n, m, 3), or their mirror images.
        inside: which of them lie in the domain, (n, m).
    """
    domain, (_, _, limits) = design.domain, design.case.optimize.parameters()
    if domain.mirrored:
        places = np.stack([places[..., 0], np.abs(places[..., 1]), places[..., 2]], axis=-1)
    chi = domain.initial_design(places, limits.interface_width, limits.length_unit)
    image = axes.pcolormesh(*plane, expit(chi), cmap="Greys", vmin=0.0, vmax=1.0, shading="gouraud", rasterized=True)
    axes.contour(*plane, np.where(inside, chi, np.nan), levels=[0.0], colors=EDGE, linewidths=1.4)
    strength = domain.inlet(places)
    axes.contourf(*plane, strength, levels=[0.5, 2.0], colors=SOURCE, alpha=0.25)
    fed = strength >= 0.5
    axes.text(plane[0][fed].mean(), plane[1][fed].mean(), "source", color=SOURCE, ha="center", va="center")
    return image


def _solid(axes: Axes, design: OptimisedDesign) -> None:
    domain, (_, _, limits) = design.domain, design.case.optimize.parameters()
    chi = domain.initial_design(domain.points, limits.interface_width, limits.length_unit)
    tets = domain.tetrahedra().corners
    draw_solid(axes, solid_boundary(domain.points, tets, outer_triangles(domain, tets), chi), ABOVE, BODY, zorder=2)
    rows, ring = projection(ABOVE)[:2], domain.outline()
    closed = np.concatenate([ring, ring[:1]])
    for x1, order in ((0.0, 1), (domain.length, 3)):
        end = np.column_stack([np.full(len(closed), x1), closed])
        axes.plot(*(rows @ end.T), color=DOMAIN, linewidth=0.9, zorder=order)
    sides = np.roll(ring, -1, axis=0) - ring
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    for corner in ring[(sides * np.roll(sides, 1, axis=0)).sum(axis=1) < SHARP]:
        edge = np.array([[0.0, *corner], [domain.length, *corner]])
        axes.plot(*(rows @ edge.T), color=DOMAIN, linewidth=0.9, zorder=3)
    axes.set(aspect="equal", title="initial solid in the domain")
    axes.set_axis_off()
