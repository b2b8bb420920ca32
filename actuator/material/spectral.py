"""Powers of symmetric 3 x 3 matrices and their first two derivatives, also where eigenvalues coincide.

In the frame of the eigenvectors of A, with eigenvalues a_i, a function f has the derivatives (Daleckii & Krein 1965;
Higham 2008, Functions of Matrices, doi:10.1137/1.9780898717778, ch. 3)

    Df[X]_ij = f[a_i, a_j] X_ij
    D²f[X, B]_ij = Σ_l f[a_i, a_l, a_j] (X_il B_lj + B_il X_lj)

with divided differences f[·,·], which are smooth in the eigenvalues and computed here without cancellation.
"""

from __future__ import annotations

import numpy as np
from numba import njit

SWEEPS = 12
#: Relative spread of three eigenvalues below which f[a, b, c] is summed as a series about their mean.
CLOSE = 0.1
TERMS = 18


@njit(cache=True)
def eigen(A, values, vectors):
    """Eigenvalues (3,) and eigenvectors (columns of (3, 3)) of a real symmetric matrix, by Jacobi's rotations.

    Golub & Van Loan 2013, Matrix Computations, sec. 8.5. ``A`` is destroyed.
    """
    vectors[:] = 0.0
    for i in range(3):
        vectors[i, i] = 1.0
    for _ in range(SWEEPS):
        off = A[0, 1] * A[0, 1] + A[0, 2] * A[0, 2] + A[1, 2] * A[1, 2]
        if off <= 1e-36 * (A[0, 0] * A[0, 0] + A[1, 1] * A[1, 1] + A[2, 2] * A[2, 2]):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if A[p, q] == 0.0:
                    continue
                slope = (A[q, q] - A[p, p]) / (2.0 * A[p, q])
                t = 1.0 / (abs(slope) + np.sqrt(1.0 + slope * slope))
                if slope < 0.0:
                    t = -t
                c = 1.0 / np.sqrt(1.0 + t * t)
                s = t * c
                for k in range(3):
                    x, y = A[k, p], A[k, q]
                    A[k, p], A[k, q] = c * x - s * y, s * x + c * y
                for k in range(3):
                    x, y = A[p, k], A[q, k]
                    A[p, k], A[q, k] = c * x - s * y, s * x + c * y
                    x, y = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * x - s * y, s * x + c * y
                A[p, q] = A[q, p] = 0.0
    for i in range(3):
        values[i] = A[i, i]


@njit(cache=True)
def into_frame(Q, A, out):
    """Write Qᵀ A Q for real (3, 3) matrices."""
    for i in range(3):
        for j in range(3):
            value = 0.0
            for k in range(3):
                for m in range(3):
                    value += Q[k, i] * A[k, m] * Q[m, j]
            out[i, j] = value


@njit(cache=True)
def power_difference(a, b, s):
    """f[a, b] of f(x) = x^s for positive a and b."""
    x = (b - a) / a
    ratio = s if x == 0.0 else np.expm1(s * np.log1p(x)) / x
    return a ** (s - 1.0) * ratio


@njit(cache=True)
def power_second_difference(a, b, c, s):
    """f[a, b, c] of f(x) = x^s for positive arguments."""
    low, high = min(a, b, c), max(a, b, c)
    mean = (a + b + c) / 3.0
    if high - low > CLOSE * mean:
        middle = max(min(a, b), min(max(a, b), c))
        return (power_difference(middle, high, s) - power_difference(low, middle, s)) / (high - low)
    # Σ f⁽ⁿ⁾(m)/n! h_(n-2), with h the complete symmetric polynomials of the distances from the mean m, whose sum is 0.
    a, b, c = (a - mean) / mean, (b - mean) / mean, (c - mean) / mean
    e2, e3 = a * b + b * c + c * a, a * b * c
    h0, h1, h2 = 1.0, 0.0, -e2
    binomial = s * (s - 1.0) / 2.0
    total = 0.0
    for n in range(2, TERMS):
        total += binomial * h0
        binomial *= (s - n) / (n + 1.0)
        h0, h1, h2 = h1, h2, e3 * h0 - e2 * h1
    return mean ** (s - 2.0) * total
