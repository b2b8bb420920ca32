"""C_i of Eq. (12): a slope of χ that is steeper than the interface's width allows."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.arrays import Floats
from actuator.equations.kernels import ordered_sum, vertex_gradient
from actuator.material.ersatz import FAST
from actuator.terms.interface import DesignTerm, Problem, Value


class InterfaceSlope(DesignTerm):
    """C_i = c_i / 6 ∫ ⟨‖∇χ‖ - 8 / L_i⟩⁶."""

    def __init__(self, problem: Problem) -> None:
        self._geometry, self._weight = problem.discretisation.geometry, problem.objective.slope_weight
        self._limit = 8.0 / problem.objective.interface_width
        n_cells = len(self._geometry.cells)
        self._nothing = np.empty((n_cells, 0)), np.empty((n_cells, 0, 0))

    def value(self, chi: Floats) -> float:
        """C_i, dimensionless."""
        return float(interface_slope(self._geometry, self._weight, self._limit, chi, *self._nothing, False)[0])

    def add(self, chi: Floats, gradient: Floats, hessian: Floats) -> Value:
        """Add the derivatives of C_i; ``steepest`` is the largest ‖∇χ‖ L_i / 8."""
        value, norm = interface_slope(self._geometry, self._weight, self._limit, chi, gradient, hessian, True)
        return Value(float(value), {"steepest": float(norm) / self._limit})


@njit(cache=True, parallel=True, fastmath=FAST)
def interface_slope(geometry, weight, limit, chi, g, h, derivatives):
    """C_i and the largest ‖∇χ‖, 1/mm; adds to element gradients and Hessians if ``derivatives`` are wanted."""
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    values, steepest = np.zeros(n_cells), np.zeros(n_cells)
    for e in prange(n_cells):
        s = geometry.section[e]
        grad, project = np.empty(3), np.empty(8)
        for q in range(n_q):
            gradient, dx = geometry.gradient[s, q], geometry.volume[s, q]
            vertex_gradient(chi, geometry.cells[e], gradient, grad)
            norm = np.sqrt(grad[0] ** 2 + grad[1] ** 2 + grad[2] ** 2)
            steepest[e] = max(steepest[e], norm)
            excess = norm - limit
            if excess <= 0.0:
                continue
            cube = excess * excess * excess
            values[e] += weight / 6.0 * dx * cube * cube
            if not derivatives:
                continue
            across = weight * dx * cube * excess * excess / norm
            along = (5.0 * weight * dx * cube * excess - across) / (norm * norm)
            for a in range(8):
                d = gradient[a]
                project[a] = grad[0] * d[0] + grad[1] * d[1] + grad[2] * d[2]
                g[e, a] += across * project[a]
            for a in range(8):
                d = gradient[a]
                for b in range(8):
                    f = gradient[b]
                    h[e, a, b] += along * project[a] * project[b] + across * (d[0] * f[0] + d[1] * f[1] + d[2] * f[2])
    return ordered_sum(values), steepest.max()
