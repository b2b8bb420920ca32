"""C_p as a function of the design with the displacements frozen: only scalar Darcy problems (Eqs. 5 and 12)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.assembly import scatter_vector
from actuator.domain import Floats
from actuator.reduced import TINY, ReducedObjective
from actuator.tangent_kernels import darcy_design_derivative, darcy_metric, darcy_product


@dataclass(frozen=True)
class LeakPoint:
    """Value, gradient (n_vertices,), p and its adjoint at one design."""

    value: float
    gradient: Floats
    p: Floats
    adjoint: Floats


class FrozenLeak:
    """C_p(χ; u) for one displacement field u, with gradient and exact Hessian-vector products.

    The factorisation of the last evaluated design serves its products.
    """

    def __init__(self, objective: ReducedObjective, displacement: Floats) -> None:
        equilibrium = objective.equilibrium
        self._equilibrium, self._weight = equilibrium, objective.leak
        self._geometry, self._c = equilibrium.geometry, equilibrium.coefficients
        n_cells = len(self._geometry.cells)
        self._metric = np.empty((n_cells, self._geometry.shape.shape[0], 6))
        darcy_metric(self._geometry, displacement, self._metric)
        self._elements = np.empty((n_cells, 8, 8))
        n = objective.domain.mesh.nvertices
        inflow = self._c.pressure * self._geometry.volume * equilibrium.source
        self._load = scatter_vector((inflow @ self._geometry.shape)[self._geometry.section], self._geometry.cells, n)

    def __call__(self, chi: Floats) -> LeakPoint:
        """Evaluate at a design; its Darcy matrix stays factorised for :meth:`product`."""
        equilibrium = self._equilibrium
        equilibrium.factorise_flow(chi, self._metric, self._elements)
        p = equilibrium.frozen_darcy_solver.solve(self._load)
        drive = self._weight @ p
        adjoint = equilibrium.frozen_darcy_solver.solve(-drive)
        return LeakPoint(0.5 * float(p @ drive), self._derivative(chi, p, adjoint), p, adjoint)

    def product(self, chi: Floats, at: LeakPoint, direction: Floats) -> Floats:
        """Exact Hessian times a direction at the design evaluated last, (n_vertices,)."""
        solver = self._equilibrium.frozen_darcy_solver
        step = TINY / max(float(np.abs(direction).max()), 1e-300)
        moved = chi + 1j * step * direction
        dp = solver.solve(-self._apply(moved, at.p).imag / step, check=None)
        rhs = self._apply(moved, at.adjoint).imag / step + self._weight @ dp
        dl = solver.solve(-rhs, check=None)
        return self._derivative(moved, at.p + 1j * step * dp, at.adjoint + 1j * step * dl).imag / step

    def _apply(self, chi: Floats, p: Floats) -> Floats:
        kind = np.result_type(chi, p)
        elements = np.empty((len(self._geometry.cells), 8), kind)
        darcy_product(self._geometry, self._equilibrium.source, self._c, chi, self._metric, p.astype(kind), elements)
        return scatter_vector(elements, self._geometry.cells, len(chi))

    def _derivative(self, chi: Floats, p: Floats, adjoint: Floats) -> Floats:
        elements = np.empty((len(self._geometry.cells), 8), np.result_type(chi, p))
        darcy_design_derivative(self._geometry, self._c, chi, self._metric, p, adjoint, elements)
        return scatter_vector(elements, self._geometry.cells, len(chi))
