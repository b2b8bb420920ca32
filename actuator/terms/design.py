"""The terms that depend on χ alone, integrated: C_χ, C_A and C_i in one compiled loop, and any others after them.

Where regions of a case bound χ, C_χ differs from cell to cell and is added from its points instead.

The three are functions of χ and ∇χ at a point, each in its own file with its first and second derivatives; the loop
adds them up. The optimiser's subproblem calls it for every trial.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numba import njit, prange

from actuator.arrays import Floats
from actuator.equations.assembly import Gather, scatter_vector
from actuator.equations.kernels import interpolate, ordered_sum, vertex_gradient
from actuator.equations.points import PointFields
from actuator.material.ersatz import FAST
from actuator.terms.interface import DesignTerm, Problem, Value
from actuator.terms.interface_slope import interface_slope, slope_limit
from actuator.terms.passive_region import PassiveRegion, passive_region
from actuator.terms.surface_area import area_weight, surface_area


@dataclass(frozen=True)
class DesignTerms:
    """The terms that depend on χ alone, evaluated.

    Attributes:
        terms: by name.
        gradient: of their sum, (n_vertices,).
        hessian: of their sum: data of the upper triangle, on the pattern of :attr:`DesignObjective.gather`.
    """

    terms: Mapping[str, Value]
    gradient: Floats
    hessian: Floats

    @property
    def value(self) -> float:
        """Sum of the terms."""
        return sum(term.value for term in self.terms.values())


class DesignObjective:
    """The sum of the terms that depend on χ alone.

    Args:
        problem: what terms are built from.
        others: further terms, by name.
        gather: pattern of upper triangles on vertices.

    Attributes:
        passive: the bounds of C_χ.
        points: fields at the quadrature points.
    """

    def __init__(self, problem: Problem, others: Mapping[str, DesignTerm], gather: Gather) -> None:
        self._others, self.gather = others, gather
        self._geometry = problem.discretisation.geometry
        self._n = problem.discretisation.domain.mesh.nvertices
        self.points, self.passive = PointFields(self._geometry), PassiveRegion(problem)
        self._weights = (
            self.passive.weight if self.passive.by_class else 0.0,
            area_weight(problem),
            problem.objective.slope_weight,
            slope_limit(problem),
        )
        n_cells = len(self._geometry.cells)
        self._g, self._h = np.empty((n_cells, 8)), np.empty((n_cells, 8, 8))

    @property
    def bound(self) -> PassiveRegion | None:
        """C_χ, which the optimiser takes for bounds, or None if it weighs nothing."""
        return self.passive if self.passive.weight > 0.0 else None

    def value(self, chi: Floats) -> float:
        """Sum of the terms alone, to the last bit that of a whole evaluation, at a fraction of the price."""
        passive, *values = design_terms(self._geometry, self.passive.limit, self._weights, chi, self._g, self._h, False)
        if not self.passive.by_class:
            passive = self.passive.penalty(-self.passive.room(chi))
        others = (other.value(chi) for other in self._others.values())
        return sum([*(float(value) for value in (passive, *values[:2])), *others])

    def __call__(self, chi: Floats) -> DesignTerms:
        """Evaluate at a design (n_vertices,)."""
        found = self._evaluated(chi, self._weights)
        if self.passive.by_class or self.bound is None:
            return found
        slope, bend = self.passive.derivatives(chi)
        terms = {**found.terms, "C_chi": Value(self.passive.penalty(-self.passive.room(chi)))}
        return DesignTerms(terms, found.gradient + self.from_points(slope), found.hessian + self.point_stiffness(bend))

    def smooth(self, chi: Floats) -> DesignTerms:
        """The same without C_χ, the bounds."""
        return self._evaluated(chi, (0.0, *self._weights[1:]))

    def _evaluated(self, chi: Floats, weights: tuple[float, float, float, float]) -> DesignTerms:
        passive, area, slope, norm = design_terms(
            self._geometry, self.passive.limit, weights, chi, self._g, self._h, True
        )
        steepest = float(norm) / weights[3]
        terms = {
            "C_chi": Value(float(passive)),
            "C_A": Value(float(area)),
            "C_i": Value(float(slope), {"steepest": steepest}),
            **{name: other.add(chi, self._g, self._h) for name, other in self._others.items()},
        }
        gradient = scatter_vector(self._g, self._geometry.cells, self._n)
        return DesignTerms(terms, gradient, self.gather.data(self._h.ravel()))

    def from_points(self, values: Floats) -> Floats:
        """:meth:`PointFields.integral` of values (n_cells, n_q), (n_vertices,)."""
        return self.points.integral(values, self._n)

    def point_stiffness(self, values: Floats) -> Floats:
        """:meth:`PointFields.stiffness` of values (n_cells, n_q) on the pattern of :attr:`gather`."""
        return self.points.stiffness(values, self.gather)


@njit(cache=True, parallel=True, fastmath=FAST)
def design_terms(geometry, limit, weights, chi, g, h, derivatives):
    """C_χ, C_A, C_i and the largest ‖∇χ‖ (1/mm).

    Writes element gradients (n_cells, 8) and Hessians (n_cells, 8, 8) if ``derivatives`` are wanted.

    Args:
        limit: χ_lim at the quadrature points.
        weights: of the three terms, and the limit of ‖∇χ‖.
    """
    passive_weight, area_factor, slope_weight, steepest = weights
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    values = np.zeros((n_cells, 4))
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        grad, project = np.empty(3), np.empty(8)
        if derivatives:
            g[e] = 0.0
            h[e] = 0.0
        for q in range(n_q):
            dx = geometry.volume[s, q]
            x = interpolate(chi, geometry.cells[e], geometry.shape[q])
            vertex_gradient(chi, geometry.cells[e], geometry.gradient[s, q], grad)
            over = x - limit[s, q]
            first = second = 0.0
            if over > 0.0:
                value, d, dd = passive_region(passive_weight, dx, over)
                values[e, 0] += value
                first += d
                second += dd
            if area_factor != 0.0:
                value, d, dd = surface_area(area_factor, dx, x)
                values[e, 1] += value
                first += d
                second += dd
            norm = np.sqrt(grad[0] ** 2 + grad[1] ** 2 + grad[2] ** 2)
            values[e, 3] = max(values[e, 3], norm)
            excess = norm - steepest
            along = across = 0.0
            if excess > 0.0:
                value, across, along = interface_slope(slope_weight, dx, norm, excess)
                values[e, 2] += value
            if not derivatives:
                continue
            for a in range(8):
                f = geometry.gradient[s, q, a]
                project[a] = grad[0] * f[0] + grad[1] * f[1] + grad[2] * f[2]
                g[e, a] += first * geometry.shape[q, a] + across * project[a]
            for a in range(8):
                for b in range(8):
                    h[e, a, b] += second * geometry.shape[q, a] * geometry.shape[q, b]
            if excess > 0.0:
                for a in range(8):
                    f = geometry.gradient[s, q, a]
                    for b in range(8):
                        k = geometry.gradient[s, q, b]
                        h[e, a, b] += along * project[a] * project[b] + across * (
                            f[0] * k[0] + f[1] * k[1] + f[2] * k[2]
                        )
    return ordered_sum(values[:, 0]), ordered_sum(values[:, 1]), ordered_sum(values[:, 2]), values[:, 3].max()
