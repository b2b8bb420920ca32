"""Slices of a part of any origin: what a printer adds layer by layer, and whether it adds up to the part."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from actuator.arrays import Floats, Ints
from actuator.failure import GridTooLarge
from actuator.geometry.printing.directions import Direction
from stages.check import sound
from stages.events import Message, Observer, silent
from stages.settings import Section

if TYPE_CHECKING:
    from actuator.geometry.printing.layers import Standing


#: Most layers of a part; more is a slip in a unit.
MOST_LAYERS = 100_000


class Settings(Section):
    """How the part is printed; the paper's was, with supports, in 270 layers of 0.1 mm."""

    thickness: float = Field(0.1, ge=1.0e-3, description="of a layer [mm]")
    direction: Direction = Field("z", description="build direction, from the platform to the part [-]")


@dataclass(frozen=True)
class Result:
    """All layers of a part, from the platform upwards.

    Attributes:
        part: in its build direction; its ``cut`` gives the outlines at any height.
        heights: of the middles of the layers above the lowest point, where they are cut, (n,), mm.
        areas: (n,), mm².
        outlines: number of closed outlines in each layer, around material and around holes, (n,).
        largest_jump: largest difference of the areas of layers that follow each other, mm²; 0 for one layer.
        jump: index of the first of these two layers.
        layered_volume: sum of area times thickness, mm³.
        volume: inside the triangles, mm³.
        within: distance within which vertices were merged, mm; 0 if only equal ones had to be.
    """

    part: Standing
    heights: Floats
    areas: Floats
    outlines: Ints
    largest_jump: float
    jump: int
    layered_volume: float
    volume: float
    within: float


def run(vertices: Floats, triangles: Ints, settings: Settings, observer: Observer = silent) -> Result:
    """Cut a part at the middle of every layer.

    Args:
        vertices: (n, 3), mm; equal ones need not be merged.
        triangles: (m, 3), counter-clockwise seen from outside.
        settings: thickness and direction.
        observer: receives a message if vertices had to be merged that are not equal.

    Returns:
        All layers; none if the part is not as high as half a layer.

    Raises:
        actuator.failure.InvalidField: if a coordinate is not finite.
        actuator.failure.EmptySolid: if there is no triangle.
        actuator.failure.GridTooLarge: if there would be more than :data:`MOST_LAYERS`.
        actuator.failure.NotManifold: if the triangles bound no solid, as :func:`stages.check.sound` has it.
    """
    # manifold3d: only where it runs
    from actuator.geometry.printing.layers import middles, standing

    found = sound(vertices, triangles)
    if found.within:
        observer(Message(f"vertices within {found.within:.1g} mm merged"))
    part = standing(found.surface, settings.direction)
    if part.height / settings.thickness > MOST_LAYERS:
        raise GridTooLarge(
            f"The part is {part.height:.6g} mm high and would have {part.height / settings.thickness:.3g} layers, more "
            f"than {MOST_LAYERS}; choose thicker layers."
        )
    heights = middles(part.height, settings.thickness)
    sections = [part.cut(height) for height in heights.tolist()]
    areas = np.array([section.area for section in sections])
    outlines = np.array([len(section.outlines) for section in sections], dtype=np.int64)
    jumps = np.abs(np.diff(areas))
    return Result(
        part,
        heights,
        areas,
        outlines,
        float(jumps.max(initial=0.0)),
        int(jumps.argmax()) if len(jumps) else 0,
        float(settings.thickness * areas.sum()),
        part.solid.volume(),
        found.within,
    )
