"""Pointwise laws of the porohyperelastic ersatz material (Section 2.1 and 2.2), for real and complex arguments.

Complex arguments serve the complex-step derivative (Squire & Trapp 1998, doi:10.1137/S003614459631241X): every
function is analytic on either side of its branches, and branches look at real parts only.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from actuator.parameters import Load, Material, Objective


class Coefficients(NamedTuple):
    """The constants of the laws, as the compiled kernels take them. Units as in :mod:`actuator.parameters`."""

    bulk: float
    shear: float
    ramp_penalty: float
    stiffness_contrast: float
    void_permeability: float
    solid_permeability: float
    drainage: float
    hessian_penalty: float
    pressure: float
    strain_energy_weight: float
    energy_limit: float
    energy_shift: float

    @classmethod
    def of(cls, material: Material, load: Load, objective: Objective) -> Coefficients:
        """Collect the constants; the shift of χ in C_Ψ is 4 / L_i (Eq. 13)."""
        values = [getattr(material, name) for name in cls._fields[:8]]
        values += [load.pressure, objective.strain_energy_weight, objective.energy_limit]
        return cls._make(float(value) for value in (*values, 4.0 / objective.interface_width))


@njit(cache=True, inline="always")
def sigmoid(chi):
    """ρ(χ) of Eq. (1), without overflow."""
    if chi.real >= 0.0:
        return 1.0 / (1.0 + np.exp(-chi))
    e = np.exp(chi)
    return e / (1.0 + e)


@njit(cache=True, inline="always")
def stiffness(chi, c):
    """RAMP factor of Eq. (2) and its derivative with respect to χ."""
    rho, void = sigmoid(chi), sigmoid(-chi)
    d = 1.0 + c.ramp_penalty * void
    scale = 1.0 - c.stiffness_contrast
    return c.stiffness_contrast + scale * rho / d, scale * (1.0 + c.ramp_penalty) * rho * void / (d * d)


@njit(cache=True, inline="always")
def permeability(chi, c):
    """k(χ) of Eq. (3) in mm⁴/(N s) and its derivative; written so that it does not cancel in the solid."""
    void = sigmoid(-chi - 8.0)
    span = c.void_permeability - c.solid_permeability
    return c.solid_permeability + span * void, -span * void * sigmoid(chi + 8.0)


@njit(cache=True, inline="always")
def drainage(chi, c):
    """Q_out(χ) of Eq. (4) in mm²/(N s) and its derivative."""
    rho = sigmoid(chi)
    return c.drainage * rho, c.drainage * rho * sigmoid(-chi)


@njit(cache=True, inline="always")
def inverse(F, Finv):
    """Write the inverse of a 3 x 3 matrix into ``Finv`` and return the determinant."""
    Finv[0, 0] = F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1]
    Finv[0, 1] = F[0, 2] * F[2, 1] - F[0, 1] * F[2, 2]
    Finv[0, 2] = F[0, 1] * F[1, 2] - F[0, 2] * F[1, 1]
    Finv[1, 0] = F[1, 2] * F[2, 0] - F[1, 0] * F[2, 2]
    Finv[1, 1] = F[0, 0] * F[2, 2] - F[0, 2] * F[2, 0]
    Finv[1, 2] = F[0, 2] * F[1, 0] - F[0, 0] * F[1, 2]
    Finv[2, 0] = F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0]
    Finv[2, 1] = F[0, 1] * F[2, 0] - F[0, 0] * F[2, 1]
    Finv[2, 2] = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
    J = F[0, 0] * Finv[0, 0] + F[0, 1] * Finv[1, 0] + F[0, 2] * Finv[2, 0]
    for i in range(3):
        for j in range(3):
            Finv[i, j] /= J
    return J


@njit(cache=True, inline="always")
def left_cauchy_green(F, b):
    """Write b = F Fᵀ and return its trace."""
    for i in range(3):
        for j in range(i, 3):
            b[i, j] = F[i, 0] * F[j, 0] + F[i, 1] * F[j, 1] + F[i, 2] * F[j, 2]
            b[j, i] = b[i, j]
    return b[0, 0] + b[1, 1] + b[2, 2]


@njit(cache=True, inline="always")
def energy(factor, log_J, isochoric_trace, c):
    """Ψ of the neo-Hooke law of Simo, Taylor & Pister (1985, doi:10.1016/0045-7825(85)90033-7), N/mm².

    Ψ = K/2 (ln J)² + G/2 (J^(-2/3) tr b - 3), both moduli scaled by ``factor``.
    """
    return factor * (0.5 * c.bulk * log_J * log_J + 0.5 * c.shear * (isochoric_trace - 3.0))
