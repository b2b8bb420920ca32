"""The metric of design steps."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats
from actuator.equations.assembly import Gather
from actuator.equations.discretisation import Discretisation
from actuator.linear import DirectSolver, SolverName, make_solver


class Metric:
    """M of C_t = δᵀ M δ / (2 Δt²), Eq. (15): ∫ δ² + L_t² ‖∇δ‖², in mm³.

    Args:
        discretisation: spaces of the case.
        diffusivity_length: L_t, mm.
        gather: pattern of upper triangles on vertices; ``upper`` holds M's data on it.
        solver, threads: direct solver for M⁻¹.
    """

    def __init__(
        self,
        discretisation: Discretisation,
        diffusivity_length: float,
        gather: Gather,
        solver: SolverName = "auto",
        threads: int = 2,
    ) -> None:
        self.matrix = sp.csr_array(discretisation.mass + diffusivity_length**2 * discretisation.stiffness)
        self.size = self.matrix.shape[0]
        self.volume = discretisation.volume
        upper = sp.csr_array(sp.triu(self.matrix, format="csr"))
        upper.sort_indices()
        if not np.array_equal(upper.indices, gather.indices):
            raise ValueError("the metric must have the pattern of the vertices")
        self.upper: Floats = upper.data
        self._solver_of = lambda: make_solver(
            gather.indptr, gather.indices, symmetric=True, positive_definite=True, name=solver, threads=threads
        )

    @cached_property
    def _solver(self) -> DirectSolver:
        solver = self._solver_of()
        solver.factorise(self.upper)
        return solver

    def __matmul__(self, v: Floats) -> Floats:
        return self.matrix @ v

    def norm(self, v: Floats) -> float:
        """sqrt(vᵀ M v)."""
        return float(np.sqrt(v @ (self.matrix @ v)))

    def solve(self, b: Floats) -> Floats:
        """M⁻¹ b for one or several columns."""
        return self._solver.solve(b)

    def dual_norm(self, g: Floats) -> float:
        """sqrt(gᵀ M⁻¹ g): the largest gᵀδ among the steps with δᵀ M δ = 1."""
        return float(np.sqrt(g @ self.solve(g)))
