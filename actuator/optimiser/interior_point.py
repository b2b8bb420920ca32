"""The interior point method of a subproblem: C_χ and the reach as bounds, C_A and C_i by Newton's method."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Bools, Floats, Ints
from actuator.equations.tangent import symmetric_product
from actuator.optimiser.barrier import Barrier, Bounds
from actuator.optimiser.controls import Controls
from actuator.optimiser.proposal import Proposal, Task
from actuator.optimiser.quadratic import Inverse
from actuator.terms.design import DesignTerms
from actuator.terms.step import Metric


class InteriorPoint:
    """The search of one subproblem, step by step.

    Args:
        task: the subproblem.
        inverse: of Hessians.
        norm: of the design.
        controls: the numbers that steer it.

    Attributes:
        s: where it is.
        best: the lowest point so far.
        drop, length: by how much the last step went below the best before it, and its share of a whole step.
    """

    def __init__(self, task: Task, inverse: Inverse, norm: Metric, controls: Controls) -> None:
        self._task, self._inverse, self._norm, self._controls = task, inverse, norm, controls
        design = task.design
        self.s: Floats = np.zeros_like(task.chi)
        self._bent = np.zeros_like(task.chi)  # (B + Q) s
        self._there = design.smooth(task.chi)
        self.best = Proposal(self.s, 0.0, task.value)
        self.drop, self.length = 0.0, 1.0
        force = np.abs(task.physics.linear + self._there.gradient)
        self._still = not force.any()
        self._share = design.from_points(np.ones_like(design.points.volumes))  # volume of each vertex
        self._diagonal = design.gather.indptr[:-1]
        passive = self._passive_bounds()
        self._passive = len(passive)  # the first ones
        bounds = [*passive, *self._reach_bounds()]
        self._barrier = Barrier(bounds, controls.first_barrier * float(force.sum()) / norm.volume, controls)

    def advance(self) -> bool:
        """Take one step; False if there is none that leads down."""
        if self._still:
            return False
        task, controls, barrier = self._task, self._controls, self._barrier
        design, there = task.design, self._there
        wall = barrier.linearise(self.s)
        force, hessian = task.physics.linear + self._bent + there.gradient, there.hessian
        for _ in range(controls.max_corrections):
            inverse = self._inverse(hessian + wall, task.physics)
            residual = force + barrier.push(-inverse(force + barrier.push()))
            p = -inverse(residual)
            slope = float(residual @ p)
            if not slope < 0.0:
                return False
            length = barrier.longest(p)
            ahead = design.smooth(task.chi + (self.s + length * p))
            if self._follows(there, ahead, length, p, slope):
                break
            # What lies ahead is steeper: with the mean of both Hessians the step stops before it.
            hessian = 0.5 * (hessian + ahead.hessian)
        while not self._follows(there, ahead, length, p, slope) and length > controls.shortest:
            length *= controls.backtracking
            ahead = design.smooth(task.chi + (self.s + length * p))
        barrier.move(length)
        self.s, self._bent, self._there = self.s + length * p, self._bent + length * task.physics.bent(p), ahead
        found = task.proposal(self.s, self._bent, ahead.value)
        self.drop, self.length = self.best.change - found.change, length
        if self.drop > 0.0:
            self.best = found
        return True

    def met(self) -> Bools | Ints | None:
        """Which points touch a bound of C_χ at the solution, or None where the last step does not tell.

        1 where it is the upper bound, -1 where it is the lower one.
        """
        found = self._barrier.met(self._passive)
        if found is None:
            return None
        upper, *lower = found
        return upper.astype(np.int8) - lower[0] if lower else upper

    def _follows(self, there: DesignTerms, ahead: DesignTerms, length: float, p: Floats, slope: float) -> bool:
        """Whether the smooth terms after a step lie little above their quadratic."""
        step = length * p
        bend = float(step @ symmetric_product(self._task.design.gather.matrix(there.hessian), step))
        above = ahead.value - there.value - float(there.gradient @ step) - 0.5 * bend
        return above <= self._task.rounding - self._controls.poor_agreement * length * slope

    def _passive_bounds(self) -> list[Bounds]:
        """C_χ, unless it weighs nothing: above, and if there are solid regions below."""
        design, bound = self._task.design, self._task.design.bound
        if bound is None:
            return []
        points, compliance, stiffness = design.points, 1.0 / bound.weight, design.point_stiffness
        rise, fall = bound.rooms(self._task.chi)
        found = [Bounds(rise, points.volumes, compliance, points.at, design.from_points, stiffness)]
        if fall is not None:
            found.append(
                Bounds(
                    fall,
                    points.volumes,
                    compliance,
                    lambda s: -points.at(s),
                    lambda force: -design.from_points(force),
                    stiffness,
                )
            )
        return found

    def _reach_bounds(self) -> list[Bounds]:
        """The largest change of χ either way."""
        room, share = np.full_like(self._task.chi, self._task.reach), self._share
        return [
            Bounds(room, share, 0.0, lambda s: s, lambda force: share * force, self._on_diagonal),
            Bounds(room, share, 0.0, lambda s: -s, lambda force: -share * force, self._on_diagonal),
        ]

    def _on_diagonal(self, sigma: Floats) -> Floats:
        data = np.zeros_like(self._norm.upper)
        data[self._diagonal] = self._share * sigma
        return data
