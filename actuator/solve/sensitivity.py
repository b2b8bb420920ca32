"""The linear response of the displacements to a change of the design, and its exact transpose.

The coupled tangent is inverted by a fixed number of block Gauss-Seidel sweeps between displacements and pressure,
with the factors at hand. That is less exact than a Krylov solve but a fixed linear map: a model built on it has an
exact gradient and a symmetric Hessian, however rough the map.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from actuator.arrays import Floats
from actuator.equations.tangent_kernels import design_tangent
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.stacking import split, stacked, summed
from actuator.solve.state import State

#: Sweeps. One sweep leaves an error of the order of the coupling's contraction rate, 0.03 on a typical design.
SWEEPS = 1


class Sensitivity:
    """S: dx = S dχ around one state, (n_x, n_vertices).

    Args:
        equilibrium: is linearised at the state.
        state: converged.
        fresh: whether to factorise there, or let the factors at hand serve.

    Raises:
        actuator.failure.SolveFailure: if the tangent cannot be factorised.
    """

    def __init__(self, equilibrium: Equilibrium, state: State, *, fresh: bool = True) -> None:
        self.linearisation = equilibrium.linearise(state, fresh=fresh)
        tangent, geometry = self.linearisation.tangent, equilibrium.geometry
        forces = np.empty((len(geometry.cells), 20, 3, 8))
        design_tangent(geometry, equilibrium.coefficients, state.chi, state.displacement, forces)
        self._forces = tangent.force_block(forces, state.x)

    def __matmul__(self, direction: Floats) -> Floats:
        """dx (n_x,) of a change of the design (n_vertices,)."""
        tangent, linearisation = self.linearisation.tangent, self.linearisation
        force, flow = self._forces @ direction, tangent.pc @ direction
        dx = np.zeros(len(force))
        for _ in range(SWEEPS):
            dp = linearisation.flow(-flow - tangent.px @ dx)
            dx = linearisation.mechanics(-force - tangent.xp @ dp)
        return dx

    def transposed(self, gradient: Floats) -> Floats:
        """Sᵀ g, (n_vertices,), of a derivative with respect to x (n_x,)."""
        tangent, linearisation = self.linearisation.tangent, self.linearisation
        lp = np.zeros(tangent.px.shape[0])
        for _ in range(SWEEPS):
            lx = linearisation.mechanics(gradient - tangent.px.T @ lp)
            lp = linearisation.flow(-(tangent.xp.T @ lx))
        return -(self._forces.T @ lx) - tangent.pc.T @ lp


class JointSensitivity:
    """S of several load cases: dx of all of them, one after the other, for one dχ.

    Args:
        parts: of each load case.
    """

    def __init__(self, parts: Sequence[Sensitivity]) -> None:
        self.parts = tuple(parts)

    def __matmul__(self, direction: Floats) -> Floats:
        """dx (n_cases n_x,) of a change of the design (n_vertices,)."""
        return stacked([part @ direction for part in self.parts])

    def transposed(self, gradient: Floats) -> Floats:
        """Sᵀ g, (n_vertices,), of a derivative with respect to x (n_cases n_x,)."""
        each = split(gradient, len(self.parts))
        return summed([part.transposed(own) for part, own in zip(self.parts, each, strict=True)])

    def mechanics(self, rx: Floats) -> Floats:
        """K_xx⁻¹ rx of every load case, (n_cases n_x,), with the factors at hand."""
        each = split(rx, len(self.parts))
        return stacked([part.linearisation.mechanics(own) for part, own in zip(self.parts, each, strict=True)])
