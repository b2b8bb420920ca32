"""C_χ of Appendix B: a bound on χ, above which material stands where there is to be none, c_χ / 2 ∫ ⟨χ - χ_lim⟩²."""

from __future__ import annotations

import numpy as np
from numba import njit

from actuator.arrays import Floats
from actuator.equations.points import PointFields
from actuator.terms.interface import Problem


class PassiveRegion:
    """The bound. C_χ is so steep that the optimiser takes it for one (:mod:`actuator.optimiser.barrier`).

    Attributes:
        weight: c_χ, 1/mm³.
        limit: χ_lim at the quadrature points of each class of cells, (n_classes, n_q).
    """

    def __init__(self, problem: Problem) -> None:
        discretisation, objective = problem.discretisation, problem.objective
        self._geometry, self._points = discretisation.geometry, PointFields(discretisation.geometry)
        self.limit = discretisation.domain.passive_bound(
            discretisation.quadrature_points, objective.interface_width, objective.length_unit
        )
        self.weight = objective.passive_weight

    def room(self, chi: Floats) -> Floats:
        """How far χ lies below the bound at the quadrature points, (n_cells, n_q); negative beyond it."""
        return self.limit[self._geometry.cell_class] - self._points.at(chi)

    def penalty(self, over: Floats) -> float:
        """C_χ of what lies beyond the bound at the quadrature points, (n_cells, n_q), negative within it."""
        return 0.5 * self.weight * float(np.sum(self._points.volumes * np.maximum(over, 0.0) ** 2))

    def share(self, chi: Floats) -> float:
        """Share of the solid {χ > 0} that lies in the passive core, where the bound is negative."""
        volume = self._points.volumes * (self._points.at(chi) > 0.0)
        solid = float(volume.sum())
        return float(volume[self.limit[self._geometry.cell_class] < 0.0].sum()) / solid if solid > 0.0 else 0.0


@njit(cache=True, inline="always")
def passive_region(weight, dx, over):
    """C_χ at a point of volume dx where χ is beyond its bound, and its first and second derivative."""
    return 0.5 * weight * dx * over * over, weight * dx * over, weight * dx
