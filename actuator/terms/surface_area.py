"""C_A of Eq. (11): the area of the interface between void and solid."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.arrays import Floats
from actuator.equations.kernels import interpolate, ordered_sum
from actuator.material.ersatz import FAST, sigmoid
from actuator.terms.interface import DesignTerm, Problem, Value


class SurfaceArea(DesignTerm):
    """C_A = c_A 8 / L_i |Ω|^(-2/3) ∫ ρ (1 - ρ)."""

    def __init__(self, problem: Problem) -> None:
        discretisation, objective = problem.discretisation, problem.objective
        self._geometry = discretisation.geometry
        scale = discretisation.volume ** (2.0 / 3.0)
        self._weight = objective.area_weight / scale * 8.0 / objective.interface_width
        n_cells = len(self._geometry.cells)
        self._nothing = np.empty((n_cells, 0)), np.empty((n_cells, 0, 0))

    def value(self, chi: Floats) -> float:
        """C_A, dimensionless."""
        if self._weight == 0.0:
            return 0.0
        return float(surface_area(self._geometry, self._weight, chi, *self._nothing, False))

    def add(self, chi: Floats, gradient: Floats, hessian: Floats) -> Value:
        """Add the derivatives of C_A."""
        if self._weight == 0.0:
            return Value(0.0)
        return Value(float(surface_area(self._geometry, self._weight, chi, gradient, hessian, True)))


@njit(cache=True, parallel=True, fastmath=FAST)
def surface_area(geometry, weight, chi, g, h, derivatives):
    """C_A; adds element gradients (n_cells, 8) and Hessians (n_cells, 8, 8) if ``derivatives`` are wanted."""
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    values = np.zeros(n_cells)
    for e in prange(n_cells):
        s = geometry.section[e]
        for q in range(n_q):
            shape = geometry.shape[q]
            x = interpolate(chi, geometry.cells[e], shape)
            rho, void = sigmoid(x), sigmoid(-x)
            bump, tilt = weight * geometry.volume[s, q] * rho * void, void - rho
            values[e] += bump
            if derivatives:
                second = bump * (tilt * tilt - 2.0 * rho * void)
                for a in range(8):
                    g[e, a] += bump * tilt * shape[a]
                    for b in range(8):
                        h[e, a, b] += second * shape[a] * shape[b]
    return ordered_sum(values)
