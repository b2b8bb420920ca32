"""The tangent of the state equations at one state, and everything that solves with it.

One factorisation of the symmetric mechanical block preconditions GMRES on the coupled tangent; it serves several
Newton steps, the adjoint and later designs, until the iteration count says that a new one is cheaper. The tangent's
memory, gigabytes with its factors, is there once: a new linearisation takes it over, and the one before can no longer
be used.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from actuator.arrays import Floats
from actuator.equations.tangent import Tangent
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver, gmres
from actuator.material.constants import Constants
from actuator.solve.coupled import CoupledSystem
from actuator.solve.state import State

#: Iterations of one coupled solve after which the mechanical block is factorised anew: on the paper's mesh a
#: factorisation costs about as much as this many triangular solves.
STALE_ITERATIONS = 25
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
    products: int = 0


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
        factorised: whether ``mechanics`` holds factors, of this tangent or of an older one.
        untried: whether no coupled solve has used them yet.
    """

    tangent: Tangent
    mechanics: DirectSolver
    darcy: DirectSolver
    work: Work
    owner: Linearisation | None = None
    factorised: bool = False
    untried: bool = False


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
        if fresh or not workspace.factorised:
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
            workspace.factorised = False
            workspace.mechanics.factorise(workspace.tangent.xx.data)
            workspace.work.factorisations += 1
            workspace.factorised = self._exact = True
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
        workspace.work.krylov += result.iterations
        if result.relative_residual > tolerance and not untried:
            self.factorise()
            result = solved(x0=result.x, max_iterations=MAX_KRYLOV, restart=MAX_KRYLOV)
            workspace.work.krylov += result.iterations
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
