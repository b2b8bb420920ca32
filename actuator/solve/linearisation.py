"""The tangent of the state equations at one state, and everything that solves with it.

One factorisation of the symmetric mechanical block preconditions GMRES on the coupled tangent; it serves several
Newton steps, the adjoint and later designs, until a new one is cheaper than the iterations that it would save. The
tangent's memory, gigabytes with its factors, is there once: a new linearisation takes it over, and the one before can
no longer be used.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from actuator.arrays import Floats
from actuator.equations.tangent import Tangent
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver, gmres
from actuator.material.constants import Constants
from actuator.solve.coupled import CoupledSystem
from actuator.solve.state import State

#: Iterations of one coupled solve after which the mechanical block is factorised anew, whatever that costs.
STALE_ITERATIONS = 25
#: Operations of a factorisation that take as long as one entry of the factors does in one iteration: a factorisation
#: is bound by arithmetic, an iteration by memory. Measured on 1,080 to 9,504 cells (docs/project/notebook/fast.md).
OPERATIONS_PER_ENTRY = 50.0
#: Part of a factorisation's price that the iterations of a state and its adjoint may take before the next one is due.
PATIENCE = 0.25
#: Iterations of the first coupled solve with new factors.
MAX_KRYLOV = 120
#: Residual that serves where rounding lets a solve get no lower: adjoints far beyond the strain limit, all C_Ψ's.
ROUNDING = 1e-9


@dataclass
class Work:
    """Counts of what has been done, for the history and for benchmarks."""

    newton: int = 0
    krylov: int = 0
    factorisations: int = 0
    darcy_factorisations: int = 0
    states: int = 0
    adjoints: int = 0


class Outdated(RuntimeError):
    """A linearisation was used after another one had taken over its memory: a mistake of the program."""


@dataclass
class Workspace:
    """The memory that successive linearisations take over from each other.

    Attributes:
        tangent: blocks on their fixed pattern.
        mechanics, darcy: direct solvers of K_xx and K_pp.
        work: what is counted.
        owner: the linearisation that may use it.
        factors_of: the state whose mechanical block ``mechanics`` holds the factors of, None if it holds none.
        untried: whether no coupled solve has used them yet.
        uses: iterations of each state with its adjoint that they have served.
    """

    tangent: Tangent
    mechanics: DirectSolver
    darcy: DirectSolver
    work: Work
    owner: Linearisation | None = None
    factors_of: State | None = None
    untried: bool = False
    uses: list[int] = field(default_factory=list)

    @property
    def worn(self) -> bool:
        """Whether to factorise anew before the next state.

        Iterations grow as designs leave the one that was factorised. New factors are made long before these iterations
        outweigh them: with old ones the optimiser's model follows the state less far (docs/project/notebook/fast.md).
        """
        if not self.uses:
            return False
        seen = self.mechanics.statistics
        price = (seen.operations or 0.0) / (OPERATIONS_PER_ENTRY * (seen.factor_entries or 1)) or STALE_ITERATIONS
        return self.uses[-1] > PATIENCE * price

    def count(self, iterations: int) -> None:
        """Book iterations of a coupled solve."""
        self.work.krylov += iterations
        if self.uses:
            self.uses[-1] += iterations


class Linearisation:
    """The tangent at one design and state.

    Args:
        workspace: whose memory it takes over.
        at: design, displacements, pressure and nodal forces, converged or not.
        source: Q_in at the quadrature points.
        coefficients: of the material's laws.
        scales: forces (N) and flows (mm³/s) that residuals are measured against.
        fresh: whether to factorise the mechanical block here; else factors of an older tangent may serve.

    Raises:
        actuator.failure.SolveFailure: if a block cannot be factorised.
    """

    def __init__(
        self,
        workspace: Workspace,
        at: State,
        source: Floats,
        coefficients: Constants,
        scales: tuple[float, float],
        *,
        fresh: bool,
    ) -> None:
        self.at = at
        self._workspace, self._scales = workspace, scales
        self._exact = False  # whether the factors are those of this tangent
        workspace.owner = None  # what fails on the way leaves nothing that could be used
        workspace.tangent.assemble(source, coefficients, at.chi, at.x, at.p, at.nodal)
        workspace.darcy.factorise(workspace.tangent.pp.data)
        workspace.work.darcy_factorisations += 1
        workspace.owner = self
        if fresh or workspace.factors_of is None:
            self.factorise()

    @property
    def _owned(self) -> Workspace:
        if self._workspace.owner is not self:
            raise Outdated("this linearisation's memory was taken over by another one; linearise again")
        return self._workspace

    @property
    def tangent(self) -> Tangent:
        """The assembled blocks."""
        return self._owned.tangent

    def factorise(self) -> None:
        """Factorise the mechanical block of this tangent, unless that has been done."""
        workspace = self._owned
        if not self._exact:
            workspace.factors_of = None
            workspace.mechanics.factorise(workspace.tangent.xx.data)
            workspace.work.factorisations += 1
            workspace.factors_of, workspace.uses, self._exact = self.at, [0], True
        workspace.untried = True

    @property
    def negative_eigenvalues(self) -> int | None:
        """Of the mechanical block factorised last; None if the solver does not tell (SuperLU)."""
        return self._owned.mechanics.statistics.negative_eigenvalues

    def mechanics(self, rx: Floats) -> Floats:
        """K_xx⁻¹ rx, (n_x,), with the factors at hand, to the precision of the scheme."""
        return self._owned.mechanics.solve(rx, check=None)

    def flow(self, rp: Floats) -> Floats:
        """K_pp⁻¹ rp, (n_p,), to the precision of its factors."""
        return self._owned.darcy.solve(rp, check=None)

    def solve(
        self,
        bx: Floats,
        bp: Floats,
        tolerance: float,
        guess: tuple[Floats, Floats] | None = None,
        *,
        transposed: bool = False,
    ) -> tuple[Floats, Floats]:
        """Solve tangent · (dx, dp) = (bx, bp), or tangentᵀ · (Λx, Λp) = (bx, bp), to a relative residual.

        By GMRES with the factors at hand, and once more with those of this tangent if that takes long.

        Raises:
            actuator.failure.SolveFailure: if it is not reached.
        """
        workspace = self._owned
        force, flow = self._scales
        if transposed:
            force, flow = 1.0 / force, 1.0 / flow
        system = CoupledSystem(workspace.tangent, self.mechanics, workspace.darcy, force, flow, transposed)
        n, right = len(bx), system.scaled(bx, bp)
        solved = partial(gmres, system.multiply, right, precondition=system.precondition, tolerance=0.5 * tolerance)
        x0 = None if guess is None else np.concatenate(guess)
        untried = workspace.untried
        limit = MAX_KRYLOV if untried else STALE_ITERATIONS
        result = solved(x0=x0, max_iterations=limit, restart=limit)
        workspace.count(result.iterations)
        if result.relative_residual > tolerance and not untried:
            self.factorise()
            result = solved(x0=result.x, max_iterations=MAX_KRYLOV, restart=MAX_KRYLOV)
            workspace.count(result.iterations)
        workspace.untried = False
        if result.relative_residual > (max(tolerance, ROUNDING) if result.stagnated else tolerance):
            raise SolveFailure(
                f"A coupled linear solve stopped at a relative residual of {result.relative_residual:.1e} instead of "
                f"{tolerance:.1e}: the state is close to a limit point or the tolerance beyond what double precision "
                "can reach; take smaller steps or loosen the tolerance."
            )
        x = result.x[:n]
        # The flow equations are met to rounding, for the same reason as in the state. That moves the residual of the
        # others a little, which half the tolerance made room for.
        coupled = workspace.tangent.xp.T @ x if transposed else workspace.tangent.px @ x
        return x, workspace.darcy.solve(bp - coupled)
