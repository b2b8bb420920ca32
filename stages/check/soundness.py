"""Whether triangles bound a solid: one answer for checking, slicing and inflating a part of any origin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.failure import EmptySolid, InvalidField, NotManifold
from stages.check import findings

if TYPE_CHECKING:
    from actuator.geometry.bodies import Shell
    from actuator.geometry.zero_set import Surface
    from stages.check.findings import Finding


@dataclass(frozen=True)
class Examined:
    """Triangles whose vertices are merged, and what was found of them.

    Attributes:
        surface: with shells that faced the wrong way turned around.
        shells: its components, largest first; none if it is not closed.
        closed: whether it is a closed surface that faces outwards.
        crossings: whether it goes through itself; None if it is not closed.
        within: distance within which vertices were merged, mm; 0 if only equal ones had to be.
    """

    surface: Surface
    shells: list[Shell]
    closed: Finding
    crossings: Finding | None
    within: float


def examined(vertices: Floats, triangles: Ints) -> Examined:
    """Merge vertices and look whether the triangles bound a solid.

    Args:
        vertices: (n, 3), mm; equal ones need not be merged.
        triangles: (m, 3), counter-clockwise seen from outside.

    Raises:
        InvalidField: if a coordinate is not finite.
        EmptySolid: if there is no triangle with an area.
    """
    # scipy, numba and manifold3d: only where it runs
    from actuator.geometry.bodies import joined, shells
    from actuator.geometry.crossings import crossings
    from actuator.geometry.flaws import flaws
    from actuator.geometry.merging import merged
    from actuator.geometry.nesting import nested

    if not np.isfinite(vertices).all():
        raise InvalidField("The part has coordinates that are not finite; export it again.")
    found = merged(vertices, triangles)
    surface, within = found.surface, found.within
    if not len(surface.triangles):
        raise EmptySolid("The part has no triangles with an area; export it again.")
    edges = flaws(surface)
    if edges.any:
        return Examined(surface, [], findings.closed_surface(edges, surface, within), None, within)
    nest = nested(shells(surface))
    if nest.inverted:
        surface = joined(nest.shells)
    closed = findings.closed_surface(edges, surface, within, nest.inverted)
    through = findings.crossings(crossings(surface), nest.doubled)
    return Examined(surface, nest.shells, closed, through, within)


def sound(vertices: Floats, triangles: Ints) -> Examined:
    """The same for what needs a solid.

    Raises:
        InvalidField: if a coordinate is not finite.
        EmptySolid: if there is no triangle with an area.
        NotManifold: if the triangles bound no solid, face inwards, or go through each other.
    """
    found = examined(vertices, triangles)
    for finding in (found.closed, found.crossings):
        if finding and finding.verdict == "fail":
            raise NotManifold(f"{finding.text.removesuffix('.')}; repair the part where it was made.")
    return found
