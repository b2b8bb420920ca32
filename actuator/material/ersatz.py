"""Pointwise laws of the porohyperelastic ersatz material (Section 2.1 and 2.2), for real and complex arguments.

What depends on the hyperelastic law stands in :mod:`actuator.material.elasticity` and :mod:`actuator.material.laws`.

Complex arguments serve the complex-step derivative (Squire & Trapp 1998, doi:10.1137/S003614459631241X): every
function is analytic on either side of its branches, and branches look at real parts only.
"""

from __future__ import annotations

import numpy as np
from numba import njit

# Contraction to fused multiply-add is allowed; no reordering, so that results do not depend on the thread count.
FAST = {"contract", "nsz", "arcp"}
#: Q_out h² / k below which the fitting factor is summed as a series; its closed form cancels there.
SERIES = 1e-2


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


@njit(cache=True)
def log_fitted_permeability(chi, c, size_squared):
    """ln of k(χ) (s / sinh s)², s² = Q_out h² / (4 k), and its derivative, for cells of size h.

    In solid the pressure dies out over a small part of a cell. Trilinear elements then alternate in sign from vertex to
    vertex. With the drainage's matrix summed by rows and this factor, p is exact at the vertices of a line of equal
    elements for any h where χ is constant, and positive: exponential fitting (Roos, Stynes & Tobiska 2008, section
    I.2.1, doi:10.1007/978-3-540-34467-4). The factor is 1 - s²/3 for small h.
    """
    k, dk = permeability(chi, c)
    thickness = drainage(chi, c)[0] * size_squared / k  # 4 s²
    if thickness.real < SERIES:
        t = thickness
        log_factor = t * (-1.0 / 12.0 + t * (1.0 / 1440.0 + t * (-1.0 / 90720.0 + t / 4838400.0)))
        slope = -1.0 / 12.0 + t * (1.0 / 720.0 + t * (-1.0 / 30240.0 + t / 1209600.0))
    else:
        root = np.sqrt(thickness)
        e = np.exp(-root)
        log_factor = np.log(thickness) - root - 2.0 * np.log(1.0 - e)
        slope = 1.0 / thickness - (1.0 + e) / (1.0 - e) / (2.0 * root)
    change = dk / k
    return np.log(k) + log_factor, change + slope * thickness * (sigmoid(-chi) - change)


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
def push(Finv, g, out):
    """Write F⁻ᵀ g."""
    for i in range(3):
        out[i] = Finv[0, i] * g[0] + Finv[1, i] * g[1] + Finv[2, i] * g[2]


@njit(cache=True, inline="always")
def left_cauchy_green(F, b):
    """Write b = F Fᵀ and return its trace."""
    for i in range(3):
        for j in range(i, 3):
            b[i, j] = F[i, 0] * F[j, 0] + F[i, 1] * F[j, 1] + F[i, 2] * F[j, 2]
            b[j, i] = b[i, j]
    return b[0, 0] + b[1, 1] + b[2, 2]
