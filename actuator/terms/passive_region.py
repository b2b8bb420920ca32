"""C_χ of Appendix B: a bound on χ, above which material stands where there is to be none."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.arrays import Floats
from actuator.domains.initial_design import smooth_minimum
from actuator.equations.kernels import interpolate, ordered_sum
from actuator.equations.points import PointFields
from actuator.material.ersatz import FAST
from actuator.terms.interface import DesignTerm, Problem, Value


class PassiveRegion(DesignTerm):
    """C_χ = c_χ / 2 ∫ ⟨χ - χ_lim⟩².

    It is so steep that the optimiser takes it for a bound (:mod:`actuator.optimiser.barrier`): ``room`` says how far.

    Attributes:
        weight: c_χ, 1/mm³.
    """

    def __init__(self, problem: Problem) -> None:
        discretisation, objective = problem.discretisation, problem.objective
        self._geometry, self._points = discretisation.geometry, PointFields(discretisation.geometry)
        unit = objective.length_unit
        self._limit = passive_limit(
            discretisation.radii / unit, discretisation.domain.radius / unit, objective.interface_width / unit
        )
        self.weight = objective.passive_weight
        n_cells = len(self._geometry.cells)
        self._nothing = np.empty((n_cells, 0)), np.empty((n_cells, 0, 0))

    def value(self, chi: Floats) -> float:
        """C_χ, dimensionless."""
        return float(passive_region(self._geometry, self._limit, self.weight, chi, *self._nothing, False))

    def add(self, chi: Floats, gradient: Floats, hessian: Floats) -> Value:
        """Add the derivatives of C_χ."""
        return Value(float(passive_region(self._geometry, self._limit, self.weight, chi, gradient, hessian, True)))

    def room(self, chi: Floats) -> Floats:
        """How far χ lies below the bound at the quadrature points, (n_cells, n_q); negative beyond it."""
        return self._limit[self._geometry.section] - self._points.at(chi)

    def share(self, chi: Floats) -> float:
        """Share of the solid {χ > 0} that lies in the passive core, where the bound is negative."""
        volume = self._points.volumes * (self._points.at(chi) > 0.0)
        solid = float(volume.sum())
        return float(volume[self._limit[self._geometry.section] < 0.0].sum()) / solid if solid > 0.0 else 0.0


def passive_limit(radii: Floats, radius: float, interface_width: float) -> Floats:
    """The bound on χ in C_χ of Eq. (B.2): 8/L_i min(R - r, |r| smoothed - 0.3 R).

    Args:
        radii: r at any points; this and the other lengths in the unit of the paper's numbers.
        radius: R.
        interface_width: L_i.
    """
    smooth_radius = -smooth_minimum(radii, -radii, interface_width)
    return 8.0 / interface_width * np.minimum(radius - radii, smooth_radius - 0.3 * radius)


@njit(cache=True, parallel=True, fastmath=FAST)
def passive_region(geometry, limit, weight, chi, g, h, derivatives):
    """C_χ; adds element gradients (n_cells, 8) and Hessians (n_cells, 8, 8) if ``derivatives`` are wanted."""
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    values = np.zeros(n_cells)
    for e in prange(n_cells):
        s = geometry.section[e]
        for q in range(n_q):
            shape = geometry.shape[q]
            over = interpolate(chi, geometry.cells[e], shape) - limit[s, q]
            if over <= 0.0:
                continue
            dx = geometry.volume[s, q]
            values[e] += 0.5 * weight * dx * over * over
            if derivatives:
                for a in range(8):
                    g[e, a] += weight * dx * over * shape[a]
                    for b in range(8):
                        h[e, a, b] += weight * dx * shape[a] * shape[b]
    return ordered_sum(values)
