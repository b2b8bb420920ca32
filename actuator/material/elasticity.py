"""What the element loops need of a hyperelastic law, compiled into them for the type of the constants.

Ψ = K/2 (ln J)² + G w(b̄), both moduli scaled by Eq. (2), has the Kirchhoff stress τ = (K ln J - J p) I + G dev S(b̄) with
b̄ = J^(-2/3) b, b = F Fᵀ and S of :mod:`actuator.material.laws`. For the variation δF = h F

    δb̄ = h b̄ + b̄ hᵀ - 2/3 tr(h) b̄,    δτ = (K - J p) tr(h) I + G dev dS[δb̄],    M(h) = δτ - τ hᵀ,

and M F⁻ᵀ is the variation of the first Piola-Kirchhoff stress; M(h) : h' is symmetric in h and h'.

Each function stands here as it is for any law, through the law's energy, stress and tangent. A law that has a shorter
way has a function of the same name in its own file. Arguments: ``c`` is the tuple of constants, ``factor`` the scale of
both moduli, ``iso`` = J^(-2/3), ``trace`` = tr b, ``Jp`` = J p.
"""

from __future__ import annotations

from functools import wraps

import numpy as np
from numba import njit
from numba.extending import overload

from actuator.material.constants import law_file
from actuator.material.ersatz import FAST, push
from actuator.material.pointwise import energy, stress, tangent


def by_law(general):
    """Choose the function of that name in the law's file, else ``general``, by the type of the first argument."""

    def of(kind):
        return getattr(law_file(kind), general.__name__, general)

    @wraps(general)
    def function(c, *others):
        return of(type(c))(c, *others)

    @wraps(general)
    def compiled(c, *others):
        return of(c.instance_class)

    overload(function, inline="always")(compiled)
    return function


@njit(cache=True, inline="always")
def deviatoric(A):
    """Take the mean of the diagonal off a (3, 3) matrix."""
    mean = (A[0, 0] + A[1, 1] + A[2, 2]) / 3.0
    for i in range(3):
        A[i, i] -= mean


@njit(cache=True)
def isochoric_stress(c, iso, b, S):
    """Write dev S(b̄), the isochoric Kirchhoff stress over G, and return b̄."""
    isochoric = iso * b
    stress(c, isochoric, S)
    deviatoric(S)
    return isochoric


@by_law
def energy_density(c, log_J, iso, trace, b):
    """Ψ at full stiffness, N/mm²."""
    return 0.5 * c.bulk * log_J * log_J + c.shear * energy(c, iso * b)


@by_law
def kirchhoff_stress(c, factor, spherical, log_J, trace, b):
    """Write τ = spherical I + factor G dev S over b, N/mm²."""
    S = np.empty_like(b)
    isochoric_stress(c, np.exp(-2.0 / 3.0 * log_J), b, S)
    for i in range(3):
        for j in range(3):
            b[i, j] = factor * c.shear * S[i, j]
        b[i, i] += spherical


@by_law
def add_stress(c, factor, log_J, iso, trace, b, M):
    """Add factor τ without pressure to M, N/mm²."""
    S = np.empty_like(b)
    isochoric_stress(c, iso, b, S)
    for i in range(3):
        for j in range(3):
            M[i, j] += factor * c.shear * S[i, j]
        M[i, i] += factor * c.bulk * log_J


@njit(cache=True)
def contractions(c, factor, Jp, log_J, iso, b, h, M, S):
    """Write M(h) of m variations at once, N/mm², and dev S, dimensionless, of any law.

    Args:
        h, M: (m, 3, 3).
        S: (3, 3).
    """
    bulk, G = factor * c.bulk, factor * c.shear
    isochoric = isochoric_stress(c, iso, b, S)
    X = np.empty_like(h)
    for m in range(len(h)):
        div = h[m, 0, 0] + h[m, 1, 1] + h[m, 2, 2]
        for i in range(3):
            for j in range(i, 3):
                value = -2.0 / 3.0 * div * isochoric[i, j]
                for k in range(3):
                    value += h[m, i, k] * isochoric[k, j] + isochoric[i, k] * h[m, j, k]
                X[m, i, j] = value
                X[m, j, i] = value
    tangent(c, isochoric, X, M)
    spherical = bulk * log_J - Jp
    for m in range(len(h)):
        deviatoric(M[m])
        div = h[m, 0, 0] + h[m, 1, 1] + h[m, 2, 2]
        for i in range(3):
            for j in range(3):
                value = M[m, i, j] - S[i, 0] * h[m, j, 0] - S[i, 1] * h[m, j, 1] - S[i, 2] * h[m, j, 2]
                M[m, i, j] = G * value - spherical * h[m, j, i]
            M[m, i, i] += (bulk - Jp) * div


@by_law
def contraction(c, factor, Jp, log_J, iso, trace, b, h, div, M):
    """Write M(h) (3, 3) and return the derivative of τ : h with respect to ``factor``, N/mm²; ``div`` = tr h."""
    S = np.empty_like(b)
    contractions(c, factor, Jp, log_J, iso, b, h.reshape((1, 3, 3)), M.reshape((1, 3, 3)), S)
    S_h = 0.0 * div
    for i in range(3):
        for j in range(3):
            S_h += S[i, j] * h[i, j]
    return c.bulk * log_J * div + c.shear * S_h


@by_law
def mechanical_block(c, dx, factor, Jp, log_J, trace, b, Finv, gradient20, n, m, left, right, geometric, K):
    """Add dx n_a · M(e_k ⊗ n_d) to the 3 x 3 blocks of the node pairs a <= d.

    Args:
        dx: weight of the quadrature point, mm³.
        n: F⁻ᵀ ∇N_a, (20, 3), 1/mm.
        m, left, right, geometric: room to work in, (20, 3).
        K: packed block, (1890,), N/mm, as :data:`actuator.equations.tangent_kernels.PACKED` says.
    """
    for a in range(20):
        push(Finv, gradient20[a], n[a])
    add_block(c, dx, factor, Jp, log_J, b, n, K)


@njit(cache=True, fastmath=FAST)
def add_block(c, dx, factor, Jp, log_J, b, n, K):
    """:func:`mechanical_block` of any law: M(e_k ⊗ e_s) once, then n_a and n_d from both sides."""
    h, M, S, A = np.zeros((9, 3, 3)), np.empty((9, 3, 3)), np.empty((3, 3)), np.empty((3, 3, 3))
    for k in range(3):
        for s in range(3):
            h[3 * k + s, k, s] = dx
    contractions(c, factor, Jp, log_J, np.exp(-2.0 / 3.0 * log_J), b, h, M, S)
    for d in range(20):
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    value = 0.0
                    for s in range(3):
                        value += M[3 * k + s, i, j] * n[d, s]
                    A[i, k, j] = value
        at = 9 * d
        for a in range(d + 1):
            n0, n1, n2 = n[a, 0], n[a, 1], n[a, 2]
            for i in range(3):
                for k in range(3):
                    K[at + 3 * i + k] += A[i, k, 0] * n0 + A[i, k, 1] * n1 + A[i, k, 2] * n2
            at += 9 * (19 - a)
