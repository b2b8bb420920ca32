"""C_p of Eq. (13): the pressure that stands on the outer wall, and in chambers that have another one."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.terms.interface import Derivatives, Fields, Problem, StateTerm, Value


class Leak(StateTerm):
    """C_p = pᵀ W p / 2, the mean of (p / p_in)² over the outer wall times c_p / 2.

    Where several chambers have pressures of their own, the mean of ((p - p_k) / p_in)² over the inlet of every chamber
    k below p_in comes to it. Its source lets out what comes in from others, so that the pressure at its inlet rises
    with the flow that leaks into it, smoothly and from all of the walls around it; a hole in them makes it a good part
    of p_in.

    Attributes:
        matrix: W, (n_vertices, n_vertices), mm⁴/N²; zero without pressure, where there is no leak to measure.
    """

    def __init__(self, problem: Problem) -> None:
        pressure, weight = problem.load.pressure, problem.objective.leak_weight
        self._weighs = weight != 0.0 and pressure > 0.0
        factor = weight / pressure**2 if pressure > 0.0 else 0.0
        self.matrix = factor * problem.discretisation.wall_mass
        #: Means over the inlets of chambers below p_in, N²/mm⁴ by what they multiply, and their pressures.
        self._inlets = [
            (problem.discretisation.inlet_masses[k], own)
            for k, own in enumerate(problem.load.chambers)
            if own < pressure
        ]
        self._factor, self._pressure = factor, pressure

    def value(self, at: Fields) -> Value:
        """C_p, dimensionless, and as ``chamber_leak`` the root of the largest mean over an inlet, if there is any."""
        wall = 0.5 * float(at.p @ (self.matrix @ at.p))
        if not self._inlets:
            return Value(wall)
        means = [float((at.p - own) @ (mass @ (at.p - own))) for mass, own in self._inlets]
        return Value(
            wall + 0.5 * self._factor * sum(means), {"chamber_leak": float(np.sqrt(max(means))) / self._pressure}
        )

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add W p, and the like of inlets."""
        into.vertex_p[:] += self.matrix @ at.p
        for mass, own in self._inlets:
            into.vertex_p[:] += self._factor * (mass @ (at.p - own))

    def pressure_roots(self) -> Floats | None:
        """Square roots of the row sums of W and the like."""
        if not self._weighs:
            return None
        rows = self.matrix.sum(axis=1) + self._factor * sum(mass.sum(axis=1) for mass, _ in self._inlets)
        return np.sqrt(np.asarray(rows).ravel())
