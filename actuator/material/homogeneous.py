"""Homogeneous deformations of an incompressible solid: the uniaxial test, and stability along the standard tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from actuator.material.constants import constants_of_law
from actuator.material.pointwise import stress, tangent

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from actuator.parameters import Law

#: Principal stretches λ^e of the standard tests: exponents e of the driven stretch λ.
TESTS = {
    "uniaxial tension": (1.0, -0.5, -0.5),
    "uniaxial compression": (-1.0, 0.5, 0.5),
    "planar tension": (1.0, 0.0, -1.0),
}


@njit(cache=True)
def _principal(c, stretches, S, D):
    b, A = np.zeros((3, 3)), np.empty((3, 3))
    X, dA = np.zeros((3, 3, 3)), np.empty((3, 3, 3))
    for q in range(len(stretches)):
        for i in range(3):
            b[i, i] = stretches[q, i] ** 2
            X[i, i, i] = 2.0 * b[i, i]  # ∂b̄/∂ln λ_i
        stress(c, b, A)
        tangent(c, b, X, dA)
        for i in range(3):
            S[q, i] = A[i, i]
            for j in range(3):
                D[q, i, j] = dA[j, i, i]


def principal_stresses(law: Law, stretches: Floats) -> tuple[Floats, Floats]:
    """S_i over G at principal stretches (n, 3) of product 1, (n, 3), and ∂S_i/∂ln λ_j, (n, 3, 3); dimensionless.

    Cauchy stresses of the incompressible solid are G S_i plus a pressure.
    """
    S, D = np.empty_like(stretches), np.empty((*stretches.shape, 3))
    _principal(constants_of_law(law), np.ascontiguousarray(stretches, dtype=np.float64), S, D)
    return S, D


def stretches_of(test: str, driven: Floats) -> Floats:
    """Principal stretches (n, 3) of a test of :data:`TESTS` at driven stretches λ >= 1, (n,)."""
    return np.asarray(driven)[:, None] ** np.array(TESTS[test])


def uniaxial_stress(law: Law, stretch: Floats) -> Floats:
    """Engineering stress over G at stretches λ (n,) of an incompressible bar with free sides: (S_1 - S_2)/λ."""
    S, _ = principal_stresses(law, stretches_of("uniaxial tension", stretch))
    return (S[:, 0] - S[:, 1]) / stretch


def stability(law: Law, test: str, driven: Floats) -> Floats:
    """Smallest eigenvalue of the incremental stiffness over G along a test, (n,); Drucker asks for positive ones.

    It is that of the second derivative of w with respect to two logarithmic principal strains, the third following
    from incompressibility (Drucker 1959, doi:10.1115/1.4011929, dτ : dε > 0). The initial value is 2.
    """
    _, D = principal_stresses(law, stretches_of(test, driven))
    free = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, -1.0]])
    return np.linalg.eigvalsh(free.T @ D @ free)[:, 0]
