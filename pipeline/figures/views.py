"""Views of a design: from the side, from the front and from above with axes in mm, and deformed with its pressure."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from actuator.geometry.zero_set import Surface
from pipeline.figures.offscreen import ABOVE, Scale, Shot, piece
from pipeline.figures.sheet import Place, draw_shots, padded, sheet
from pipeline.results.design import OptimisedDesign

PRESSURE = Scale("viridis", 1.0, "p / p_in")
#: Name, direction to the eye, direction that is up, and which coordinates run to the right and upwards.
VIEWS = (
    ("side", (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), ("X1", "X3")),
    ("front", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), ("X2", "X3")),
    ("top", (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), ("X1", "X2")),
)


def views(design: OptimisedDesign) -> Figure:
    """Draw the shape of a design from three sides, and deformed from above, coloured by p / p_in.

    Raises:
        actuator.failure.EmptySolid: if nothing is solid.
    """
    shape = design.shape
    fields, moved = design.fields_at(shape.vertices)
    rest = piece(shape)
    bent = piece(
        Surface(shape.vertices + moved, shape.triangles), values=np.clip(fields["pressure"], 0.0, 1.0), scale=PRESSURE
    )
    shots = [*(Shot([rest], direction, up) for _, direction, up, _ in VIEWS), Shot([bent], ABOVE)]
    places = [
        Place(padded(shot.extent()), name, (f"{right} [mm]", f"{up} [mm]"))
        for shot, (name, _, _, (right, up)) in zip(shots, VIEWS, strict=False)
    ]
    found = sheet([*places, Place(padded(shots[-1].extent()), "deformed")], design.name, bar=True)
    draw_shots(found, found.panels, shots)
    found.colour_bar(PRESSURE)
    return found.figure
