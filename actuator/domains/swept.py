"""Domains swept along X1: one section of quadrilaterals, as often as there are layers.

A section is described by its half X2 >= 0. Of a whole solid the other half is its mirror image, to the last bit; cells
of a layer are translates of those of the first, with which they share their shape functions.
"""

from __future__ import annotations

from abc import abstractmethod
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from skfem import MeshHex

from actuator.arrays import Floats, Ints
from actuator.domains import o_grid
from actuator.domains.interface import HEX_OFFSETS, Domain
from actuator.domains.tetrahedra import Tetrahedra, mirrored, swept


class Swept(Domain):
    """A domain swept along X1; a subclass has :attr:`half_section` and :meth:`half_section_prolongation`.

    Attributes:
        layers: N1, cells along X1.
    """

    layers: int

    # ---------------------------------------------------------------- section

    @property
    @abstractmethod
    def half_section(self) -> tuple[Floats, Ints]:
        """Points (n, 2) as (X2, X3) with X2 >= 0, and cells (m, 2, 2) indexed by two right-handed local axes.

        Points on the symmetry plane have X2 = 0 to the last bit; a cached property, being asked for often.
        """

    @abstractmethod
    def half_section_prolongation(self, factor: int) -> sp.csr_array:
        """Bilinear interpolation from these points to those of :meth:`refined`, (n_fine, n); rows sum to 1."""

    @cached_property
    def section_image(self) -> Ints:
        """For every point of the half section its mirror image among the points of the section, (n,)."""
        points, _ = self.half_section
        beside = points[:, 0] != 0.0
        image = np.arange(len(points))
        if not self.mirrored:
            image[beside] = len(points) + np.arange(np.count_nonzero(beside))
        return image

    @cached_property
    def section(self) -> tuple[Floats, Ints]:
        """Points and cells of the section: those of the half, then the images of those that the whole has besides."""
        points, cells = self.half_section
        if self.mirrored:
            return points, cells
        images = points[points[:, 0] != 0.0] * (-1.0, 1.0)
        # The image of a cell, its first axis turned around, is as right-handed as the cell.
        return np.concatenate([points, images]), np.concatenate([cells, self.section_image[cells[:, ::-1]]])

    @property
    def section_cells(self) -> int:
        """Number of cells in one section, N23."""
        return len(self.section[1])

    @property
    def section_points(self) -> int:
        """Number of vertices in one section."""
        return len(self.section[0])

    # ------------------------------------------------------------------- mesh

    @cached_property
    def mesh(self) -> MeshHex:
        """Vertices and 8-node cells; cell ``layer * section_cells + c`` is section cell ``c`` of that layer."""
        plane, quads = self.section
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
        """Six of each cell, along its section's shorter diagonal; of a whole solid symmetric about X2 = 0."""
        half = len(self.half_section[1])
        found = swept(self.points, self.cells[:half], self.layers, self.section_points)
        layer, cell = np.divmod(found.cells, half)
        found = Tetrahedra(found.corners, layer * self.section_cells + cell)
        if self.mirrored:
            return found
        images = self.section_points * np.arange(self.layers + 1)[:, None] + np.concatenate(
            [self.section_image, np.zeros(self.section_points - len(self.section_image), int)]
        )
        return mirrored(found, images.ravel(), half)

    # ------------------------------------------------------------- refinement

    def prolongation(self, factor: int) -> sp.csr_array:
        """Trilinear interpolation from the vertices of this mesh to those of :meth:`refined`.

        Interpolation is in the reference coordinates of each cell. Shape (n_fine, n_coarse), rows sum to 1.
        """
        section = self.half_section_prolongation(factor)
        if not self.mirrored:
            fine, _ = self.refined(factor).half_section
            coarse = section.tocoo()
            beside = section[np.flatnonzero(fine[:, 0] != 0.0)].tocoo()
            section = sp.csr_array(
                (
                    np.concatenate([coarse.data, beside.data]),
                    (
                        np.concatenate([coarse.coords[0], len(fine) + beside.coords[0]]),
                        np.concatenate([coarse.coords[1], self.section_image[beside.coords[1]]]),
                    ),
                ),
                (len(fine) + beside.shape[0], self.section_points),
            )
        return sp.kron(o_grid.line_weights(self.layers, factor), section, format="csr")

    @abstractmethod
    def refined(self, factor: int) -> Swept:
        """The same domain with ``factor`` times the cells in all three directions, and all vertices of this one."""
