"""Eq. (5) for the pressure at given displacements: linear, symmetric and positive definite."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver


class Inverted(SolveFailure):
    """An element is turned inside out, so that there is nothing to solve."""


@dataclass
class FlowWorkspace:
    """The solver that successive :class:`Flow` objects take over from each other."""

    solver: DirectSolver
    owner: Flow | None = None


class Flow:
    """The factorised matrix of Eq. (5) for one design and one field of displacements.

    Args:
        workspace: whose solver it takes over.
        data: of the matrix' upper triangle.
        chi, x: the design and reduced displacements that it belongs to.

    Raises:
        actuator.failure.SolveFailure: if the matrix cannot be factorised.
    """

    def __init__(self, workspace: FlowWorkspace, data: Floats, chi: Floats, x: Floats) -> None:
        workspace.owner = None
        workspace.solver.factorise(data)
        workspace.owner = self
        self._workspace, self._at = workspace, (chi.copy(), x.copy())

    def belongs_to(self, chi: Floats, x: Floats) -> bool:
        """Whether it is that of a design and displacements."""
        return all(map(np.array_equal, self._at, (chi, x)))

    def solve(self, right: Floats, *, check: bool = True) -> Floats:
        """Solve for one or several right-hand sides, (n_vertices,) or (n_vertices, m).

        Args:
            right: flows, mm³/s.
            check: whether to check the residual.

        Raises:
            actuator.failure.SolveFailure: if the check fails.
        """
        if self._workspace.owner is not self:
            raise RuntimeError("these factors were replaced by those of other displacements; ask for them again")
        return self._workspace.solver.solve(right) if check else self._workspace.solver.solve(right, check=None)
