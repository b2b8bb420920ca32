"""Vertex fields at the quadrature points, and back."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.equations.assembly import Gather, scatter_vector
from actuator.equations.discretisation import Geometry


class PointFields:
    """The trilinear functions a_q·χ of a vertex field at the quadrature points.

    Attributes:
        volumes: weights w_q of the points, (n_cells, n_q), mm³.
    """

    def __init__(self, geometry: Geometry) -> None:
        self._geometry = geometry
        self.volumes: Floats = geometry.volume[geometry.cell_class]
        self._products = (geometry.shape[:, :, None] * geometry.shape[:, None, :]).reshape(-1, 64)

    def at(self, field: Floats) -> Floats:
        """A vertex field (n_vertices,) at the points, (n_cells, n_q)."""
        return np.asarray(field[self._geometry.cells] @ self._geometry.shape.T)

    def integral(self, values: Floats, n_vertices: int) -> Floats:
        """Σ_q w_q v_q a_q of values (n_cells, n_q), (n_vertices,)."""
        return scatter_vector((self.volumes * values) @ self._geometry.shape, self._geometry.cells, n_vertices)

    def stiffness(self, values: Floats, gather: Gather) -> Floats:
        """Σ_q w_q v_q a_q a_qᵀ: data of the upper triangle on a pattern of vertices."""
        return gather.data(((self.volumes * values) @ self._products).ravel())
