"""The neo-Hooke law, w = (Ī1 - 3)/2 with Ī1 = tr b̄ (Simo, Taylor & Pister 1985, doi:10.1016/0045-7825(85)90033-7).

S = b̄. The element loops have a shorter way for this law, :mod:`actuator.material.elasticity`.
"""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def energy(law, b):
    """w of b̄ (3, 3), dimensionless."""
    return 0.5 * (b[0, 0] + b[1, 1] + b[2, 2] - 3.0)


@njit(cache=True)
def stress(law, b, S):
    """Write S = b̄."""
    S[:] = b


@njit(cache=True)
def tangent(law, b, X, dS):
    """Write dS = X."""
    dS[:] = X
