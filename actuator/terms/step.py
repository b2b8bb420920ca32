"""C_t of Eq. (15), the step term: value δᵀ M δ / (2 Δt²), gradient M δ / Δt², curvature M / Δt²."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats
from actuator.equations.assembly import Gather
from actuator.equations.discretisation import Discretisation
from actuator.linear import DirectSolver, SolverName, make_solver
from actuator.parameters import Objective


class Metric:
    """M of C_t: ∫ δ² + L_t² ‖∇δ‖², counted in the cubed length unit of the paper's numbers, per half actuator.

    Args:
        discretisation: spaces of the case.
        objective: L_t, the length unit, and how many halves Ω is.
        gather: pattern of upper triangles on vertices.
        solver, threads: direct solver for M⁻¹.

    Attributes:
        upper: M's data on the pattern.
        volume: |Ω|, mm³.
        measure: |Ω| of a half in the cubed length unit: 1ᵀ M 1.
    """

    def __init__(
        self,
        discretisation: Discretisation,
        objective: Objective,
        gather: Gather,
        solver: SolverName = "auto",
        threads: int = 2,
    ) -> None:
        unit = objective.length_unit**3 * objective.halves
        matrix = discretisation.mass + objective.diffusivity_length**2 * discretisation.stiffness
        self.matrix = sp.csr_array(matrix / unit)
        self.size = self.matrix.shape[0]
        self.volume = discretisation.volume
        self.measure = self.volume / unit
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
