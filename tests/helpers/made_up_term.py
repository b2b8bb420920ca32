"""Terms of the objective that the product does not have: one of the design, one of the state."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.equations.points import PointFields
from actuator.terms import DesignTerm, Problem, StateTerm
from actuator.terms.interface import Derivatives, Fields, Value


class Mass(DesignTerm):
    """C_M = weight / |Ω| ∫ ρ, ρ = 1 / (1 + exp(-χ))."""

    def __init__(self, problem: Problem, *, weight: float) -> None:
        geometry = problem.discretisation.geometry
        self._cells, self._shape = geometry.cells, geometry.shape
        self._products = (geometry.shape[:, :, None] * geometry.shape[:, None, :]).reshape(-1, 64)
        self._points = PointFields(geometry)
        self._factors = weight / problem.discretisation.volume * self._points.volumes

    def _density(self, chi: Floats) -> Floats:
        return 1.0 / (1.0 + np.exp(-self._points.at(chi)))

    def value(self, chi: Floats) -> float:
        return float(np.sum(self._factors * self._density(chi)))

    def add(self, chi: Floats, gradient: Floats, hessian: Floats) -> Value:
        rho = self._density(chi)
        slope = self._factors * rho * (1.0 - rho)
        gradient += slope @ self._shape
        hessian += ((slope * (1.0 - 2.0 * rho)) @ self._products).reshape(hessian.shape)
        return Value(self.value(chi), {"solid_share": self.value(chi) / float(self._factors.sum())})


class AxialDisplacement(StateTerm):
    """C_X = weight / 2 (T1 / reach)²: the arm's root is to stay where it is."""

    def __init__(self, problem: Problem, *, weight: float, reach: float = 1.0) -> None:
        self._weight, self._reach = weight, reach

    def value(self, at: Fields) -> Value:
        return Value(0.5 * self._weight * float(at.arm[0] / self._reach) ** 2)

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        into.arm[0] += self._weight * at.arm[0] / self._reach**2
