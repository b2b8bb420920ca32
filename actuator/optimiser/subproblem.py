"""The subproblem of a Newton step: the physics as a quadratic, the terms that depend on χ alone exact.

    min over s of   r·s + ½ sᵀ (B + Q) s + D(χ + s),   D = C_χ + C_A + C_i,

Q being the matrix of the step terms, and no vertex changing by more than a reach. C_χ and C_i are walls: a quadratic
model of them holds only as far as the next kink, which is why they are not part of the quadratic. C_χ and the reach are
bounds of an interior point method (:mod:`actuator.optimiser.barrier`); C_A and C_i are followed by Newton's method
itself. No physics is computed here.

An interior point stops short of the walls, here by 1e-8 of χ or less. C does not feel that, but its gradient does: C_χ
is so steep that a design pressed against it with its whole force is no farther than that beyond its bound. So once
the active set is identified, it is kept and corrected (primal-dual active set method, Hintermüller, Ito &
Kunisch 2002, doi:10.1137/S1052623401383558), which solves the subproblem to the last digits.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from actuator.arrays import Bools, Floats
from actuator.equations.tangent import symmetric_product
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver
from actuator.optimiser.barrier import Barrier, Bounds
from actuator.optimiser.curvature import Curvature
from actuator.terms.design import DesignObjective, DesignTerms
from actuator.terms.step import Metric

#: Most steps of the interior point method; where they run out, the best design so far serves.
MAX_NEWTON = 20
#: Most corrections of the design Hessian by what lies ahead; factor per trial and least length of the search after it.
LOOK_AHEAD, SHRINK, SHORTEST = 8, 0.4, 1e-5
#: Largest change of χ in one Newton step; how far C_A and C_i may lie above their quadratic, over the linear decrease.
LARGEST, ENOUGH = 1.0, 0.25
#: Largest shift of a Hessian that is not positive definite, over that of B: more means that something else is wrong.
LARGEST_SHIFT = 1e18
#: The search ends when a step, had it been taken whole, would bring less than this part of all that was gained.
STALLED = 0.05
#: What terms may be off by in double precision.
ROUNDING = 1e-14
#: Most steps of the active set method; it gives up where one loses more than this part of the gain.
MENDING, LOST = 5, 0.1
#: Gain over the design terms below which only the force of the walls is left to be found, and it is worth some more
#: interior point steps, at most so many, until the active set is identified.
SMALL, PATIENCE = 1e-4, 4
#: First barrier of the bounds, over the forces at s = 0 times a change of χ by one.
START = 0.1


@dataclass(frozen=True)
class Proposal:
    """Solution of a subproblem: the step, what it promises (negative), and the sum of the design terms there."""

    step: Floats
    change: float
    value: float


@dataclass(frozen=True)
class _Quadratic:
    """r·s + ½ sᵀ (B + Q) s."""

    linear: Floats
    curvature: Curvature
    upper: sp.csr_array

    def bent(self, s: Floats) -> Floats:
        """(B + Q) s."""
        return self.curvature @ s + symmetric_product(self.upper, s)

    def value(self, s: Floats, bent: Floats) -> float:
        """At a step, of which (B + Q) s is known."""
        return float(self.linear @ s) + 0.5 * float(s @ bent)


class Subproblem:
    """Newton's method on the sparse part, Woodbury's formula for the low rank.

    Args:
        design: the χ-only terms.
        solver: direct solver on the vertices' pattern.
        norm: of the design, whose matrix shifts a Hessian that is not positive definite.
    """

    def __init__(self, design: DesignObjective, solver: DirectSolver, norm: Metric) -> None:
        self._design, self._solver, self._norm = design, solver, norm
        self._share = design.from_points(np.ones_like(design.points.volumes))  # volume of each vertex
        self._diagonal = design.gather.indptr[:-1]  # an upper triangle's rows begin with the diagonal

    def solve(
        self, chi: Floats, value: float, linear: Floats, curvature: Curvature, quadratic: Floats, reach: float
    ) -> Proposal | None:
        """Minimise from s = 0.

        Args:
            chi, value: design and the sum of its terms at s = 0.
            linear: r, (n_vertices,).
            curvature: B.
            quadratic: data of Q's upper triangle, on the pattern of ``norm``.
            reach: largest change of χ.

        Returns:
            None if no step lowers the objective.
        """
        design, physics = self._design, _Quadratic(linear, curvature, self._design.gather.matrix(quadratic))
        s = np.zeros_like(chi)
        bent = np.zeros_like(chi)  # (B + Q) s
        there = design.smooth(chi)
        force = linear + there.gradient
        if not force.any():
            return None
        barrier = Barrier(self._bounds(chi, reach), START * float(np.abs(force).sum()) / self._norm.volume)
        best, rounding = Proposal(s, 0.0, value), ROUNDING * abs(value)

        patience = PATIENCE
        for _ in range(MAX_NEWTON):
            wall = barrier.linearise(s)
            force, hessian = linear + bent + there.gradient, there.hessian
            for _ in range(LOOK_AHEAD):
                inverse = self._inverse(hessian + wall + quadratic, curvature)
                residual = force + barrier.push(-inverse(force + barrier.push()))
                p = -inverse(residual)
                slope = float(residual @ p)
                if not slope < 0.0:
                    return best if best.change < 0.0 else None
                length = min(barrier.longest(p), LARGEST / float(np.abs(p).max()))
                ahead = design.smooth(chi + (s + length * p))
                if self._above(there, ahead, length * p) < rounding - ENOUGH * length * slope:
                    break
                hessian = 0.5 * (hessian + ahead.hessian)
            while self._above(there, ahead, length * p) > rounding - ENOUGH * length * slope and length > SHORTEST:
                length *= SHRINK
                ahead = design.smooth(chi + (s + length * p))
            barrier.move(length)
            s, bent, there = s + length * p, bent + length * physics.bent(p), ahead
            terms = design.value(chi + s)
            change = physics.value(s, bent) + terms - value
            drop = best.change - change
            if drop > 0.0:
                best = Proposal(s, change, terms)
            if abs(drop) < STALLED * length * -best.change:
                if design.bound is None:
                    break
                met = barrier.met()
                solved = None if met is None else self._on_bound(chi, value, physics, reach, s, met, best)
                if solved is not None:
                    return solved
                patience -= 1
                if patience < 0 or -best.change > SMALL * abs(value):
                    break
        return best if best.change < 0.0 else None

    def _on_bound(
        self,
        chi: Floats,
        value: float,
        physics: _Quadratic,
        reach: float,
        s: Floats,
        met: Bools,
        best: Proposal,
    ) -> Proposal | None:
        """From an interior point s to the solution, with C_χ exact at the points that touch its bound.

        Args:
            met: the points that seem to, (n_cells, n_q).
            best: what the solution has to come up to.

        Returns:
            None if the set of points does not settle on one.
        """
        design, bound = self._design, self._design.bound
        assert bound is not None, "only what touches the bound comes here"
        steep, room = bound.weight, bound.room(chi)
        bent, there = physics.bent(s), design.smooth(chi + s)
        for _ in range(MENDING):
            wall: Floats = np.where(met, steep, 0.0)
            force = physics.linear + bent + there.gradient + design.from_points(wall * (design.points.at(s) - room))
            stiffness = there.hessian + design.point_stiffness(wall) + physics.upper.data
            p = -self._inverse(stiffness, physics.curvature)(force)
            s = s + p
            if float(np.abs(s).max()) > reach:
                return None
            bent, there, terms = bent + physics.bent(p), design.smooth(chi + s), design.value(chi + s)
            change = physics.value(s, bent) + terms - value
            if change > (1.0 - LOST) * best.change:
                return None
            before, met = met, np.asarray(design.points.at(s) > room)
            if np.array_equal(met, before):
                low = change < min(0.0, best.change + ROUNDING * abs(value))
                return Proposal(s, change, terms) if low else None
        return None

    def _bounds(self, chi: Floats, reach: float) -> list[Bounds]:
        """C_χ, unless it weighs nothing, and the largest change of χ either way."""
        design, found = self._design, []
        if bound := design.bound:
            found = [
                Bounds(
                    bound.room(chi),
                    design.points.volumes,
                    1.0 / bound.weight,
                    design.points.at,
                    design.from_points,
                    design.point_stiffness,
                )
            ]
        room, share = np.full_like(chi, reach), self._share
        return [
            *found,
            Bounds(room, share, 0.0, lambda s: s, lambda force: share * force, self._on_diagonal),
            Bounds(room, share, 0.0, lambda s: -s, lambda force: -share * force, self._on_diagonal),
        ]

    def _on_diagonal(self, sigma: Floats) -> Floats:
        data = np.zeros_like(self._norm.upper)
        data[self._diagonal] = self._share * sigma
        return data

    def _above(self, there: DesignTerms, ahead: DesignTerms, step: Floats) -> float:
        """By how much the terms after a step lie above their quadratic."""
        bend = float(step @ symmetric_product(self._design.gather.matrix(there.hessian), step))
        return ahead.value - there.value - float(there.gradient @ step) - 0.5 * bend

    def _inverse(self, data: Floats, curvature: Curvature) -> Callable[[Floats], Floats]:
        """(sparse + B)⁻¹; more of the norm's matrix where the sparse part is not positive definite."""
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
