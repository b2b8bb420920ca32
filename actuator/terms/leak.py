"""C_p of Eq. (13): the pressure that stands on the outer wall."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.terms.interface import Derivatives, Fields, Problem, StateTerm, Value


class Leak(StateTerm):
    """C_p = pᵀ W p / 2, the mean of (p / p_in)² over the outer wall times c_p / 2.

    Attributes:
        matrix: W, (n_vertices, n_vertices), mm⁴/N²; zero without pressure, where there is no leak to measure.
    """

    def __init__(self, problem: Problem) -> None:
        pressure, weight = problem.load.pressure, problem.objective.leak_weight
        self._weighs = weight != 0.0 and pressure > 0.0
        self.matrix = (weight / pressure**2 if pressure > 0.0 else 0.0) * problem.discretisation.wall_mass

    def value(self, at: Fields) -> Value:
        """C_p, dimensionless."""
        return Value(0.5 * float(at.p @ (self.matrix @ at.p)))

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add W p."""
        into.vertex_p[:] += self.matrix @ at.p

    def pressure_roots(self) -> Floats | None:
        """Square roots of W's row sums."""
        return np.sqrt(np.asarray(self.matrix.sum(axis=1)).ravel()) if self._weighs else None
