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
        #: Whether C_Ψ weighs anything.
        self.weighs = problem.objective.strain_energy_weight != 0.0

    def value(self, at: Fields) -> Value:
        """C_Ψ, and as ``energy_ratio`` the largest Ψ(χ + shift, u) / Ψ_lim; dimensionless."""
        value, ratio = strain_energy_excess(self._geometry, self._coefficients, at.chi, at.u)
        return Value(float(value), {"energy_ratio": float(ratio)})

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add nothing: :func:`add_strain_energy` is compiled into the loop of :mod:`actuator.terms.lagrangian`."""


@njit(cache=True, parallel=True, fastmath=FAST)
def strain_energy_excess(geometry, c, chi, u):
    """C_Ψ and the largest Ψ(χ + shift, u) / Ψ_lim over the quadrature points; infinite if an element is inverted."""
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    total, largest = np.zeros(n_cells), np.zeros(n_cells)
    for e in prange(n_cells):
        s = geometry.cell_class[e]
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


@njit(cache=True, inline="always")
def add_strain_energy(c, weight, x, log_J, iso, trace, b, M, d_chi):
    """At a point: add weight · ∂C_Ψ/∂F Fᵀ per volume to M (3, 3), and return d_chi plus weight · ∂C_Ψ/∂χ.

    Args:
        x: χ; the other arguments are those of :mod:`actuator.material.elasticity`. Real or complex.
    """
    density = energy_density(c, log_J, iso, trace, b)
    if density.real > c.energy_limit:  # the factor of the stiffness is at most one
        shifted, d_shifted = stiffness(x + c.energy_shift, c)
        over = shifted * density / c.energy_limit - 1.0
        if over.real > 0.0:
            rate = weight * c.strain_energy_weight * over * over * over * over * over / c.energy_limit
            d_chi += rate * (d_shifted * density)
            add_stress(c, rate * shifted, log_J, iso, trace, b, M)
    return d_chi
