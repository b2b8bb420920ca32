"""Which shell lies in which, and so which of them face the wrong way or fill the same space twice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from actuator.arrays import Bools
from actuator.geometry.bodies import Shell
from actuator.geometry.islands import winding_number

#: Triangles of a shell whose middles are looked at, at most; and triangles times points in all, for the time it takes.
LOOKED_AT, MOST_ANGLES = 32, 200_000_000
#: How far a winding number may be from a whole one; in the middle between two the point lies on the surface.
DECISIVE = 0.25


@dataclass(frozen=True)
class Nested:
    """Shells that face the right way: bodies outwards, cavities into the body around them.

    Attributes:
        shells: all of them, bodies with positive and cavities with negative volume, largest first.
        inverted: those that had to be turned around, as they are now.
        doubled: bodies that lie in the material of others, in part or wholly.
    """

    shells: list[Shell]
    inverted: list[Shell]
    doubled: list[Shell]


def nested(parts: Sequence[Shell]) -> Nested:
    """Tell bodies from cavities by what lies around them, whichever way they face.

    The outermost shell of every nest bounds a body. If that faces inwards, all of its nest is turned around. What then
    still faces inwards without any material around it is a body too.

    Args:
        parts: shells of a closed, oriented 2-manifold, largest first.
    """
    inside, mixed = _inside(parts)
    depth = inside.sum(axis=1)
    right, inverted, doubled = [], [], []
    for number, part in enumerate(parts):
        around = np.flatnonzero(inside[number])
        outermost = parts[around[depth[around].argmin()]] if len(around) else part
        shell = part.turned if outermost.volume < 0.0 else part
        if depth[number] % 2 == 0 and shell.volume < 0.0:
            shell = shell.turned
        if shell is not part and shell.volume != part.volume:
            inverted.append(shell)
        if mixed[number] or (depth[number] % 2 and shell.volume > 0.0):
            doubled.append(shell)
        right.append(shell)
    return Nested(right, inverted, doubled)


def _inside(parts: Sequence[Shell]) -> tuple[Bools, Bools]:
    """Whether shell i lies wholly in shell j, (n, n), and whether a shell lies partly in any other, (n,)."""
    n = len(parts)
    inside, mixed = np.zeros((n, n), dtype=bool), np.zeros(n, dtype=bool)
    low, high = np.array([part.low for part in parts]), np.array([part.high for part in parts])
    near = (low[:, None] < high).all(axis=2) & (low < high[:, None]).all(axis=2) & ~np.eye(n, dtype=bool)
    size = np.array([len(part.surface.triangles) for part in parts])
    count = int(np.clip(MOST_ANGLES / max(int((near * size).sum()), 1), 1, LOOKED_AT))
    for i, j in zip(*np.nonzero(near), strict=True):
        own = parts[i].surface
        chosen = own.triangles[:: -(-len(own.triangles) // count)]
        winding = winding_number(
            parts[j].surface.vertices[parts[j].surface.triangles], own.vertices[chosen].mean(axis=1)
        )
        whole = np.rint(winding)
        there = (whole != 0.0)[np.abs(winding - whole) < DECISIVE]
        if there.any() and there.all():
            inside[i, j] = True
        elif there.any():
            mixed[i] = True
    return inside, mixed
