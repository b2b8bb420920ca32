"""A solid between two plates: where it is glued, what closes its air chamber, and whether it is symmetric."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from actuator.arrays import Bools, Floats, Ints
from actuator.failure import Leaking, NotInflatable
from actuator.geometry.bodies import shells
from actuator.geometry.distance import distance
from actuator.geometry.flaws import flaws
from actuator.geometry.placing import placed
from actuator.geometry.printing.directions import Axis
from actuator.geometry.solid import component_labels, rounded
from actuator.geometry.zero_set import Surface

#: How far corners of an end face may lie off its plane, and mirrored corners off the surface, over the length.
FLAT, SYMMETRIC = 1e-4, 1e-3
#: Corners that are compared with the surface where mirrored ones do not coincide.
COMPARED = 2000


@dataclass(frozen=True)
class Glued:
    """A solid with its axis along the first coordinate, from the fixed plate at 0 to the arm's plate.

    Attributes:
        surface: closed, oriented 2-manifold; the axis is at X2 = X3 = 0.
        length: distance of the plates, mm.
        at_fixed, at_arm: which triangles lie in the planes of the plates, (m,).
        wall: which triangles the air in the chamber presses on, (m,).
        symmetric: whether the solid is its own mirror image about X2 = 0.
    """

    surface: Surface
    length: float
    at_fixed: Bools
    at_arm: Bools
    wall: Bools
    symmetric: bool


def glued(vertices: Floats, triangles: Ints, axis: Axis = "x") -> Glued:
    """Glue a solid between plates.

    Args:
        vertices: (n, 3), mm; equal ones need not be merged.
        triangles: (m, 3), counter-clockwise seen from outside.
        axis: along which the end faces lie opposite.

    Raises:
        NotInflatable: if it is not one closed body with two flat end faces and a closed chamber between them; as
            Leaking where only the chamber is missing.
    """
    surface = rounded(np.roll(vertices, -"xyz".index(axis), axis=1), triangles)
    _check_body(surface)
    length = float(np.ptp(surface.vertices[:, 0]))
    surface = Surface(placed(surface.vertices), surface.triangles)
    x = surface.vertices[surface.triangles, 0]
    at_fixed = (x <= FLAT * length).all(axis=1)
    at_arm = (x >= (1.0 - FLAT) * length).all(axis=1)
    for end, there in (("lower", at_fixed), ("upper", at_arm)):
        if not there.any():
            raise NotInflatable(
                f"The solid has no flat face at its {end} end along {axis} that a plate could be glued on: turn it, or "
                "name its axis."
            )
    wall = _wall(surface, length, ~(at_fixed | at_arm))
    return Glued(surface, length, at_fixed, at_arm, wall, _is_symmetric(surface, length))


def _check_body(surface: Surface) -> None:
    if flaws(surface).any:
        raise NotInflatable("The triangles bound no solid: `poro check` says where; repair the file.")
    bodies = [shell for shell in shells(surface) if shell.volume > 0.0]
    if len(bodies) != 1:
        raise NotInflatable(
            f"There are {len(bodies)} separate bodies, and one is what can be inflated: leave the others out."
        )


def _wall(surface: Surface, length: float, sides: Bools) -> Bools:
    """Which triangles are walls of a chamber that plates close.

    The sides, which are no end faces, fall apart into what can be reached on them. A chamber is one that encloses void,
    and reaches from plate to plate, or from one plate over the middle of the length.
    """
    numbers = np.flatnonzero(sides)
    own = Surface(surface.vertices, surface.triangles[numbers])
    _, label = np.unique(component_labels(own)[own.triangles[:, 0]], return_inverse=True)
    corners = own.vertices[own.triangles]
    # The end faces, being normal to the axis, add nothing to ∮ y n_y dA.
    areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    enclosed = np.bincount(label, areas[:, 1] * corners[:, :, 1].mean(axis=1))
    lowest, highest = np.full(len(enclosed), np.inf), np.full(len(enclosed), -np.inf)
    np.minimum.at(lowest, label, corners[:, :, 0].min(axis=1))
    np.maximum.at(highest, label, corners[:, :, 0].max(axis=1))
    at_fixed, at_arm = lowest <= FLAT * length, highest >= (1.0 - FLAT) * length
    through = (enclosed < 0.0) & at_fixed & at_arm
    over_middle = (enclosed < 0.0) & (at_fixed | at_arm) & (lowest < 0.5 * length) & (highest > 0.5 * length)
    chambers = through if through.any() else over_middle
    if not chambers.any():
        raise Leaking(
            "The solid does not hold air: with plates glued on both ends no chamber between them is closed; "
            "`poro check` says where the air gets out."
        )
    wall = np.zeros(len(sides), dtype=bool)
    wall[numbers] = chambers[label]
    return wall


def _is_symmetric(surface: Surface, length: float) -> bool:
    mirrored = surface.vertices * np.array([1.0, -1.0, 1.0])
    off, _ = cKDTree(surface.vertices).query(mirrored)
    apart = np.flatnonzero(off > SYMMETRIC * length)
    if not len(apart):
        return True
    some = mirrored[apart[:: max(1, len(apart) // COMPARED)]]
    return bool(distance(some, surface).max() <= SYMMETRIC * length)
