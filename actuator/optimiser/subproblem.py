"""The subproblem of a Newton step: the physics as a quadratic, the terms that depend on χ alone exact.

    min over s of   r·s + ½ sᵀ (B + Q) s + D(χ + s),   D = C_χ + C_A + C_i,

Q being the matrix of the step terms, and no vertex changing by more than a reach. C_χ and C_i are walls: a quadratic
model of them holds only as far as the next kink, which is why they are not part of the quadratic. C_χ and the reach are
bounds of an interior point method (:mod:`actuator.optimiser.interior_point`); C_A and C_i are followed by Newton's
method itself. Once the interior point tells which constraints are active, the active set method
(:mod:`actuator.optimiser.active_set`) finds the solution to the last digits. No physics is computed here.
"""

from __future__ import annotations

from dataclasses import replace

from actuator.arrays import Floats
from actuator.linear import DirectSolver
from actuator.optimiser.active_set import on_bound
from actuator.optimiser.controls import CONTROLS, Controls
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.interior_point import InteriorPoint
from actuator.optimiser.proposal import Proposal, Task
from actuator.optimiser.quadratic import Inverse, Quadratic
from actuator.terms.design import DesignObjective
from actuator.terms.step import Metric


class Subproblem:
    """Solves the subproblems of one case.

    Args:
        design: the χ-only terms.
        solver: direct solver on the vertices' pattern.
        norm: of the design.
        controls: the numbers that steer it.
    """

    def __init__(
        self, design: DesignObjective, solver: DirectSolver, norm: Metric, controls: Controls = CONTROLS
    ) -> None:
        self._design, self._norm, self._controls = design, norm, controls
        # An upper triangle's rows begin with the diagonal.
        self._inverse = Inverse(solver, norm, design.gather.indptr[:-1])

    def solve(
        self,
        chi: Floats,
        value: float,
        linear: Floats,
        curvature: Curvature,
        quadratic: Floats,
        reach: float,
        *,
        exact: bool = True,
    ) -> Proposal | None:
        """Minimise from s = 0.

        Args:
            chi, value: design and the sum of its terms at s = 0.
            linear: r, (n_vertices,).
            curvature: B.
            quadratic: data of Q's upper triangle, on the pattern of ``norm``.
            reach: largest change of χ.
            exact: whether to find the solution on the active constraints even where it gains little, which takes
                several times as long. It promises hardly more, but only there the gradient of C_χ is determined.

        Returns:
            None if no step lowers the objective.
        """
        controls, physics = self._controls, Quadratic(linear, curvature, self._design.gather.matrix(quadratic))
        task = Task(self._design, chi, value, physics, reach)
        search = InteriorPoint(task, self._inverse, self._norm, controls)
        patience, rough = controls.max_corrections, False
        for _ in range(controls.max_interior_steps):
            if not search.advance():
                break
            gain = -search.best.change
            if abs(search.drop) >= controls.subproblem_gain * search.length * gain:
                continue
            little = gain <= controls.worthless_gain * abs(value)
            if self._design.bound is None:
                break
            rough = little and not exact
            if rough:
                break
            met = search.met()
            solved = None if met is None else on_bound(task, self._inverse, search.s, met, search.best, controls)
            if solved is not None:
                return solved
            patience -= 1
            if patience < 0 or not little:
                break
        return replace(search.best, rough=rough) if search.best.change < 0.0 else None
