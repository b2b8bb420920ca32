"""The Mooney-Rivlin law (Mooney 1940, doi:10.1063/1.1712836; Rivlin 1948, doi:10.1098/rsta.1948.0024).

w = C10 (Ī1 - 3) + C01 (Ī2 - 3) with Ī1 = tr b̄, Ī2 = (Ī1² - tr b̄²)/2 and C10 + C01 = 1/2, so that

    S = 2 C10 b̄ + 2 C01 (Ī1 b̄ - b̄²).
"""

from __future__ import annotations

from typing import NamedTuple


class MooneyRivlin(NamedTuple):
    """w = C10 (Ī1 - 3) + C01 (Ī2 - 3), with C10 = 1/2 - C01.

    Attributes:
        c01: C01 / G.
    """

    c01: float


EXAMPLE = MooneyRivlin(0.1)


def energy(law, b):
    """w of b̄ (3, 3), dimensionless."""
    first = b[0, 0] + b[1, 1] + b[2, 2]
    second = 0.5 * first * first
    for i in range(3):
        for j in range(3):
            second -= 0.5 * b[i, j] * b[j, i]
    return (0.5 - law.c01) * (first - 3.0) + law.c01 * (second - 3.0)


def stress(law, b, S):
    """Write S (3, 3) of b̄."""
    first = b[0, 0] + b[1, 1] + b[2, 2]
    factor = 1.0 - 2.0 * law.c01 + 2.0 * law.c01 * first
    for i in range(3):
        for j in range(3):
            square = b[i, 0] * b[0, j] + b[i, 1] * b[1, j] + b[i, 2] * b[2, j]
            S[i, j] = factor * b[i, j] - 2.0 * law.c01 * square


def tangent(law, b, X, dS):
    """Write dS (m, 3, 3) along X: 2 C10 X + 2 C01 (tr(X) b̄ + Ī1 X - X b̄ - b̄ X)."""
    first = b[0, 0] + b[1, 1] + b[2, 2]
    factor = 1.0 - 2.0 * law.c01 + 2.0 * law.c01 * first
    for m in range(len(X)):
        trace = X[m, 0, 0] + X[m, 1, 1] + X[m, 2, 2]
        for i in range(3):
            for j in range(3):
                product = 0.0 * trace
                for k in range(3):
                    product += X[m, i, k] * b[k, j] + b[i, k] * X[m, k, j]
                dS[m, i, j] = factor * X[m, i, j] + 2.0 * law.c01 * (trace * b[i, j] - product)
