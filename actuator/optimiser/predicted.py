"""The terms C_0, C_p and C_Ψ as functions of the design and of given displacements; only p is solved for.

With the displacements predicted from a design step this is nearly the true objective at the price of a scalar Darcy
problem, without the mechanical factorisation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.assembly import scatter_vector
from actuator.domain import Floats
from actuator.kernels import strain_energy_excess
from actuator.reduced import TINY, ReducedObjective, main_objective
from actuator.tangent_kernels import darcy_metric, darcy_tangent


@dataclass(frozen=True)
class PredictedPoint:
    """Value of C_0 + C_p + C_Ψ at (χ, x), and p there; ``value`` is inf where an element inverts."""

    chi: Floats
    x: Floats
    value: float
    p: Floats


@dataclass(frozen=True)
class PredictedSlope:
    """Derivatives with respect to χ (n_vertices,) and x (n_x,), and the adjoint of p."""

    chi: Floats
    x: Floats
    adjoint: Floats


class PredictedPhysics:
    """Evaluates the terms; the Darcy matrix of the point evaluated last stays factorised for what follows it."""

    def __init__(self, objective: ReducedObjective) -> None:
        self._objective, self._equilibrium = objective, objective.equilibrium
        geometry, c = self._equilibrium.geometry, self._equilibrium.coefficients
        self._metric = np.empty((len(geometry.cells), geometry.shape.shape[0], 6))
        self._elements = np.empty((len(geometry.cells), 8, 8))
        inflow = c.pressure * geometry.volume * self._equilibrium.source
        n = objective.domain.mesh.nvertices
        self._load = scatter_vector((inflow @ geometry.shape)[geometry.section], geometry.cells, n)
        self._no_force = np.zeros((len(objective.domain.nodes), 3))

    def __call__(self, chi: Floats, x: Floats) -> PredictedPoint:
        """Evaluate at a design (n_vertices,) and reduced displacements (n_x,)."""
        equilibrium, geometry = self._equilibrium, self._equilibrium.geometry
        c, u = equilibrium.coefficients, equilibrium.kinematics.displacement(x)
        energy, _ = strain_energy_excess(geometry, c, chi, u)
        if not np.isfinite(energy):
            return PredictedPoint(chi, x, np.inf, np.zeros_like(chi))
        darcy_metric(geometry, u, self._metric)
        darcy_tangent(geometry, equilibrium.source, c, chi, self._metric, self._elements)
        solver = equilibrium.frozen_darcy_solver
        solver.factorise(equilibrium.tangent.darcy.data(self._elements.ravel()))
        equilibrium.work.darcy_factorisations += 1
        p = solver.solve(self._load)
        leak = 0.5 * float(p @ (self._objective.leak @ p))
        return PredictedPoint(chi, x, main_objective(x, self._objective.load) + leak + float(energy), p)

    def slope(self, at: PredictedPoint) -> PredictedSlope:
        """Derivatives at the point evaluated last."""
        adjoint = self._equilibrium.frozen_darcy_solver.solve(-(self._objective.leak @ at.p))
        g_chi, g_x, _ = self._derivatives(at.chi, at.x, at.p, adjoint)
        return PredictedSlope(g_chi, g_x, adjoint)

    def product(
        self, at: PredictedPoint, slope: PredictedSlope, direction: Floats, dx: Floats
    ) -> tuple[Floats, Floats]:
        """Second derivatives times (direction, dx), with respect to χ and x, at the point evaluated last."""
        solver = self._equilibrium.frozen_darcy_solver
        step = TINY / max(float(np.abs(direction).max()), 1e-300)
        chi, x = at.chi + 1j * step * direction, at.x + 1j * step * dx
        _, rp, _, _ = self._equilibrium.residual(chi, x, at.p)
        dp = solver.solve(-rp.imag / step, check=None)
        p = at.p + 1j * step * dp
        _, _, hp = self._derivatives(chi, x, p, slope.adjoint)
        dl = solver.solve(-hp.imag / step, check=None)
        h_chi, h_x, _ = self._derivatives(chi, x, p, slope.adjoint + 1j * step * dl)
        return h_chi.imag / step, h_x.imag / step

    def _derivatives(self, chi: Floats, x: Floats, p: Floats, adjoint: Floats) -> tuple[Floats, Floats, Floats]:
        return self._objective.derivatives(chi, x, p, np.zeros(len(x)), adjoint, self._no_force)
