"""The preconditioner of the inner problem: the Hessian of the cheap terms, corrected by what the iteration has seen."""

from __future__ import annotations

import numpy as np

from actuator.assembly import Gather
from actuator.domain import Floats
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver
from actuator.optimiser.metric import Metric
from actuator.tangent import symmetric_product

#: Pairs kept: those of several Newton steps, since the stiff directions stay while the inner problem goes on.
MEMORY = 150


class Preconditioner:
    """P = C_χ'' + C_A'' + C_i'' + M/Δt², factorised; L-BFGS pairs bring in the physics.

    The pairs are those of the conjugate gradients so far (Morales & Nocedal 2000, doi:10.1137/S1052623497327854).
    """

    def __init__(self, solver: DirectSolver, metric: Metric, gather: Gather) -> None:
        self._solver, self._metric, self._gather = solver, metric, gather
        self._pairs: list[tuple[Floats, Floats, float]] = []

    def forget(self) -> None:
        """Drop the pairs."""
        self._pairs = []

    def learn(self, pairs: list[tuple[Floats, Floats]]) -> None:
        """Take up directions d with H d, each of positive curvature; the oldest go first."""
        self._pairs = (self._pairs + [(d, hd, 1.0 / float(d @ hd)) for d, hd in pairs])[-MEMORY:]

    def factorise(self, hessian: Floats, dt: float) -> None:
        """Factorise for the data of the design Hessian's upper triangle; more of M where C_A is too concave."""
        upper = self._metric.upper
        data = hessian + upper / dt**2
        shift = 0.0
        for _ in range(8):
            try:
                self._solver.factorise(data + shift * upper)
            except SolveFailure:
                shift = max(10.0 * shift, 0.1 / dt**2, 1e-10)
                continue
            self._matrix = self._gather.matrix(data + shift * upper)
            return
        self._solver.factorise(upper / dt**2)
        self._matrix = self._gather.matrix(upper / dt**2)

    def plain(self, r: Floats) -> Floats:
        """P⁻¹ r without the pairs."""
        return self._solver.solve(r, check=None)

    def solve(self, r: Floats) -> Floats:
        """Approximate H⁻¹ r by the two-loop recursion (Nocedal & Wright 2006, Alg. 7.4)."""
        shares = []
        for d, hd, scale in reversed(self._pairs):
            share = scale * float(d @ r)
            shares.append(share)
            r = r - share * hd
        z = self.plain(r)
        for (d, hd, scale), share in zip(self._pairs, reversed(shares), strict=True):
            z += (share - scale * float(hd @ z)) * d
        return z

    def norm(self, v: Floats) -> float:
        """sqrt(vᵀ P v), without the pairs."""
        return float(np.sqrt(max(float(v @ symmetric_product(self._matrix, v)), 0.0)))
