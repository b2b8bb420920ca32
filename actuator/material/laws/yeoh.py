"""The Yeoh law of three terms (Yeoh 1993, doi:10.5254/1.3538343).

w = C1 x + C2 x² + C3 x³ with x = Ī1 - 3 and C1 = 1/2, so that S = 2 w'(x) b̄.
"""

from __future__ import annotations

from typing import NamedTuple


class Yeoh(NamedTuple):
    """w = C1 (Ī1 - 3) + C2 (Ī1 - 3)² + C3 (Ī1 - 3)³, with C1 = 1/2.

    Attributes:
        c2, c3: C2 / G and C3 / G.
    """

    c2: float
    c3: float


EXAMPLE = Yeoh(0.01, 0.001)


def energy(law, b):
    """w of b̄ (3, 3), dimensionless."""
    x = b[0, 0] + b[1, 1] + b[2, 2] - 3.0
    return x * (0.5 + x * (law.c2 + x * law.c3))


def stress(law, b, S):
    """Write S (3, 3) of b̄."""
    x = b[0, 0] + b[1, 1] + b[2, 2] - 3.0
    factor = 1.0 + x * (4.0 * law.c2 + 6.0 * law.c3 * x)
    for i in range(3):
        for j in range(3):
            S[i, j] = factor * b[i, j]


def tangent(law, b, X, dS):
    """Write dS (m, 3, 3) along X: 2 w' X + 2 w'' tr(X) b̄."""
    x = b[0, 0] + b[1, 1] + b[2, 2] - 3.0
    factor = 1.0 + x * (4.0 * law.c2 + 6.0 * law.c3 * x)
    for m in range(len(X)):
        slope = (4.0 * law.c2 + 12.0 * law.c3 * x) * (X[m, 0, 0] + X[m, 1, 1] + X[m, 2, 2])
        for i in range(3):
            for j in range(3):
                dS[m, i, j] = factor * X[m, i, j] + slope * b[i, j]
