"""The coupled tangent as GMRES sees it: scaled unknowns and equations, and the block preconditioner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.equations.tangent import Tangent
from actuator.linear import DirectSolver


@dataclass(frozen=True)
class CoupledSystem:
    """The tangent or its transpose in scaled unknowns, so that displacements, the arm and pressures weigh the same.

    Attributes:
        tangent: assembled.
        mechanics: solves with the mechanical block, to the precision of its factors.
        darcy: the factorised Darcy block.
        force, flow: what the equations in x and p are measured against.
        transposed: whether the adjoint's equations are meant.
    """

    tangent: Tangent
    mechanics: Callable[[Floats], Floats]
    darcy: DirectSolver
    force: float
    flow: float
    transposed: bool

    def scaled(self, x: Floats, p: Floats) -> Floats:
        """Both parts of a right-hand side in one vector, (n_x + n_p,)."""
        return np.concatenate([x / self.force, p / self.flow])

    def multiply(self, v: Floats) -> Floats:
        """The scaled tangent times a vector, (n_x + n_p,)."""
        n = self.tangent.xp.shape[0]
        product = self.tangent.multiply_transposed if self.transposed else self.tangent.multiply
        return self.scaled(*product(v[:n], v[n:]))

    def precondition(self, r: Floats) -> Floats:
        """Block triangle of K_xx and K_pp with one coupling block, inverted; (n_x + n_p,)."""
        n = self.tangent.xp.shape[0]
        rx, rp = self.force * r[:n], self.flow * r[n:]
        if self.transposed:
            zx = self.mechanics(rx)
            return np.concatenate([zx, self.darcy.solve(rp - self.tangent.xp.T @ zx, check=None)])
        zp = self.darcy.solve(rp, check=None)
        return np.concatenate([self.mechanics(rx - self.tangent.xp @ zp), zp])
