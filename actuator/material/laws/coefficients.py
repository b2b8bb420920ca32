"""Coefficients of the laws, as ratios to the initial shear modulus G; dimensionless. Free of compiled code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

#: Terms that the compiled Ogden law holds.
MOST_TERMS = 3


class NeoHooke(NamedTuple):
    """w = (Ī1 - 3)/2; nothing to choose."""


#: The default, and the paper's law.
NEO_HOOKE = NeoHooke()


class MooneyRivlin(NamedTuple):
    """w = C10 (Ī1 - 3) + C01 (Ī2 - 3), with C10 = 1/2 - C01.

    Attributes:
        c01: C01 / G.
    """

    c01: float


class Yeoh(NamedTuple):
    """w = C1 (Ī1 - 3) + C2 (Ī1 - 3)² + C3 (Ī1 - 3)³, with C1 = 1/2.

    Attributes:
        c2, c3: C2 / G and C3 / G.
    """

    c2: float
    c3: float


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
        """The law of up to :data:`MOST_TERMS` terms.

        Raises:
            ValueError: if there are none, too many, or not as many μ as α.
        """
        if len(mu) != len(alpha) or not 1 <= len(mu) <= MOST_TERMS:
            raise ValueError(f"an Ogden law has 1 to {MOST_TERMS} pairs of μ and α, not {len(mu)} and {len(alpha)}")
        return cls(*(float(value) for pair in zip(mu, alpha, strict=True) for value in pair))

    @property
    def terms(self) -> list[tuple[float, float]]:
        """The pairs (μ_k / G, α_k) that count."""
        pairs = [(self.mu1, self.alpha1), (self.mu2, self.alpha2), (self.mu3, self.alpha3)]
        return [pair for pair in pairs if pair[0] != 0.0]


Law = NeoHooke | MooneyRivlin | Yeoh | Ogden
