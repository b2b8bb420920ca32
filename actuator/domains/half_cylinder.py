"""The paper's design domain: half of a cylinder, meshed by an O-grid section swept along its axis.

Section 2 and Appendices A to C of Mehta & Poulios (arXiv:2605.20101): radius R, length L, cut at the symmetry plane
X2 = 0. Axes are X1 (cylinder axis), X2 (normal to the symmetry plane), X3 (bending direction); lengths in mm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from skfem import MeshHex

from actuator.arrays import Floats, Ints
from actuator.domains import o_grid
from actuator.domains.interface import HEX_OFFSETS, Domain, Parameter
from actuator.domains.smooth_minimum import smooth_minimum
from actuator.domains.tetrahedra import Tetrahedra, swept


@dataclass(frozen=True)
class HalfCylinder(Domain):
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

    # ---------------------------------------------------------------- section

    @property
    def section_cells(self) -> int:
        """Number of cells in one section, N23."""
        return 2 * self.core_cells * (self.core_cells + 2 * self.rings)

    @cached_property
    def _section(self) -> tuple[Floats, Ints]:
        """Section points (ns, 2) as (X2, X3), and cells (nc, 2, 2) indexed by the two local axes."""
        return o_grid.half_disk(self.radius, self.core_cells, self.rings)

    @property
    def section_points(self) -> int:
        """Number of vertices in one section."""
        return len(self._section[0])

    # ------------------------------------------------------------------- mesh

    @cached_property
    def mesh(self) -> MeshHex:
        """Vertices and 8-node cells; cell ``layer * section_cells + c`` is section cell ``c`` of that layer."""
        plane, quads = self._section
        ns, levels = len(plane), self.layers + 1
        x1 = np.linspace(0.0, self.length, levels)
        points = np.empty((3, ns * levels))
        points[0] = np.repeat(x1, ns)
        points[1:] = np.tile(plane.T, levels)
        axial, second, third = HEX_OFFSETS.T
        base = quads[:, second, third].T  # (8, nc)
        cells = (base[:, None, :] + ns * (axial[:, None] + np.arange(self.layers))[:, :, None]).reshape(8, -1)
        return MeshHex(points, cells.astype(np.int32))

    @property
    def representatives(self) -> Ints:
        """The cells of the first layer, of which those of the others are translates, (section_cells,)."""
        return np.arange(self.section_cells)

    @property
    def cell_class(self) -> Ints:
        """The section cell of each cell, (n_cells,)."""
        return np.tile(np.arange(self.section_cells), self.layers)

    def tetrahedra(self) -> Tetrahedra:
        """Six of each cell, along its section's shorter diagonal."""
        return swept(self.points, self.cells[: self.section_cells], self.layers, self.section_points)

    def outline(self) -> Floats:
        """The half disk with a round wall, whatever the mesh, (n, 2), mm."""
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 181)
        return self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    # ------------------------------------------------------------- functions of the place

    def inlet(self, points: Floats) -> Floats:
        """Profile of Eq. (18): 1 within r < 0.15 R, falling to zero at 0.25 R; (...)."""
        ramp = np.minimum(1.0, np.maximum(0.0, 10.0 * _radii(points) / self.radius - 1.5))
        return np.asarray(1.0 - np.sin(0.5 * np.pi * ramp) ** 2)

    def passive_bound(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """The bound on χ in C_χ of Eq. (21): 8/L_i min(R - r, |r| smoothed - 0.3 R); (...)."""
        radii, radius, width = _radii(points) / length_unit, self.radius / length_unit, interface_width / length_unit
        smooth_radius = -smooth_minimum(radii, -radii, width)
        return 8.0 / width * np.minimum(radius - radii, smooth_radius - 0.3 * radius)

    def initial_design(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """χ at t = 0, Eq. (22): a tube from 0.45 R to 0.95 R, a little thinner for X3 > 0; (...)."""
        points, radius, width = points / length_unit, self.radius / length_unit, interface_width / length_unit
        r, upper = _radii(points), np.maximum(points[..., 2], 0.0)
        tube = smooth_minimum(0.95 * radius - r, r - 0.45 * radius, width)
        passive = smooth_minimum(radius - r, r - 0.3 * radius, width)
        return smooth_minimum(8.0 / (3.0 * width) * tube - 0.1 * upper, 8.0 / width * passive, width)

    # ------------------------------------------------------------- refinement

    def refined(self, factor: int) -> HalfCylinder:
        """The same cylinder with ``factor`` times the cells in all three directions.

        Every vertex is placed by the exact map of the section, so new ones at r = R lie on the cylinder,
        and every vertex of this mesh is a vertex of the finer one.
        """
        if factor < 1:
            raise ValueError("the refinement factor must be at least 1")
        return HalfCylinder(
            self.radius, self.length, factor * self.core_cells, factor * self.rings, factor * self.layers
        )

    def prolongation(self, factor: int) -> sp.csr_array:
        """Trilinear interpolation from the vertices of this mesh to those of :meth:`refined`.

        Interpolation is in the reference coordinates of each cell. Shape (n_fine, n_coarse), rows sum to 1.
        """
        section = o_grid.prolongation(self.core_cells, self.rings, factor)
        return sp.kron(o_grid.line_weights(self.layers, factor), section, format="csr")


def _radii(points: Floats) -> Floats:
    """Distance r to the cylinder's axis, Eq. (19), mm; (...)."""
    return np.asarray(np.hypot(points[..., 1], points[..., 2]))
