"""The subproblem of a Newton step: the physics as a quadratic, the terms that depend on χ alone exact.

    min over s of   r·s + ½ sᵀ (B + Q) s + D(χ + s),   D = C_χ + C_A + C_i,

Q being the matrix of the step terms. C_χ and C_i are walls with kinks: a quadratic model of them holds only as far as
the next kink, which is why they are not part of the quadratic. No physics is computed here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from actuator.design_terms import DesignObjective, DesignTerms
from actuator.domain import Floats
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.metric import Metric
from actuator.tangent import symmetric_product

MAX_NEWTON = 20
#: Most corrections of the design Hessian by what lies ahead; factor per trial and least length of the search after it.
LOOK_AHEAD, SHRINK, SHORTEST = 8, 0.4, 1e-5
#: Largest change of χ in one Newton step, and share of the linear decrease that is enough.
LARGEST, ENOUGH, SOME = 1.0, 0.05, 1e-4
#: Largest shift of a Hessian that is not positive definite, over that of B: more means that something else is wrong.
LARGEST_SHIFT = 1e18
#: The search ends when a Newton step brings less than this part of all that was gained.
STALLED = 0.05


@dataclass(frozen=True)
class Proposal:
    """Solution of a subproblem: the step, what it promises (negative), and the design terms there."""

    step: Floats
    change: float
    design: DesignTerms


class Subproblem:
    """Newton's method on the sparse part, Woodbury's formula for the low rank.

    Args:
        design: the χ-only terms.
        solver: direct solver on the vertices' pattern.
        norm: of the design, whose matrix shifts a Hessian that is not positive definite.
    """

    def __init__(self, design: DesignObjective, solver: DirectSolver, norm: Metric) -> None:
        self._design, self._solver, self._norm = design, solver, norm
        self._diagonal = design.gather.indptr[:-1]  # an upper triangle's rows begin with the diagonal

    def solve(
        self, chi: Floats, at: DesignTerms, linear: Floats, curvature: Curvature, quadratic: Floats, reach: float
    ) -> Proposal | None:
        """Minimise from s = 0.

        Args:
            chi, at: design and its terms at s = 0.
            linear: r, (n_vertices,).
            curvature: B.
            quadratic: data of Q's upper triangle, on the pattern of ``norm``.
            reach: change of χ beyond which the search ends.

        Returns:
            None if no step lowers the objective.
        """
        matrix = self._design.gather.matrix(quadratic)
        s = np.zeros_like(chi)
        bent = np.zeros_like(chi)  # (B + Q) s
        there, value = at, 0.0

        def objective(s: Floats, bent: Floats, design: float) -> float:
            return float(linear @ s) + 0.5 * float(s @ bent) + design - at.value

        for _ in range(MAX_NEWTON):
            residual = linear + bent + there.gradient
            hessian, enough = there.hessian, ENOUGH
            for _ in range(LOOK_AHEAD):
                p = -self._inverse(hessian + quadratic, curvature, residual)
                q = curvature @ p + symmetric_product(matrix, p)
                slope = float(residual @ p)
                if not slope < 0.0:
                    return Proposal(s, value, there) if value < 0.0 else None
                length = min(1.0, LARGEST / float(np.abs(p).max()))
                ahead = self._design(chi + (s + length * p))
                low = objective(s + length * p, bent + length * q, ahead.value)
                if low < value + enough * length * slope:
                    break
                hessian = 0.5 * (hessian + ahead.hessian)
            else:
                enough = SOME
            first = length
            while not low < value + enough * length * slope and length > SHORTEST:
                length *= SHRINK
                low = objective(s + length * p, bent + length * q, self._design.value(chi + (s + length * p)))
            if not low < value:
                break
            s, bent = s + length * p, bent + length * q
            drop, value, there = value - low, low, ahead if length == first else self._design(chi + s)
            if drop < STALLED * -value or float(np.abs(s).max()) > reach:
                break
        return Proposal(s, value, there) if value < 0.0 else None

    def _inverse(self, data: Floats, curvature: Curvature, r: Floats) -> Floats:
        """(sparse + B)⁻¹ r; more of the norm's matrix where the sparse part is not positive definite."""
        upper, shift = self._norm.upper, curvature.scale
        data = data.copy()
        data[self._diagonal] += curvature.diagonal
        while True:
            try:
                self._solver.factorise(data + shift * upper)
                break
            except SolveFailure:
                shift *= 4.0
                if not shift < LARGEST_SHIFT * curvature.scale:
                    raise
        z = self._solver.solve(r, check=None)
        columns = curvature.columns
        if columns.shape[1] == 0:
            return z
        # (A + C J Cᵀ)⁻¹ = A⁻¹ - A⁻¹ C (J + Cᵀ A⁻¹ C)⁻¹ Cᵀ A⁻¹
        inverse = self._solver.solve(columns, check=None)
        small = np.diag(curvature.signs) + columns.T @ inverse
        return z - inverse @ sl.solve(small, columns.T @ z, assume_a="sym")
