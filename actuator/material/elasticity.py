"""What the element loops need of a hyperelastic law, compiled into them for the type of the coefficients.

Ψ = K/2 (ln J)² + G w(b̄), both moduli scaled by Eq. (2), has the Kirchhoff stress τ = (K ln J - J p) I + G dev S(b̄) with
b̄ = J^(-2/3) b, b = F Fᵀ and S of :mod:`actuator.material.laws`. For the variation δF = h F

    δb̄ = h b̄ + b̄ hᵀ - 2/3 tr(h) b̄,    δτ = (K - J p) tr(h) I + G dev dS[δb̄],    M(h) = δτ - τ hᵀ,

and M F⁻ᵀ is the variation of the first Piola-Kirchhoff stress; M(h) : h' is symmetric in h and h'.

Each function comes twice: ``_of_neo_hooke`` in closed form, the paper's law (Simo, Taylor & Pister 1985,
doi:10.1016/0045-7825(85)90033-7), and ``_of_any_law`` through energy, stress and tangent of the law. Arguments: ``c``
is the tuple of coefficients, ``factor`` the scale of both moduli, ``iso`` = J^(-2/3), ``trace`` = tr b, ``Jp`` = J p.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numba.extending import overload

from actuator.material.ersatz import FAST, push
from actuator.material.laws.coefficients import NeoHooke
from actuator.material.laws.pointwise import energy, stress, tangent


def _chosen(kind, of_neo_hooke, of_any_law):
    """The implementation for a type of coefficients."""
    return of_neo_hooke if kind.law is NeoHooke else of_any_law


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


# ------------------------------------------------------------------------------------------------------ energy


def energy_density(c, log_J, iso, trace, b):
    """Ψ at full stiffness, N/mm²."""
    return _chosen(type(c), _energy_of_neo_hooke, _energy_of_any_law)(c, log_J, iso, trace, b)


def _energy_of_neo_hooke(c, log_J, iso, trace, b):
    return 0.5 * c.bulk * log_J * log_J + 0.5 * c.shear * (iso * trace - 3.0)


def _energy_of_any_law(c, log_J, iso, trace, b):
    return 0.5 * c.bulk * log_J * log_J + c.shear * energy(c, iso * b)


@overload(energy_density, inline="always")
def _choose_energy(c, log_J, iso, trace, b):
    return _chosen(c.instance_class, _energy_of_neo_hooke, _energy_of_any_law)


# ------------------------------------------------------------------------------------------------------ stress


def kirchhoff_stress(c, factor, spherical, log_J, trace, b):
    """Write τ = spherical I + factor G dev S over b, N/mm²."""
    return _chosen(type(c), _kirchhoff_of_neo_hooke, _kirchhoff_of_any_law)(c, factor, spherical, log_J, trace, b)


def _kirchhoff_of_neo_hooke(c, factor, spherical, log_J, trace, b):
    G = factor * c.shear * np.exp(-2.0 / 3.0 * log_J)
    for i in range(3):
        for j in range(3):
            b[i, j] *= G
        b[i, i] += spherical - G * trace / 3.0


def _kirchhoff_of_any_law(c, factor, spherical, log_J, trace, b):
    S = np.empty_like(b)
    isochoric_stress(c, np.exp(-2.0 / 3.0 * log_J), b, S)
    for i in range(3):
        for j in range(3):
            b[i, j] = factor * c.shear * S[i, j]
        b[i, i] += spherical


@overload(kirchhoff_stress, inline="always")
def _choose_kirchhoff(c, factor, spherical, log_J, trace, b):
    return _chosen(c.instance_class, _kirchhoff_of_neo_hooke, _kirchhoff_of_any_law)


def add_stress(c, factor, log_J, iso, trace, b, M):
    """Add factor τ without pressure to M, N/mm²."""
    return _chosen(type(c), _add_stress_of_neo_hooke, _add_stress_of_any_law)(c, factor, log_J, iso, trace, b, M)


def _add_stress_of_neo_hooke(c, factor, log_J, iso, trace, b, M):
    G = factor * c.shear * iso
    for i in range(3):
        for j in range(3):
            M[i, j] += G * b[i, j]
        M[i, i] += factor * c.bulk * log_J - G * trace / 3.0


def _add_stress_of_any_law(c, factor, log_J, iso, trace, b, M):
    S = np.empty_like(b)
    isochoric_stress(c, iso, b, S)
    for i in range(3):
        for j in range(3):
            M[i, j] += factor * c.shear * S[i, j]
        M[i, i] += factor * c.bulk * log_J


@overload(add_stress, inline="always")
def _choose_add_stress(c, factor, log_J, iso, trace, b, M):
    return _chosen(c.instance_class, _add_stress_of_neo_hooke, _add_stress_of_any_law)


# ----------------------------------------------------------------------------------------------------- tangent


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


def contraction(c, factor, Jp, log_J, iso, trace, b, h, div, M):
    """Write M(h) (3, 3) and return the derivative of τ : h with respect to ``factor``, N/mm²; ``div`` = tr h."""
    return _chosen(type(c), _contraction_of_neo_hooke, _contraction_of_any_law)(
        c, factor, Jp, log_J, iso, trace, b, h, div, M
    )


def _contraction_of_neo_hooke(c, factor, Jp, log_J, iso, trace, b, h, div, M):
    G = factor * c.shear * iso
    b_h = 0.0 * div
    for i in range(3):
        for j in range(3):
            b_h += b[i, j] * h[i, j]
    dev_h = b_h - trace * div / 3.0  # dev(b) : h
    spherical = factor * c.bulk * log_J - Jp
    isotropic = (factor * c.bulk - Jp) * div - 2.0 / 3.0 * G * dev_h
    for i in range(3):
        for j in range(3):
            # (h + hᵀ - 2/3 div) b̄ - hᵀ τ, with τ = b̄ + (spherical - G tr b / 3) I
            value = -h[j, i] * (spherical - G * trace / 3.0)
            for k in range(3):
                value += h[i, k] * G * b[k, j]
            M[i, j] = value - 2.0 / 3.0 * div * G * b[i, j]
        M[i, i] += isotropic
    return c.bulk * log_J * div + c.shear * iso * dev_h


def _contraction_of_any_law(c, factor, Jp, log_J, iso, trace, b, h, div, M):
    S = np.empty_like(b)
    contractions(c, factor, Jp, log_J, iso, b, h.reshape((1, 3, 3)), M.reshape((1, 3, 3)), S)
    S_h = 0.0 * div
    for i in range(3):
        for j in range(3):
            S_h += S[i, j] * h[i, j]
    return c.bulk * log_J * div + c.shear * S_h


@overload(contraction, inline="always")
def _choose_contraction(c, factor, Jp, log_J, iso, trace, b, h, div, M):
    return _chosen(c.instance_class, _contraction_of_neo_hooke, _contraction_of_any_law)


def mechanical_block(c, dx, factor, Jp, log_J, trace, b, Finv, gradient20, n, m, left, right, geometric, K):
    """Add dx n_a · M(e_k ⊗ n_d) to the 3 x 3 blocks of the node pairs a <= d.

    Args:
        dx: weight of the quadrature point, mm³.
        n: F⁻ᵀ ∇N_a, (20, 3), 1/mm.
        m, left, right, geometric: room to work in, (20, 3).
        K: packed block, (1890,), N/mm, as :data:`actuator.equations.tangent_kernels.PACKED` says.
    """
    return _chosen(type(c), _block_of_neo_hooke, _block_of_any_law)(
        c, dx, factor, Jp, log_J, trace, b, Finv, gradient20, n, m, left, right, geometric, K
    )


def _block_of_neo_hooke(c, dx, factor, Jp, log_J, trace, b, Finv, gradient20, n, m, left, right, geometric, K):
    G = factor * c.shear * np.exp(-2.0 / 3.0 * log_J)
    # With m_a = b̄ n_a the tangent is
    #   c1 n_a⊗n_b + c2 n_b⊗n_a - 2/3 (m_a⊗n_b + n_a⊗m_b) + (n_a·m_b) I
    c1 = dx * (factor * c.bulk - Jp + 2.0 / 9.0 * G * trace)
    c2 = dx * (G * trace / 3.0 - factor * c.bulk * log_J + Jp)
    for a in range(20):
        push(Finv, gradient20[a], n[a])
        for i in range(3):
            m[a, i] = dx * G * (b[i, 0] * n[a, 0] + b[i, 1] * n[a, 1] + b[i, 2] * n[a, 2])
        for i in range(3):
            left[a, i] = c1 * n[a, i] - 2.0 / 3.0 * m[a, i]
            right[a, i] = -2.0 / 3.0 * m[a, i]
            geometric[a, i] = c2 * n[a, i]
    k = 0
    for a in range(20):
        n0, n1, n2 = n[a, 0], n[a, 1], n[a, 2]
        l0, l1, l2 = left[a, 0], left[a, 1], left[a, 2]
        g0, g1, g2 = geometric[a, 0], geometric[a, 1], geometric[a, 2]
        for d in range(a, 20):
            r0, r1, r2 = right[d, 0], right[d, 1], right[d, 2]
            d0, d1, d2 = n[d, 0], n[d, 1], n[d, 2]
            dot = n0 * m[d, 0] + n1 * m[d, 1] + n2 * m[d, 2]
            K[k] += l0 * d0 + n0 * r0 + d0 * g0 + dot
            K[k + 1] += l0 * d1 + n0 * r1 + d0 * g1
            K[k + 2] += l0 * d2 + n0 * r2 + d0 * g2
            K[k + 3] += l1 * d0 + n1 * r0 + d1 * g0
            K[k + 4] += l1 * d1 + n1 * r1 + d1 * g1 + dot
            K[k + 5] += l1 * d2 + n1 * r2 + d1 * g2
            K[k + 6] += l2 * d0 + n2 * r0 + d2 * g0
            K[k + 7] += l2 * d1 + n2 * r1 + d2 * g1
            K[k + 8] += l2 * d2 + n2 * r2 + d2 * g2 + dot
            k += 9


def _block_of_any_law(c, dx, factor, Jp, log_J, trace, b, Finv, gradient20, n, m, left, right, geometric, K):
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


@overload(mechanical_block, inline="always")
def _choose_block(c, dx, factor, Jp, log_J, trace, b, Finv, gradient20, n, m, left, right, geometric, K):
    return _chosen(c.instance_class, _block_of_neo_hooke, _block_of_any_law)
