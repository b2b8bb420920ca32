"""The Ogden law of up to three terms (Ogden 1972, doi:10.1098/rspa.1972.0026), with μ_k scaled so that Σ μ_k = 1:

w = Σ 2 μ_k / α_k² (λ̄1^α_k + λ̄2^α_k + λ̄3^α_k - 3), so that S = Σ 2 μ_k / α_k b̄^(α_k/2).

Ogden's own constants are 2 μ_k / α_k. A complex b̄ is taken as a real matrix with a perturbation of first order, A + iB:
what the complex step asks for, and exact there. Eigenvalues may coincide (:mod:`actuator.material.spectral`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit, types
from numba.extending import overload

from actuator.material.spectral import eigen, into_frame, power_difference, power_second_difference


class Ogden(NamedTuple):
    """w = Σ 2 μ_k / α_k² (λ̄1^α_k + λ̄2^α_k + λ̄3^α_k - 3), with Σ μ_k = 1.

    Attributes:
        mu1, mu2, mu3: μ_k / G; zero for a term that is not used.
        alpha1, alpha2, alpha3: α_k, not zero.
    """

    mu1: float
    alpha1: float
    mu2: float = 0.0
    alpha2: float = 1.0
    mu3: float = 0.0
    alpha3: float = 1.0

    @classmethod
    def of(cls, mu: Sequence[float], alpha: Sequence[float]) -> Ogden:
        """The law of up to three terms.

        Raises:
            ValueError: if there are none, too many, or not as many μ as α.
        """
        most = len(cls._fields) // 2
        if len(mu) != len(alpha) or not 1 <= len(mu) <= most:
            raise ValueError(f"an Ogden law has 1 to {most} pairs of μ and α, not {len(mu)} and {len(alpha)}")
        return cls(*(float(value) for pair in zip(mu, alpha, strict=True) for value in pair))

    @property
    def terms(self) -> list[tuple[float, float]]:
        """The pairs (μ_k / G, α_k) that count."""
        pairs = [(self.mu1, self.alpha1), (self.mu2, self.alpha2), (self.mu3, self.alpha3)]
        return [pair for pair in pairs if pair[0] != 0.0]


EXAMPLE = Ogden.of([1.0], [3.0])


def _perturbed(like, value, slope):
    """value + i slope where ``like`` is complex, else value."""
    return complex(value, slope) if np.iscomplexobj(like) else value


@overload(_perturbed, inline="always")
def _choose_perturbed(like, value, slope):
    if isinstance(like, types.Complex):
        return lambda like, value, slope: complex(value, slope)
    return lambda like, value, slope: value


@njit(cache=True)
def _split(A, real, imaginary):
    for i in range(3):
        for j in range(3):
            real[i, j] = A[i, j].real
            imaginary[i, j] = A[i, j].imag


@njit(cache=True)
def _write_back(Q, real, imaginary, out):
    """Write Q (real + i imaginary) Qᵀ."""
    for i in range(3):
        for j in range(3):
            value, slope = 0.0, 0.0
            for k in range(3):
                for m in range(3):
                    value += Q[i, k] * real[k, m] * Q[j, m]
                    slope += Q[i, k] * imaginary[k, m] * Q[j, m]
            out[i, j] = _perturbed(out[i, j], value, slope)


@njit(cache=True)
def _frame(b, values, Q, B):
    """Eigenvalues and frame of the real part of b, and its imaginary part in that frame."""
    real, imaginary = np.empty((3, 3)), np.empty((3, 3))
    _split(b, real, imaginary)
    eigen(real, values, Q)
    into_frame(Q, imaginary, B)


def energy(law, b):
    """w of b̄ (3, 3), dimensionless."""
    a, Q, B = np.empty(3), np.empty((3, 3)), np.empty((3, 3))
    _frame(b, a, Q, B)
    value, slope = 0.0, 0.0
    for mu, alpha in ((law.mu1, law.alpha1), (law.mu2, law.alpha2), (law.mu3, law.alpha3)):
        if mu != 0.0:
            for i in range(3):
                value += 2.0 * mu / (alpha * alpha) * np.expm1(0.5 * alpha * np.log(a[i]))
                slope += mu / alpha * a[i] ** (0.5 * alpha - 1.0) * B[i, i]
    return _perturbed(b[0, 0], value, slope)


@njit(cache=True)
def _differences(law, a, first):
    """f[a_i, a_j] of f(x) = Σ 2 μ_k / α_k x^(α_k/2)."""
    first[:] = 0.0
    for mu, alpha in ((law.mu1, law.alpha1), (law.mu2, law.alpha2), (law.mu3, law.alpha3)):
        if mu != 0.0:
            for i in range(3):
                for j in range(3):
                    first[i, j] += 2.0 * mu / alpha * power_difference(a[min(i, j)], a[max(i, j)], 0.5 * alpha)


@njit(cache=True)
def _second_differences(law, a, second):
    """f[a_i, a_l, a_j], symmetric in its three indices."""
    second[:] = 0.0
    for mu, alpha in ((law.mu1, law.alpha1), (law.mu2, law.alpha2), (law.mu3, law.alpha3)):
        if mu != 0.0:
            for i in range(3):
                for j in range(i, 3):
                    for k in range(j, 3):
                        second[i, j, k] += 2.0 * mu / alpha * power_second_difference(a[i], a[j], a[k], 0.5 * alpha)
    for i in range(3):
        for j in range(3):
            for k in range(3):
                low, high = min(i, j, k), max(i, j, k)
                second[i, j, k] = second[low, i + j + k - low - high, high]


def stress(law, b, S):
    """Write S (3, 3) of b̄."""
    a, Q, B, first = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    _frame(b, a, Q, B)
    _differences(law, a, first)
    value = np.zeros((3, 3))
    for mu, alpha in ((law.mu1, law.alpha1), (law.mu2, law.alpha2), (law.mu3, law.alpha3)):
        if mu != 0.0:
            for i in range(3):
                value[i, i] += 2.0 * mu / alpha * a[i] ** (0.5 * alpha)
    for i in range(3):
        for j in range(3):
            B[i, j] *= first[i, j]
    _write_back(Q, value, B, S)


def tangent(law, b, X, dS):
    """Write dS (m, 3, 3) along X; a complex b̄ or X adds the second derivative along Im b̄."""
    a, Q, B, first = np.empty(3), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    second = np.empty((3, 3, 3))
    _frame(b, a, Q, B)
    _differences(law, a, first)
    perturbed = b.itemsize == 16  # complex
    if perturbed:
        _second_differences(law, a, second)
    real, imaginary, Y, Z = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(X)):
        _split(X[m], real, imaginary)
        into_frame(Q, real, Y)
        into_frame(Q, imaginary, Z)
        for i in range(3):
            for j in range(3):
                real[i, j] = first[i, j] * Y[i, j]
                value = first[i, j] * Z[i, j]
                if perturbed:
                    for k in range(3):
                        value += second[i, k, j] * (Y[i, k] * B[k, j] + B[i, k] * Y[k, j])
                imaginary[i, j] = value
        _write_back(Q, real, imaginary, dS[m])
