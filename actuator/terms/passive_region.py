"""C_χ of Appendix B: a bound on χ, above which material stands where there is to be none, c_χ / 2 ∫ ⟨χ - χ_lim⟩².

Regions of a case (:mod:`actuator.regions`) bound χ in the same term: void ones from above, solid ones from below.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from actuator.arrays import Bools, Floats, Ints
from actuator.equations.points import PointFields
from actuator.terms.interface import Problem


class PassiveRegion:
    """The bounds. C_χ is so steep that the optimiser takes it for bounds (:mod:`actuator.optimiser.barrier`).

    Attributes:
        weight: c_χ, 1/mm³.
        limit: χ_lim of the domain at the quadrature points of each class of cells, (n_classes, n_q).
        upper, lower: bounds at the quadrature points of each cell, (n_cells, n_q); no lower one without solid regions.
        by_class: whether the bound is χ_lim of the domain alone, and so the same in all cells of a class.
    """

    def __init__(self, problem: Problem) -> None:
        discretisation, objective = problem.discretisation, problem.objective
        geometry, self._points = discretisation.geometry, PointFields(discretisation.geometry)
        widths = objective.interface_width, objective.length_unit
        self.limit = discretisation.domain.passive_bound(discretisation.quadrature_points, *widths)
        self.upper: Floats = self.limit[geometry.cell_class]
        self.lower: Floats | None = None
        self.by_class = not (problem.regions and problem.regions.bind)
        if problem.regions and problem.regions.bind:
            lower, upper = problem.regions.all_bounds(*widths)
            assert upper is not None, "the domain has one of its own"
            self.lower, self.upper = None if lower is None else self._points.at(lower), self._points.at(upper)
        self.weight = objective.passive_weight

    def rooms(self, chi: Floats) -> tuple[Floats, Floats | None]:
        """By how much χ may rise and fall at the quadrature points, (n_cells, n_q); negative beyond a bound.

        The second is None where nothing bounds χ from below.
        """
        at = self._points.at(chi)
        return self.upper - at, None if self.lower is None else at - self.lower

    def room(self, chi: Floats) -> Floats:
        """The smaller of :meth:`rooms`, (n_cells, n_q). Beyond one bound there is always room to the other."""
        rise, fall = self.rooms(chi)
        return rise if fall is None else np.minimum(rise, fall)

    def penalty(self, over: Floats) -> float:
        """C_χ of what lies beyond the bounds at the quadrature points, (n_cells, n_q), negative within them."""
        return 0.5 * self.weight * float(np.sum(self._points.volumes * np.maximum(over, 0.0) ** 2))

    def derivatives(self, chi: Floats) -> tuple[Floats, Floats]:
        """First and second derivative of C_χ by χ at the quadrature points, over their volumes, (n_cells, n_q)."""
        rise, fall = self.rooms(chi)
        beyond = np.maximum(-rise, 0.0) - (0.0 if fall is None else np.maximum(-fall, 0.0))
        return self.weight * beyond, np.where(beyond != 0.0, self.weight, 0.0)

    def beyond(self, moved: Floats, rise: Floats, fall: Floats | None) -> Bools | Ints:
        """Where a change of χ at the points goes beyond a bound, given :meth:`rooms` before it: 1 above, -1 below."""
        above = np.asarray(moved > rise)
        return above if fall is None else above.astype(np.int8) - (moved < -fall)

    def share(self, chi: Floats) -> float:
        """Share of the solid {χ > 0} that lies where there is to be void: where the upper bound is negative."""
        return self._share(self._points.at(chi) > 0.0, self.upper < 0.0)

    def missing(self, chi: Floats) -> float:
        """Share of the solid regions that is void; 0 without any."""
        return 0.0 if self.lower is None else self._share(self.lower > 0.0, self._points.at(chi) <= 0.0)

    def _share(self, of: Bools, part: Bools) -> float:
        volume = self._points.volumes * of
        whole = float(volume.sum())
        return float(volume[part].sum()) / whole if whole > 0.0 else 0.0


@njit(cache=True, inline="always")
def passive_region(weight, dx, over):
    """C_χ at a point of volume dx where χ is beyond its bound, and its first and second derivative."""
    return 0.5 * weight * dx * over * over, weight * dx * over, weight * dx
