"""How far a design is from a stationary point, in a measure without units."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from actuator.domain import Floats
from actuator.linear import make_solver
from actuator.reduced import Evaluation, Gradient, ReducedObjective


class Stationarity:
    """Largest relative change of the objective per unit change of the design.

    The unit is a step δ with δᵀ M δ = |Ω|: a uniform change of χ by one, or a rougher one that is as large in the
    norm of C_t (Eq. 14). The measure is sqrt(|Ω| gᵀ M⁻¹ g) / Σ |C_k|: the dual norm of the gradient, which does
    not depend on the mesh as a Euclidean norm of nodal values would, over the sum of the objective's terms.
    """

    def __init__(self, metric: sp.csr_array, objective: ReducedObjective) -> None:
        upper = sp.csr_array(sp.triu(metric, format="csr"))
        self._solver = make_solver(upper.indptr, upper.indices, symmetric=True, positive_definite=True)
        self._solver.factorise(upper.data)
        self._volume = objective.discretisation.volume

    def __call__(self, evaluation: Evaluation, gradient: Gradient) -> float:
        g: Floats = gradient.total
        dual = float(g @ self._solver.solve(g))
        return float(np.sqrt(self._volume * dual)) / sum(abs(v) for v in evaluation.terms.values())
