"""The linear answer of the displacements to a change of the design, and its exact transpose.

The coupled tangent is inverted by a fixed number of block Gauss-Seidel sweeps between displacements and pressure,
with the factors at hand. That is less exact than a Krylov solve but a fixed linear map: a model built on it has an
exact gradient and a symmetric Hessian, however rough the map.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats
from actuator.equations.tangent import darcy_gather
from actuator.equations.tangent_kernels import design_tangent
from actuator.solve.equilibrium import Equilibrium, State

#: Sweeps. One sweep leaves an error of the order of the coupling's contraction rate, 0.03 on a typical design.
SWEEPS = 1


class Sensitivity:
    """S: dx = S dχ around one state, (n_x, n_vertices).

    Args:
        equilibrium: its factors serve; another linearisation must not come between two uses.

    Attributes:
        flows: derivative of the flow equations with respect to χ at the state, (n_p, n_vertices).
    """

    flows: sp.csr_array

    def __init__(self, equilibrium: Equilibrium) -> None:
        self._equilibrium = equilibrium
        self._flow = darcy_gather(equilibrium.discretisation, upper=False)

    def linearise(self, state: State) -> None:
        """Take up a state."""
        equilibrium = self._equilibrium
        equilibrium.linearise(state)
        tangent, geometry = equilibrium.tangent, equilibrium.geometry
        n_cells = len(geometry.cells)
        forces, flows = np.empty((n_cells, 20, 3, 8)), np.empty((n_cells, 8, 8))
        design_tangent(geometry, equilibrium.coefficients, state.chi, state.displacement, state.p, forces, flows)
        self._forces = tangent.force_block(forces, state.x)
        self.flows = self._flow.matrix(self._flow.data(flows.ravel()))

    def __matmul__(self, direction: Floats) -> Floats:
        """dx (n_x,) of a change of the design (n_vertices,)."""
        equilibrium = self._equilibrium
        tangent, darcy = equilibrium.tangent, equilibrium.darcy_solver
        force, flow = self._forces @ direction, self.flows @ direction
        dx = np.zeros(len(force))
        for _ in range(SWEEPS):
            dp = darcy.solve(-flow - tangent.px @ dx, check=None)
            dx = equilibrium.solve_mechanics(-force - tangent.xp @ dp)
        return dx

    def transposed(self, gradient: Floats) -> Floats:
        """Sᵀ g, (n_vertices,), of a derivative with respect to x (n_x,)."""
        equilibrium = self._equilibrium
        tangent, darcy = equilibrium.tangent, equilibrium.darcy_solver
        lp = np.zeros(tangent.px.shape[0])
        for _ in range(SWEEPS):
            lx = equilibrium.solve_mechanics(gradient - tangent.px.T @ lp)
            lp = darcy.solve(-(tangent.xp.T @ lx), check=None)
        return -(self._forces.T @ lx) - self.flows.T @ lp
