"""The optimiser without its model: what gradients of the objective alone find, with all else as in the program.

An update minimises, as in :mod:`actuator.optimiser`, a quadratic of the physics plus the exact terms of χ plus the step
term C_t. Here the quadratic's linear part is the gradient, and its curvature B is either the multiple of the norm that
the program begins with (first order), or what the changes of the gradient between accepted designs tell by the same
limited-memory BFGS update (quasi-Newton). Steps are accepted and Δt is adapted by the program's rules and constants.
"""

from __future__ import annotations

import math

from actuator.arrays import Floats
from actuator.failure import SolveFailure
from actuator.optimiser.controls import CONTROLS
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.proposal import Proposal
from actuator.optimiser.subproblem import Subproblem
from actuator.solve.reduced import Evaluation, ReducedObjective
from actuator.terms.step import Metric

FIRST_STEP = 100.0
#: Largest change of χ in one update: the most that the program's inner problem allows in one step.
REACH = CONTROLS.reach_range[1]


class GradientDescent:
    """Updates of one case by gradients.

    Args:
        objective: the case.
        chi: initial design, (n_vertices,).
        learns: whether B follows from the gradients, or stays what it is.

    Attributes:
        at: the last accepted design.
        evaluations, updates: designs whose state was solved for, and accepted ones.
        finished: whether no smaller step helps.
    """

    def __init__(self, objective: ReducedObjective, chi: Floats, *, learns: bool) -> None:
        self._objective, self._learns = objective, learns
        self._metric = Metric(
            objective.discretisation,
            objective.objective,
            objective.design.gather,
            solver=objective.equilibrium.solver,
            threads=objective.equilibrium.threads,
        )
        self._subproblem = Subproblem(objective.design, objective.equilibrium.vertex_solver(), self._metric)
        self._curvature = Curvature(self._metric, CONTROLS.first_curvature / self._metric.measure)
        self._dt = FIRST_STEP
        self.at: Evaluation = objective.evaluate(chi)
        self._gradient = objective.gradient(self.at)
        self.evaluations, self.updates, self.finished = 1, 0, False

    @property
    def _physics(self) -> Floats:
        """Gradient of all terms that depend on the state, (n_vertices,)."""
        return self._gradient.total - self.at.design.gradient

    def update(self) -> None:
        """One accepted design, unless no smaller step helps."""
        while self._dt > CONTROLS.least_time_step * FIRST_STEP:
            quadratic = self._metric.upper / self._dt**2
            proposal = self._subproblem.solve(
                self.at.chi, self.at.design.value, self._physics, self._curvature, quadratic, REACH
            )
            if proposal is None:
                self._dt *= CONTROLS.backtracking
            elif self._take(proposal):
                self.updates += 1
                return
        self.finished = True

    def _take(self, proposal: Proposal) -> bool:
        """Evaluate the proposed design, accept or refuse it, and adapt Δt."""
        step, old, physics = proposal.step, self.at, self._physics
        length = self._metric.norm(step)
        step_term = 0.5 * (length / self._dt) ** 2
        promised = proposal.change - step_term  # negative
        self.evaluations += 1
        try:
            new = self._objective.evaluate(old.chi + step, (old.state.x, old.state.p))
            ratio = (new.value - old.value) / promised
            enough = ratio > CONTROLS.sufficient_decrease
            gradient = self._objective.gradient(new, self._gradient.adjoint) if enough else None
        except SolveFailure:
            gradient = None
        if gradient is None:
            self._dt = min(CONTROLS.backtracking * self._dt, length / math.sqrt(-2.0 * promised))
            return False
        self.at, self._gradient = new, gradient
        if self._learns:
            self._curvature.learn(step, self._physics - physics)
        agreement = min(ratio, 2.0 - ratio)
        if agreement < CONTROLS.poor_agreement:
            self._dt *= CONTROLS.backtracking
        elif agreement > CONTROLS.good_agreement:
            self._dt *= CONTROLS.trust_factor
        return True
