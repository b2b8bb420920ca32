"""The physics of a subproblem: a quadratic, and the inverse of its Hessian with the sparse part of other terms."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from actuator.arrays import Floats, Ints
from actuator.equations.tangent import symmetric_product
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver
from actuator.optimiser.curvature import Curvature
from actuator.terms.step import Metric

#: Largest shift of a Hessian that is not positive definite, over that of B: a Hessian of whatever units is definite
#: long before, so that more means that something else is wrong.
LARGEST_SHIFT = 1e18


@dataclass(frozen=True)
class Quadratic:
    """r·s + ½ sᵀ (B + Q) s.

    Attributes:
        linear: r, (n_vertices,).
        curvature: B.
        upper: Q's upper triangle.
    """

    linear: Floats
    curvature: Curvature
    upper: sp.csr_array

    def bent(self, s: Floats) -> Floats:
        """(B + Q) s."""
        return self.curvature @ s + symmetric_product(self.upper, s)

    def value(self, s: Floats, bent: Floats) -> float:
        """At a step, of which (B + Q) s is known."""
        return float(self.linear @ s) + 0.5 * float(s @ bent)


class Inverse:
    """Inverts B + Q + a sparse matrix: Cholesky's factors of what is sparse, Woodbury's formula for the low rank.

    Args:
        solver: direct solver on the vertices' pattern.
        norm: of the design, whose matrix shifts a Hessian that is not positive definite.
        diagonal: where the diagonal stands in data on that pattern.
    """

    def __init__(self, solver: DirectSolver, norm: Metric, diagonal: Ints) -> None:
        self._solver, self._norm, self._diagonal = solver, norm, diagonal

    def __call__(self, data: Floats, physics: Quadratic) -> Callable[[Floats], Floats]:
        """The inverse with other terms' Hessian, data of its upper triangle, added.

        Raises:
            actuator.failure.SolveFailure: if no shift makes the sum positive definite.
        """
        curvature, upper = physics.curvature, self._norm.upper
        shift = curvature.scale
        data = data + physics.upper.data
        data[self._diagonal] += curvature.diagonal
        while True:
            try:
                self._solver.factorise(data + shift * upper)
                break
            except SolveFailure:
                shift *= 4.0
                if not shift < LARGEST_SHIFT * curvature.scale:
                    raise
        columns = curvature.columns
        if columns.shape[1] == 0:
            return lambda r: self._solver.solve(r, check=None)
        # (A + C J Cᵀ)⁻¹ = A⁻¹ - A⁻¹ C (J + Cᵀ A⁻¹ C)⁻¹ Cᵀ A⁻¹
        inverse = self._solver.solve(columns, check=None)
        small = np.diag(curvature.signs) + columns.T @ inverse

        def apply(r: Floats) -> Floats:
            z = self._solver.solve(r, check=None)
            # Of directions that B hardly tells apart some digits are lost. That is no matter for the user: whatever
            # comes out is only a direction to search along, and is held against the subproblem itself.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", sl.LinAlgWarning)
                try:
                    return z - inverse @ sl.solve(small, columns.T @ z, assume_a="sym")
                except sl.LinAlgError:  # singular: the sparse part alone still leads downhill
                    return z

        return apply
