"""The paper's design domain: half of a cylinder, meshed by an O-grid section swept along its axis.

Section 2 and Appendices A to C of Mehta & Poulios (arXiv:2605.20101): radius R, length L, cut at the symmetry plane
X2 = 0. Axes are X1 (cylinder axis), X2 (normal to the symmetry plane), X3 (bending direction); lengths in mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats, Ints
from actuator.domains import channel, o_grid
from actuator.domains.interface import Parameter
from actuator.domains.swept import Swept


@dataclass(frozen=True)
class HalfCylinder(Swept):
    """Hexahedral mesh of the half cylinder ``0 <= X1 <= length``, ``X2 >= 0``, ``r <= radius``.

    The section has 2 (m² + 2 m k) cells: a core of m x m cells per quarter and k rings around it;
    m = 12, k = 5 gives the paper's 528.

    Args:
        radius: R in mm.
        length: L in mm.
        core_cells: m, cells along each side of a quarter of the core.
        rings: k, cells between the core and the cylinder wall.
        layers: N1, cells along X1.

    Raises:
        ValueError: if a size is not positive.
    """

    shape: ClassVar[str] = "half-cylinder"

    radius: float
    length: float
    core_cells: int
    rings: int
    layers: int

    def __post_init__(self) -> None:
        if not (self.radius > 0.0 and self.length > 0.0):
            raise ValueError("radius and length must be positive")
        if min(self.core_cells, self.rings, self.layers) < 1:
            raise ValueError("core_cells, rings and layers must be at least 1")

    @property
    def size(self) -> float:
        """R, mm."""
        return self.radius

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """The arguments it is made from."""
        return {
            "radius": Parameter(self.radius, "mm", "radius of the half cylinder"),
            "length": Parameter(self.length, "mm", "length of the half cylinder"),
            "core_cells": Parameter(self.core_cells, "1", "cells along each side of a quarter of the section's core"),
            "rings": Parameter(self.rings, "1", "rings of cells between the core and the cylinder wall"),
            "layers": Parameter(self.layers, "1", "cells along X1"),
        }

    @cached_property
    def half_section(self) -> tuple[Floats, Ints]:
        """The O-grid of half a disk."""
        return o_grid.half_disk(self.radius, self.core_cells, self.rings)

    def half_section_prolongation(self, factor: int) -> sp.csr_array:
        """Interpolation in the reference coordinates of the O-grid's cells."""
        return o_grid.prolongation((self.core_cells, self.core_cells), self.rings, factor)

    def outline(self) -> Floats:
        """The half disk with a round wall, whatever the mesh, (n, 2), mm."""
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 181)
        return self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    # ------------------------------------------------------------- functions of the place

    def inlet(self, points: Floats) -> Floats:
        """Profile of Eq. (18), (...)."""
        return channel.inlet(_radii(points), self.radius)

    def passive_bound(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """The bound on χ in C_χ of Eq. (21), (...)."""
        radii, radius = _radii(points) / length_unit, self.radius / length_unit
        return channel.passive_bound(radii, radius - radii, radius, interface_width / length_unit)

    def initial_design(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """χ at t = 0, Eq. (22): a tube from 0.45 R to 0.95 R, a little thinner for X3 > 0; (...)."""
        points, radius = points / length_unit, self.radius / length_unit
        r = _radii(points)
        wall = channel.OUTER * radius - r, r - channel.INNER * radius
        return channel.initial_design(r, radius - r, wall, points[..., 2], radius, interface_width / length_unit)

    # ------------------------------------------------------------- refinement

    def refined(self, factor: int) -> Self:
        """The same cylinder with ``factor`` times the cells in all three directions.

        Every vertex is placed by the exact map of the section, so new ones at r = R lie on the cylinder,
        and every vertex of this mesh is a vertex of the finer one.
        """
        if factor < 1:
            raise ValueError("the refinement factor must be at least 1")
        finer = {name: factor * getattr(self, name) for name in ("core_cells", "rings", "layers")}
        return replace(self, **finer)


def _radii(points: Floats) -> Floats:
    """Distance r to the cylinder's axis, Eq. (19), mm; (...)."""
    return np.asarray(np.hypot(points[..., 1], points[..., 2]))
