"""The whole cylinder, both halves meshed: what the symmetry about X2 = 0 saves is measured against it."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.domains import o_grid
from actuator.domains.half_cylinder import HalfCylinder


class WholeCylinder(HalfCylinder):
    """A half cylinder's mesh and its mirror image, as one mesh without a symmetry plane.

    The vertices of every section are those of the half, then the images of those off the plane.
    """

    @property
    def section_cells(self) -> int:
        """Number of cells in one section."""
        return 2 * super().section_cells

    @cached_property
    def image(self) -> Ints:
        """For every vertex of the half's section that of its mirror image, (ns_half,)."""
        points, _ = self._half
        beside = points[:, 0] != 0.0
        image = np.arange(len(points))
        image[beside] = len(points) + np.arange(np.count_nonzero(beside))
        return image

    @cached_property
    def _half(self) -> tuple[Floats, Ints]:
        return o_grid.half_disk(self.radius, self.core_cells, self.rings)

    @cached_property
    def _section(self) -> tuple[Floats, Ints]:
        points, cells = self._half
        mirrored = points[points[:, 0] != 0.0] * (-1.0, 1.0)
        # The image of a cell, its first axis turned around, is as right-handed as the cell.
        return np.concatenate([points, mirrored]), np.concatenate([cells, self.image[cells[:, ::-1]]])

    @property
    def mirrored(self) -> bool:
        """No: both halves are meshed."""
        return False

    def extended(self, chi: Floats) -> Floats:
        """A field of the half's vertices on the whole, (n_vertices,), symmetric."""
        half = chi.reshape(self.layers + 1, -1)
        whole = np.empty((self.layers + 1, self.section_points))
        whole[:, : half.shape[1]] = half
        whole[:, self.image] = half
        return whole.ravel()
