"""The part for the report's 3D view: few triangles, undeformed and under pressure, in compact numbers.

It is the shape of the design with the fields of the optimisation, or, where the part was inflated, that part.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from actuator.arrays import Floats
from actuator.geometry.decimation import decimated
from actuator.geometry.islands import without_islands
from actuator.geometry.solid import prove_solid
from actuator.geometry.splitting import split_where_curved
from actuator.geometry.zero_set import Surface
from pipeline.figures.colouring import COLOURS
from pipeline.figures.inflated import COLOURS as STRAIN
from pipeline.figures.inflated import END
from pipeline.figures.offscreen import ABOVE, BODY
from pipeline.figures.saving import encoded
from pipeline.figures.shading import draw_solid, split_at_sharp_edges
from pipeline.figures.states import completed
from pipeline.results.design import OptimisedDesign
from pipeline.results.inflation import Inflated

#: How far the displayed surface may lie off, over R, and the most triangles before it may lie off twice as far.
TOLERANCE, MOST = 1.0 / 300.0, 60_000
#: How far pressure over p_in, and displacement over R, may be from linear along the edges of displayed triangles.
LINEAR = 0.04
#: Colours from the least to the largest value.
STEPS = 64


@dataclass(frozen=True)
class Scale:
    """What colours mean.

    Attributes:
        name: of what they show.
        largest: value of the last of them; the first is none.
        colours: name of the map.
        words: what the bar looks like.
    """

    name: str
    largest: float
    colours: str
    words: str


@dataclass(frozen=True)
class DisplayedPart:
    """What the page draws.

    Attributes:
        surface: undeformed, in the size of the computation.
        moved: its vertices under pressure, (n, 3), mm.
        values: which the vertices are coloured by, (n,), over the largest.
        scale: of the colours.
        triangles: of the shape before it was simplified.
        off: how far the surface lies from that shape at most, mm.
        islands: bodies that float beside the part, and were left out as in the export.
    """

    surface: Surface
    moved: Floats
    values: Floats
    scale: Scale
    triangles: int
    off: float
    islands: int

    def as_json(self) -> dict[str, Any]:
        """Numbers for the page: places as 16 bit along the sides of a box around both states, values as 8 bit."""
        origin, triangles = split_at_sharp_edges(self.surface)
        places = self.surface.vertices[origin], self.moved[origin]
        low, high = (f([f(place, axis=0) for place in places], axis=0) for f in (np.min, np.max))
        rest, moved = (np.round((place - low) / (high - low) * 65535).astype("<u2") for place in places)
        values = np.round(np.clip(self.values[origin], 0.0, 1.0) * 255).astype("u1")
        colours = colormaps[self.scale.colours](np.linspace(0.0, 1.0, STEPS), bytes=True)[:, :3]
        return {
            "low": low.tolist(),
            "high": high.tolist(),
            "rest": _base64(rest),
            "moved": _base64(moved),
            "values": _base64(values),
            "triangles": _base64(triangles.astype("<u4")),
            "colours": _base64(colours),
            "body": BODY,
        }

    def still(self) -> bytes:
        """Both states side by side as a PNG, for where a browser cannot draw."""
        figure = Figure(figsize=(10.0, 4.8), dpi=110, layout="constrained")
        panels = figure.subplots(1, 2, sharex=True, sharey=True)
        states = (("part", self.surface.vertices), ("under pressure", self.moved))
        for axes, (title, vertices) in zip(panels, states, strict=True):
            draw_solid(axes, Surface(vertices, self.surface.triangles), ABOVE, BODY)
            axes.set(aspect="equal", title=title)
            axes.set_axis_off()
        return encoded(figure, "png", "still")


def displayed(design: OptimisedDesign) -> DisplayedPart:
    """The part of a design, simplified.

    Raises:
        actuator.failure.Failure: if the shape is no solid.
    """
    shape = design.shape
    whole = prove_solid(shape.vertices, shape.triangles).surface
    islands = 0
    if design.case.export.islands == "remove":
        whole, removed = without_islands(whole)
        islands = len(removed)
    simple, off = _simplified(whole, design.domain.size, TOLERANCE)

    def state(points: Floats) -> Floats:
        """Pressure over p_in and displacement over R."""
        fields, moved = design.fields_at(points)
        return np.column_stack([fields["pressure"], moved / design.domain.size])

    # A flat end needs few triangles, but the pressure falls steeply there.
    simple, values = split_where_curved(simple, state, LINEAR, TOLERANCE * design.domain.size)
    moved = simple.vertices + design.domain.size * values[:, 1:]
    scale = Scale("p / p_in", 1.0, COLOURS, "from dark violet over green to yellow")
    return DisplayedPart(simple, moved, values[:, 0], scale, len(whole.triangles), off, islands)


def displayed_inflated(state: Inflated) -> DisplayedPart:
    """A part under pressure, coloured by its strain, on the surface of the mesh that it was inflated on."""
    corners = state.boundary[:, :3]
    used, triangles = np.unique(corners, return_inverse=True)
    points, moved, strain = state.points[used], state.displacement[used], state.strain[used]
    triangles = triangles.reshape(-1, 3)
    if state.half:
        points, triangles, (moved, strain) = completed(points, triangles, moved, strain)
    whole, size = Surface(points, triangles), float(np.ptp(points, axis=0).max())
    simple, off = _simplified(whole, size, 0.0)
    # Edges are collapsed onto vertices that stay.
    _, nearest = cKDTree(points).query(simple.vertices)
    scale = Scale("strain", END * state.limit, STRAIN, "from blue over pale yellow at the limit to red")
    bent = simple.vertices + moved[nearest]
    return DisplayedPart(simple, bent, strain[nearest] / scale.largest, scale, len(triangles), off, 0)


def _simplified(whole: Surface, size: float, tolerance: float) -> tuple[Surface, float]:
    """A surface that lies off by a tolerance (over its size), or by more if it has too many triangles; and how far."""
    simple, off = decimated(whole, tolerance * size) if tolerance else (whole, 0.0)
    while len(simple.triangles) > MOST and tolerance < 0.1:
        tolerance = 2.0 * max(tolerance, 0.5 * TOLERANCE)
        simple, off = decimated(whole, tolerance * size)
    return simple, off


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()
