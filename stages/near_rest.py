"""How the curve of a uniaxial test begins, where an actuator works."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from actuator.arrays import Bools, Floats

#: Strain limits up to which the beginning of a curve reaches, for a part has strains beyond its limit in places.
REACH = 2.0
#: Least rows of it, twice as many as :func:`near_rest` has unknowns.
LEAST_ROWS = 6


@dataclass(frozen=True)
class Start:
    """How a curve begins, by two terms that have the shapes of Mooney and Rivlin's law but any sign.

    Attributes:
        slope: initial Young's modulus, N/mm².
        uncertainty: one standard deviation of it.
        at_rest: stress that is left at stretch 1, N/mm²; zero unless asked for.
        at_rest_uncertainty: one standard deviation of it.
        terms: factors of λ - 1/λ² and 1 - 1/λ³.
    """

    slope: float
    uncertainty: float
    at_rest: float
    at_rest_uncertainty: float
    terms: Floats

    def stress(self, stretch: float) -> float:
        """Engineering stress over that at rest, N/mm²."""
        return float(self.terms @ [stretch - stretch**-2.0, 1.0 - stretch**-3.0])


def near_rest(stretch: Floats, stress: Floats, *, rest: bool = False) -> Start | None:
    """The beginning of a curve by least squares; None if the rows do not determine it.

    Args:
        stretch, stress: of the rows to take, (n,).
        rest: whether the stress at stretch 1 is unknown, else it is zero.
    """
    columns = [stretch - stretch**-2.0, 1.0 - stretch**-3.0] + ([np.ones_like(stretch)] if rest else [])
    matrix = np.column_stack(columns)
    free = len(stretch) - matrix.shape[1]
    if free < 0 or np.linalg.matrix_rank(matrix) < matrix.shape[1]:
        return None
    inverse = np.linalg.pinv(matrix)
    found = inverse @ stress
    residual = matrix @ found - stress
    # Without rows to spare the residuals are zero and say nothing of the noise.
    variance = float(residual @ residual) / free if free else np.inf
    covariance = inverse @ inverse.T
    slope = np.array([3.0, 3.0, 0.0][: matrix.shape[1]])
    return Start(
        slope=float(slope @ found),
        uncertainty=float(np.sqrt(variance * (slope @ covariance @ slope))),
        at_rest=float(found[2]) if rest else 0.0,
        at_rest_uncertainty=float(np.sqrt(variance * covariance[2, 2])) if rest else 0.0,
        terms=found[:2],
    )


def nearest(stretch: Floats, strain: float) -> Bools:
    """The rows up to a strain in tension and the inverse stretch in compression, (n,), or more: :data:`LEAST_ROWS`."""
    distance = np.abs(np.log(stretch))
    enough = np.sort(distance)[min(LEAST_ROWS, len(stretch)) - 1]
    near: Bools = distance <= max(enough, np.log1p(strain) * (1.0 + 1e-9))
    return near
