"""The initial design of Appendix C in the design domain: as a solid, and its section with the mesh's cylinder."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle, Wedge
from scipy.special import expit

from actuator.domains.initial_design import initial_design
from actuator.domains.source import pressure_source
from actuator.geometry.tetrahedra import outer_triangles, tetrahedra
from actuator.geometry.zero_set import solid_boundary
from pipeline.figures.offscreen import ABOVE, BODY
from pipeline.figures.shading import draw_solid, projection
from pipeline.results.design import OptimisedDesign

EDGE, DOMAIN, SOURCE = "#2f7fc1", "#3a3f45", "#c00000"
#: Points across a section.
FINE = 401


def initial(design: OptimisedDesign) -> Figure:
    """Half the initial solid in the domain, the section across the axis, and the one in the symmetry plane."""
    domain, (material, _, limits) = design.domain, design.case.optimize.parameters()
    radius, length, widths = domain.radius, domain.length, (limits.interface_width, limits.length_unit)
    figure = Figure(figsize=(11.0, 4.2), dpi=110, layout="constrained")
    solid, across, along = figure.subplots(1, 3, width_ratios=(1.25, 1.3, 1.0))
    _solid(solid, design, widths)
    line = np.linspace(-radius, radius, FINE)
    x2, x3 = np.meshgrid(line, line)
    points = np.stack([np.zeros(x2.size), x2.ravel(), x3.ravel()], axis=1)
    chi = initial_design(points, radius, *widths).reshape(x2.shape)
    density = np.where(np.hypot(x2, x3) <= radius, expit(chi), np.nan)
    image = across.pcolormesh(x2, x3, density, cmap="Greys", vmin=0.0, vmax=1.0, shading="gouraud", rasterized=True)
    round_ = Wedge((0.0, 0.0), radius, 0.0, 360.0, facecolor="none", edgecolor=DOMAIN, linewidth=1.0)
    across.add_patch(round_)
    image.set_clip_path(round_)
    across.contour(x2, x3, np.where(np.hypot(x2, x3) <= radius, chi, np.nan), levels=[0.0], colors=EDGE, linewidths=1.4)
    fed = _source_radius(radius, material.drainage)
    across.add_patch(Wedge((0.0, 0.0), fed, 0.0, 360.0, facecolor=SOURCE, alpha=0.25, edgecolor=SOURCE))
    across.text(0.0, -1.25 * fed, "source", color=SOURCE, ha="center", va="top")
    across.axvline(0.0, color=DOMAIN, linewidth=0.7, linestyle=":")
    across.set(aspect="equal", title="section across the axis", xlabel="X2 [mm]", ylabel="X3 [mm]")
    across.margins(0.04)
    profile = initial_design(np.stack([0.0 * line, 0.0 * line, line], axis=1), radius, *widths)
    ends = np.array([0.0, length])
    along.pcolormesh(
        ends,
        line,
        np.tile(expit(profile)[:, None], 2),
        cmap="Greys",
        vmin=0.0,
        vmax=1.0,
        shading="gouraud",
        rasterized=True,
    )
    along.contour(ends, line, np.tile(profile[:, None], 2), levels=[0.0], colors=EDGE, linewidths=1.4)
    along.add_patch(Rectangle((0.0, -fed), length, 2.0 * fed, facecolor=SOURCE, alpha=0.25, edgecolor=SOURCE))
    along.text(0.5 * length, 0.0, "source", color=SOURCE, ha="center", va="center")
    along.add_patch(Rectangle((0.0, -radius), length, 2.0 * radius, fill=False, edgecolor=DOMAIN, linewidth=1.0))
    along.set(aspect="equal", title="symmetry plane X2 = 0", xlabel="X1 [mm]")
    along.margins(0.04)
    figure.colorbar(image, ax=[across, along], label="density ρ", shrink=0.8)
    return figure


def _source_radius(radius: float, drainage: float) -> float:
    """Where the source of Eq. (A.1) has fallen to half its strength, mm."""
    radii = np.linspace(0.0, radius, FINE)
    strength = pressure_source(radii, radius, drainage)
    return float(radii[strength >= 0.5 * strength[0]].max())


def _solid(axes: Axes, design: OptimisedDesign, widths: tuple[float, float]) -> None:
    domain = design.domain
    radius, length = domain.radius, domain.length
    tets = tetrahedra(domain)
    half = solid_boundary(
        domain.points, tets, outer_triangles(domain, tets), initial_design(domain.points, radius, *widths)
    )
    draw_solid(axes, half, ABOVE, BODY, zorder=2)
    rows = projection(ABOVE)[:2]
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 91)
    for x1, order in ((0.0, 1), (length, 3)):
        arc = np.stack([np.full_like(angle, x1), radius * np.cos(angle), radius * np.sin(angle)])
        axes.plot(*(rows @ arc), color=DOMAIN, linewidth=0.9, zorder=order)
        axes.plot(*(rows @ arc[:, [0, -1]]), color=DOMAIN, linewidth=0.9, zorder=3)
    for x3 in (-radius, radius):
        axes.plot(*(rows @ np.array([[0.0, length], [0.0, 0.0], [x3, x3]])), color=DOMAIN, linewidth=0.9, zorder=3)
    axes.set(aspect="equal", title="initial solid in the half cylinder")
    axes.set_axis_off()
