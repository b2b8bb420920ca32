"""The inner problem: the design step that minimises the model plus the step term δᵀ M δ / (2 Δt²).

A proximal quasi-Newton method: every step minimises a quadratic of the physics together with the terms that depend on χ
alone, which stay exact (:mod:`actuator.optimiser.subproblem`). The curvature of the quadratic is what gradients of the
model at the points so far have shown; where nothing is known yet, trust in it is one factor. After each step the
displacements are corrected with the factors at hand, which lets the model follow the truth over many steps. Only the
last step pays for a solution on the active constraints where that promises little.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.optimiser.controls import CONTROLS, Controls
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.model import Model, ModelPoint
from actuator.optimiser.proposal import Proposal
from actuator.optimiser.subproblem import Subproblem
from actuator.solve.reduced import ReducedObjective
from actuator.terms.step import Metric


@dataclass(frozen=True)
class Trust:
    """How far the quadratic of the physics is trusted.

    Attributes:
        stiffness: factor on the curvature that is assumed where none has been seen.
        reach: largest change of χ in a step.
    """

    stiffness: float
    reach: float

    @classmethod
    def first(cls, controls: Controls) -> Trust:
        """Before anything is known: the curvature holds back, so that the reach need not."""
        return cls(1.0, controls.reach_range[1])


@dataclass(frozen=True)
class InnerStep:
    """Solution of the inner problem.

    Attributes:
        start: the model at δ = 0.
        trail: the model after each step, the solution last; empty if no step was found.
        steps: subproblems that it took.
        trust: to begin the next inner problem with.
    """

    start: ModelPoint
    trail: tuple[ModelPoint, ...]
    steps: int
    trust: Trust

    @property
    def point(self) -> ModelPoint:
        """The solution; the start if no step was found."""
        return self.trail[-1] if self.trail else self.start

    def change(self, point: ModelPoint) -> float:
        """Predicted change of the total objective at a point of the trail, without the step term."""
        return point.value - self.start.value


@dataclass(frozen=True)
class _Landing:
    """Where a search back along a proposal ended.

    Attributes:
        point: low enough, with corrected displacements; None if there is none.
        length, quality: share of the proposal, and gain over its promise.
        drifted: whether the displacements have moved so far that the factors at hand no longer correct them.
    """

    point: ModelPoint | None = None
    length: float = 0.0
    quality: float = 0.0
    drifted: bool = False


class InnerProblem:
    """Solves the inner problems of one case."""

    def __init__(self, objective: ReducedObjective, metric: Metric, controls: Controls = CONTROLS) -> None:
        self._metric, self._controls = metric, controls
        self._subproblem = Subproblem(objective.design, objective.equilibrium.vertex_solver(), metric, controls)

    def blank(self) -> Curvature:
        """The curvature before anything has been seen of it."""
        return Curvature(self._metric, self._controls.first_curvature / self._metric.measure, self._controls)

    def solve(
        self,
        model: Model,
        dt: float,
        max_steps: int,
        curvature: Curvature | None = None,
        trust: Trust | None = None,
    ) -> InnerStep:
        """Minimise from δ = 0.

        Args:
            dt: Δt.
            max_steps: after which the best step so far is returned.
            curvature: seen earlier; what this inner problem sees is added to it.
            trust: for the first step.
        """
        controls, curvature = self._controls, self.blank() if curvature is None else curvature
        trust = Trust.first(controls) if trust is None else trust
        trust = Trust(trust.stiffness, max(trust.reach, controls.reach_range[0]))  # the model is new
        now = start = model.start()
        gradient = model.gradient(now)
        diagonal = model.diagonal(now, controls.curvature_probes)
        curvature.rebase(diagonal, trust.stiffness)
        trail: list[ModelPoint] = []
        gains, steps, exact = [0.0], 0, False
        quadratic = self._metric.upper / dt**2
        while steps < max_steps and trust.stiffness < controls.stiffness_range[1]:
            steps += 1
            physics = gradient - now.design.gradient
            linear = physics + self._metric @ now.delta / dt**2
            proposal = self._subproblem.solve(
                now.chi, now.design.value, linear, curvature, quadratic, trust.reach, exact=exact
            )
            if proposal is None or -proposal.change < controls.worthless_gain * gains[-1]:
                if proposal is None or not proposal.rough:
                    break
                exact = True
                continue
            landing = self._land(model, now, proposal, dt)
            before, trust = trust, _adapted(trust, landing, float(np.abs(proposal.step).max()), controls)
            if landing.point is not None:
                point, gradient = landing.point, model.gradient(landing.point)
                curvature.learn(point.delta - now.delta, gradient - point.design.gradient - physics)
                now = point
                trail.append(now)
                gains.append(self._value(start, dt) - self._value(now, dt))
            if trust.stiffness != before.stiffness:
                curvature.rebase(diagonal, trust.stiffness)
            lately = gains[-1] - gains[-1 - controls.window] if len(gains) > controls.window else np.inf
            spent = landing.drifted or landing.point is None
            ended = lately < controls.negligible_gain * gains[-1]
            if exact or (spent and trail) or (ended and not proposal.rough):
                break
            exact = ended
        return InnerStep(start, tuple(trail), steps, trust)

    def _value(self, at: ModelPoint, dt: float) -> float:
        return at.value + 0.5 * float(at.delta @ (self._metric @ at.delta)) / dt**2

    def _land(self, model: Model, now: ModelPoint, proposal: Proposal, dt: float) -> _Landing:
        """Back along a proposal to where the model is low enough after a correction of its displacements."""
        controls, length, start = self._controls, 1.0, self._value(now, dt)
        dx = model.sensitivity @ proposal.step
        while length > controls.shortest:
            least = -controls.sufficient_decrease * length * proposal.change
            trial = model(now.delta + length * proposal.step, now.dx + length * dx)
            if trial is not None and start - self._value(trial, dt) > least:
                corrected = model.corrected(trial)
                gain = -np.inf if corrected is None else start - self._value(corrected, dt)
                if corrected is not None and gain > least:
                    left = np.linalg.norm(corrected.force) > controls.force_drift * np.linalg.norm(trial.force)
                    moved = abs(corrected.value - trial.value) > controls.negligible_gain * gain
                    return _Landing(corrected, length, -gain / proposal.change, bool(left and moved))
            length *= controls.backtracking
        return _Landing()


def _adapted(trust: Trust, landing: _Landing, size: float, controls: Controls) -> Trust:
    """Trust after a proposal whose largest change of χ is ``size``."""
    factor, (least, most) = controls.stiffness_factor, controls.stiffness_range
    stiffer, softer = min(factor * trust.stiffness, most), max(trust.stiffness / factor, least)
    if landing.point is None:
        return Trust(stiffer, controls.backtracking * trust.reach)
    if landing.length < 1.0:
        return Trust(stiffer, landing.length * size)
    if landing.quality < controls.poor_agreement:
        return Trust(stiffer, trust.reach)
    reach = max(trust.reach, min(2.0 * size, controls.reach_range[1]))
    return Trust(softer if landing.quality > controls.good_agreement else trust.stiffness, reach)
