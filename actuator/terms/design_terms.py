"""The terms of the objective that depend on the design alone: C_χ, C_A, C_i and the step term C_t.

Each has value, gradient and exact Hessian in one pass over the elements; the optimiser solves them exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from actuator.arrays import Floats
from actuator.equations.assembly import Gather, scatter_vector
from actuator.equations.discretisation import Discretisation
from actuator.equations.kernels import interpolate, ordered_sum, vertex_gradient
from actuator.material.ersatz import FAST, sigmoid
from actuator.parameters import Objective


@dataclass(frozen=True)
class DesignTerms:
    """Values of C_χ, C_A and C_i, and the gradient and Hessian of their sum.

    Attributes:
        passive, area, slope: C_χ, C_A, C_i.
        gradient: (n_vertices,).
        hessian: data of the upper triangle, on the pattern of :attr:`DesignObjective.gather`.
        steepest: largest ‖∇χ‖ L_i / 8.
    """

    passive: float
    area: float
    slope: float
    gradient: Floats
    hessian: Floats
    steepest: float

    @property
    def value(self) -> float:
        """Sum of the three terms."""
        return self.passive + self.area + self.slope


class DesignObjective:
    """Evaluates the terms of a discretisation; ``gather`` is the pattern of upper triangles on vertices."""

    def __init__(self, discretisation: Discretisation, objective: Objective, gather: Gather) -> None:
        self._geometry = discretisation.geometry
        self._n = discretisation.domain.mesh.nvertices
        self.gather = gather
        width, unit = objective.interface_width, objective.length_unit
        self._limit = discretisation.domain.passive_bound(discretisation.quadrature_points, width, unit)
        self._weights = (
            objective.passive_weight,
            objective.area_weight / discretisation.volume ** (2.0 / 3.0) * 8.0 / width,
            objective.slope_weight,
            8.0 / width,
        )
        n_cells = len(self._geometry.cells)
        self._g, self._h = np.empty((n_cells, 8)), np.empty((n_cells, 8, 8))
        self._shapes = (self._geometry.shape[:, :, None] * self._geometry.shape[:, None, :]).reshape(-1, 64)
        #: c_χ, and the volume of each quadrature point, (n_cells, n_q), mm³.
        self.passive_weight = objective.passive_weight
        self.volumes: Floats = self._geometry.volume[self._geometry.cell_class]

    def value(self, chi: Floats) -> float:
        """Sum of the terms alone, to the last bit that of a whole evaluation, at a fraction of the price."""
        values = design_terms(self._geometry, self._limit, self._weights, chi, self._g, self._h, False)
        return sum(float(value) for value in values[:3])

    def __call__(self, chi: Floats, *, passive: bool = True) -> DesignTerms:
        """Evaluate at a design (n_vertices,), with or without C_χ."""
        weights = self._weights if passive else (0.0, *self._weights[1:])
        values = design_terms(self._geometry, self._limit, weights, chi, self._g, self._h, True)
        return DesignTerms(
            float(values[0]),
            float(values[1]),
            float(values[2]),
            scatter_vector(self._g, self._geometry.cells, self._n),
            self.gather.data(self._h.ravel()),
            float(values[3]) / self._weights[3],
        )

    def room(self, chi: Floats) -> Floats:
        """How far χ lies below the bound of C_χ at the quadrature points, (n_cells, n_q); negative beyond it."""
        return self._limit[self._geometry.cell_class] - self.at_points(chi)

    def at_points(self, chi: Floats) -> Floats:
        """A vertex field at the quadrature points, (n_cells, n_q)."""
        return np.asarray(chi[self._geometry.cells] @ self._geometry.shape.T)

    def from_points(self, values: Floats) -> Floats:
        """Integral over Ω of a field at the quadrature points times each vertex' shape function, (n_vertices,)."""
        return scatter_vector((self.volumes * values) @ self._geometry.shape, self._geometry.cells, self._n)

    def point_stiffness(self, values: Floats) -> Floats:
        """The same with products of two shape functions: data of the upper triangle on the pattern of ``gather``."""
        return self.gather.data(((self.volumes * values) @ self._shapes).ravel())

    def passive_share(self, chi: Floats) -> float:
        """Share of the solid {χ > 0} that lies in the passive core, where the bound of C_χ is negative."""
        geometry = self._geometry
        volume = self.volumes * (self.at_points(chi) > 0.0)
        solid = float(volume.sum())
        return float(volume[self._limit[geometry.cell_class] < 0.0].sum()) / solid if solid > 0.0 else 0.0


@njit(cache=True, parallel=True, fastmath=FAST)
def design_terms(geometry, limit, weights, chi, g, h, derivatives):
    """C_χ, C_A, C_i and the largest ‖∇χ‖ (1/mm).

    Writes element gradients (n_cells, 8) and Hessians (n_cells, 8, 8) if ``derivatives`` are wanted.
    """
    passive_weight, area_weight, slope_weight, slope_limit = weights
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    values = np.zeros((n_cells, 4))
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        grad, project = np.empty(3), np.empty(8)
        if derivatives:
            g[e] = 0.0
            h[e] = 0.0
        for q in range(n_q):
            dx = geometry.volume[s, q]
            x = interpolate(chi, geometry.cells[e], geometry.shape[q])
            vertex_gradient(chi, geometry.cells[e], geometry.gradient[s, q], grad)
            over = x - limit[s, q]
            first = second = 0.0
            if over > 0.0:
                values[e, 0] += 0.5 * passive_weight * dx * over * over
                first += passive_weight * dx * over
                second += passive_weight * dx
            if area_weight != 0.0:
                rho, void = sigmoid(x), sigmoid(-x)
                bump, tilt = rho * void, void - rho
                values[e, 1] += area_weight * dx * bump
                first += area_weight * dx * bump * tilt
                second += area_weight * dx * bump * (tilt * tilt - 2.0 * bump)
            norm = np.sqrt(grad[0] ** 2 + grad[1] ** 2 + grad[2] ** 2)
            values[e, 3] = max(values[e, 3], norm)
            excess = norm - slope_limit
            along = across = 0.0
            if excess > 0.0:
                cube = excess * excess * excess
                values[e, 2] += slope_weight / 6.0 * dx * cube * cube
                across = slope_weight * dx * cube * excess * excess / norm
                along = (5.0 * slope_weight * dx * cube * excess - across) / (norm * norm)
            if not derivatives:
                continue
            for a in range(8):
                d = geometry.gradient[s, q, a]
                project[a] = grad[0] * d[0] + grad[1] * d[1] + grad[2] * d[2]
                g[e, a] += first * geometry.shape[q, a] + across * project[a]
            for a in range(8):
                for b in range(8):
                    h[e, a, b] += second * geometry.shape[q, a] * geometry.shape[q, b]
            if excess > 0.0:
                for a in range(8):
                    d = geometry.gradient[s, q, a]
                    for b in range(8):
                        f = geometry.gradient[s, q, b]
                        h[e, a, b] += along * project[a] * project[b] + across * (
                            d[0] * f[0] + d[1] * f[1] + d[2] * f[2]
                        )
    return ordered_sum(values[:, 0]), ordered_sum(values[:, 1]), ordered_sum(values[:, 2]), values[:, 3].max()
