"""The neo-Hooke law, w = (Ī1 - 3)/2 with Ī1 = tr b̄ (Simo, Taylor & Pister 1985, doi:10.1016/0045-7825(85)90033-7).

S = b̄, so that what the element loops ask for has the closed forms below, the paper's law.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class NeoHooke(NamedTuple):
    """w = (Ī1 - 3)/2; nothing to choose."""


EXAMPLE = NeoHooke()


def energy(law, b):
    """w of b̄ (3, 3), dimensionless."""
    return 0.5 * (b[0, 0] + b[1, 1] + b[2, 2] - 3.0)


def stress(law, b, S):
    """Write S = b̄."""
    S[:] = b


def tangent(law, b, X, dS):
    """Write dS = X."""
    dS[:] = X


# ------------------------------------------- closed forms, in place of those of :mod:`actuator.material.elasticity`


def energy_density(c, log_J, iso, trace, b):
    """Ψ at full stiffness, N/mm²."""
    return 0.5 * c.bulk * log_J * log_J + 0.5 * c.shear * (iso * trace - 3.0)


def kirchhoff_stress(c, factor, spherical, log_J, trace, b):
    """Write τ over b, N/mm²."""
    G = factor * c.shear * np.exp(-2.0 / 3.0 * log_J)
    for i in range(3):
        for j in range(3):
            b[i, j] *= G
        b[i, i] += spherical - G * trace / 3.0


def add_stress(c, factor, log_J, iso, trace, b, M):
    """Add factor τ without pressure to M, N/mm²."""
    G = factor * c.shear * iso
    for i in range(3):
        for j in range(3):
            M[i, j] += G * b[i, j]
        M[i, i] += factor * c.bulk * log_J - G * trace / 3.0


def contraction(c, factor, Jp, log_J, iso, trace, b, h, div, M):
    """Write M(h) and return the derivative of τ : h with respect to ``factor``, N/mm²."""
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


def mechanical_block(c, dx, factor, Jp, log_J, trace, b, Finv, gradient20, n, m, left, right, geometric, K):
    """Add dx n_a · M(e_k ⊗ n_d) to the 3 x 3 blocks of the node pairs a <= d."""
    G = factor * c.shear * np.exp(-2.0 / 3.0 * log_J)
    # With m_a = b̄ n_a the tangent is
    #   c1 n_a⊗n_b + c2 n_b⊗n_a - 2/3 (m_a⊗n_b + n_a⊗m_b) + (n_a·m_b) I
    c1 = dx * (factor * c.bulk - Jp + 2.0 / 9.0 * G * trace)
    c2 = dx * (G * trace / 3.0 - factor * c.bulk * log_J + Jp)
    for a in range(20):
        g = gradient20[a]
        for i in range(3):
            n[a, i] = Finv[0, i] * g[0] + Finv[1, i] * g[1] + Finv[2, i] * g[2]
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
