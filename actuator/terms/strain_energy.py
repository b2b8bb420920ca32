"""C_Ψ of Eq. (14): the strain energy above its limit, in the material and, by the shift of χ, around it."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.equations.kernels import deformation_gradient, interpolate, ordered_sum
from actuator.material.elasticity import add_stress, energy_density
from actuator.material.ersatz import FAST, inverse, left_cauchy_green, stiffness
from actuator.terms.interface import Derivatives, Fields, Problem, StateTerm, Value


class StrainEnergy(StateTerm):
    """C_Ψ = c_Ψ / 6 ∫ ⟨Ψ(χ + shift, u) / Ψ_lim - 1⟩⁶."""

    def __init__(self, problem: Problem) -> None:
        self._geometry, self._coefficients = problem.discretisation.geometry, problem.coefficients
        self._weighs = problem.objective.strain_energy_weight != 0.0

    def value(self, at: Fields) -> Value:
        """C_Ψ, and as ``energy_ratio`` the largest Ψ(χ + shift, u) / Ψ_lim; dimensionless."""
        value, ratio = strain_energy_excess(self._geometry, self._coefficients, at.chi, at.u)
        return Value(float(value), {"energy_ratio": float(ratio)})

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add the derivatives with respect to χ and u."""
        if self._weighs:
            add_strain_energy_gradient(self._geometry, self._coefficients, at.chi, at.u, into.chi, into.u)


@njit(cache=True, parallel=True, fastmath=FAST)
def strain_energy_excess(geometry, c, chi, u):
    """C_Ψ and the largest Ψ(χ + shift, u) / Ψ_lim over the quadrature points; infinite if an element is inverted."""
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    total, largest = np.zeros(n_cells), np.zeros(n_cells)
    for e in prange(n_cells):
        s = geometry.section[e]
        F, Finv, b = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        for q in range(n_q):
            deformation_gradient(u, geometry.node_cells[e], geometry.gradient20[s, q], F)
            J = inverse(F, Finv)
            if J <= 0.0:
                total[e] = np.inf
                continue
            log_J = np.log(J)
            trace, iso = left_cauchy_green(F, b), np.exp(-2.0 / 3.0 * log_J)
            x = interpolate(chi, geometry.cells[e], geometry.shape[q])
            density = energy_density(c, log_J, iso, trace, b)
            ratio = stiffness(x + c.energy_shift, c)[0] * density / c.energy_limit
            largest[e] = max(largest[e], ratio)
            if ratio > 1.0:
                total[e] += geometry.volume[s, q] * c.strain_energy_weight / 6.0 * (ratio - 1.0) ** 6
    return ordered_sum(total), largest.max()


@njit(cache=True, parallel=True, fastmath=FAST)
def add_strain_energy_gradient(geometry, c, chi, u, g_chi, g_u):
    """Add the derivatives of C_Ψ with respect to χ and u to those of the elements, (n_cells, 8) and (n_cells, 20, 3).

    chi and u are real or complex, all of one type.
    """
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    for e in prange(n_cells):
        s = geometry.section[e]
        F, Finv = np.empty((3, 3), u.dtype), np.empty((3, 3), u.dtype)
        b, M = np.empty((3, 3), u.dtype), np.empty((3, 3), u.dtype)
        for q in range(n_q):
            gradient20 = geometry.gradient20[s, q]
            deformation_gradient(u, geometry.node_cells[e], gradient20, F)
            J = inverse(F, Finv)
            log_J = np.log(J)
            trace, iso = left_cauchy_green(F, b), np.exp(-2.0 / 3.0 * log_J)
            density = energy_density(c, log_J, iso, trace, b)
            if density.real <= c.energy_limit:  # the factor of the stiffness is at most one
                continue
            x = interpolate(chi, geometry.cells[e], geometry.shape[q])
            factor, slope = stiffness(x + c.energy_shift, c)
            over = factor * density / c.energy_limit - 1.0
            if over.real <= 0.0:
                continue
            dx = geometry.volume[s, q]
            rate = dx * c.strain_energy_weight * over * over * over * over * over / c.energy_limit
            M[:] = 0.0
            add_stress(c, rate * factor, log_J, iso, trace, b, M)
            for a in range(8):
                g_chi[e, a] += rate * (slope * density) * geometry.shape[q, a]
            # f_a = M F⁻ᵀ ∇N_a
            for i in range(3):
                p0 = M[i, 0] * Finv[0, 0] + M[i, 1] * Finv[0, 1] + M[i, 2] * Finv[0, 2]
                p1 = M[i, 0] * Finv[1, 0] + M[i, 1] * Finv[1, 1] + M[i, 2] * Finv[1, 2]
                p2 = M[i, 0] * Finv[2, 0] + M[i, 1] * Finv[2, 1] + M[i, 2] * Finv[2, 2]
                for a in range(20):
                    g_u[e, a, i] += p0 * gradient20[a, 0] + p1 * gradient20[a, 1] + p2 * gradient20[a, 2]
