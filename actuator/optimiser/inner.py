"""The inner problem: the design step that minimises the model plus the step term δᵀ M δ / (2 Δt²).

A proximal Newton method: each Newton step minimises the quadratic of the physics together with the terms that depend
on χ alone, which stay exact (:mod:`actuator.optimiser.subproblem`). Hessian products are expensive and subproblems
cheap, so that a subproblem is solved for every product, with the curvature that all products so far have shown. After
each Newton step the displacements are corrected with the factors at hand, which lets the model follow the truth over
several of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from actuator.arrays import Bools, Floats
from actuator.optimiser.controls import CONTROLS, Controls
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.model import Model, ModelPoint
from actuator.optimiser.subproblem import Subproblem
from actuator.solve.reduced import ReducedObjective
from actuator.terms.step import Metric


@dataclass(frozen=True)
class Trust:
    """How far the quadratic of the physics is trusted.

    Attributes:
        damping: μ of μ/2 ‖d‖², where ‖d‖² is the root mean square of a step d and of L_t times its gradient, squared.
        reach: largest change of χ in a Newton step.
    """

    damping: float
    reach: float

    @classmethod
    def first(cls, controls: Controls) -> Trust:
        """Before anything is known: the damping holds back, so that the reach need not."""
        return cls(controls.first_damping, controls.reach_range[1])


@dataclass(frozen=True)
class InnerStep:
    """Solution of the inner problem.

    Attributes:
        start: the model at δ = 0.
        trail: the model after each Newton step, the solution last; empty if no step was found.
        newton, products: Newton steps and Hessian products it took.
        trust: to begin the next inner problem with.
    """

    start: ModelPoint
    trail: tuple[ModelPoint, ...]
    newton: int
    products: int
    trust: Trust

    @property
    def point(self) -> ModelPoint:
        """The solution; the start if no step was found."""
        return self.trail[-1] if self.trail else self.start

    def change(self, point: ModelPoint) -> float:
        """Predicted change of the total objective at a point of the trail, without the step term."""
        return point.value - self.start.value


@dataclass
class _Newton:
    """A Newton step: d, S d, what it promises, the products it took, and what its last proposal touched of C_χ."""

    step: Floats
    dx: Floats
    change: float = 0.0
    products: int = 0
    met: Bools | None = None


@dataclass(frozen=True)
class _Landing:
    """Where a search back along a Newton step ended.

    Attributes:
        point: low enough, with corrected displacements; None if there is none.
        length, quality: share of the step, and truth over its promise.
        drifted: whether the displacements have moved so far that the factors at hand no longer correct them.
    """

    point: ModelPoint | None = None
    length: float = 0.0
    quality: float = 0.0
    drifted: bool = False


class InnerProblem:
    """Solves the inner problems of one case."""

    def __init__(self, objective: ReducedObjective, metric: Metric, controls: Controls = CONTROLS) -> None:
        self._objective, self._metric, self._controls = objective, metric, controls
        self._subproblem = Subproblem(objective.design, objective.equilibrium.vertex_solver(), metric, controls)

    def blank(self) -> Curvature:
        """The curvature before any Hessian product."""
        return Curvature(self._metric, self._controls.first_curvature / self._metric.measure, self._controls)

    def solve(
        self,
        model: Model,
        dt: float,
        max_products: int,
        curvature: Curvature | None = None,
        trust: Trust | None = None,
    ) -> InnerStep:
        """Minimise from δ = 0.

        Args:
            dt: Δt.
            max_products: Hessian products after which the best step so far is returned.
            curvature: from earlier products; those of this inner problem are added to it.
            trust: for the first Newton step.
        """
        controls, curvature = self._controls, self.blank() if curvature is None else curvature
        trust = self._trusted(trust)
        now = start = model.start()
        model.gradient(now)
        curvature.rebase(model.diagonal(now, controls.curvature_probes))
        trail: list[ModelPoint] = []
        gains, products, newton, met = [0.0], 0, 0, None
        while products < max_products and trust.damping < controls.damping_range[1]:
            newton += 1
            limit = min(controls.max_products_per_step, max_products - products)
            worth = controls.worthless_gain * gains[-1]
            step = self._newton_step(model, now, dt, curvature, trust, limit, worth, met)
            met = step.met
            products += step.products
            landing = self._land(model, now, step, dt)
            trust = _adapted(trust, step, landing, controls)
            if landing.point is not None:
                now = landing.point
                trail.append(now)
                gains.append(self._value(start, dt) - self._value(now, dt))
                if gains[-1] - gains[-2] < controls.worthless_gain * gains[-1]:
                    break
            if landing.drifted and trail:
                break
            if len(gains) > controls.window:
                lately = gains[-1] - gains[-1 - controls.window]
                if lately < controls.negligible_gain * gains[-1]:
                    break
        return InnerStep(start, tuple(trail), newton, products, trust)

    def _trusted(self, trust: Trust | None) -> Trust:
        """What to begin with: the model is new, and mistrust of the last one counts less."""
        if trust is None:
            return Trust.first(self._controls)
        controls = self._controls
        return Trust(min(trust.damping, controls.first_damping), max(trust.reach, controls.reach_range[0]))

    def _value(self, at: ModelPoint, dt: float) -> float:
        return at.value + 0.5 * float(at.delta @ (self._metric @ at.delta)) / dt**2

    def _newton_step(
        self,
        model: Model,
        now: ModelPoint,
        dt: float,
        curvature: Curvature,
        trust: Trust,
        limit: int,
        worth: float,
        met: Bools | None,
    ) -> _Newton:
        """Minimise the quadratic of the physics plus everything that is cheap, from where the model is.

        Not more than ``limit`` products are made, and few if they promise less than ``worth``. ``met`` is what the step
        before touched.
        """
        controls, metric, damping = self._controls, self._metric, trust.damping / self._metric.measure
        physics = model.gradient(now) - now.design.gradient
        quadratic = (1.0 / dt**2 + damping) * metric.upper
        result = _Newton(np.zeros_like(now.delta), np.zeros_like(now.dx), met=met)
        bent = np.zeros_like(physics)  # Hessian of the physics times the step
        value, gains = now.design.value, []

        while result.products < limit:
            linear = physics + bent + metric @ (now.delta + result.step) / dt**2 + damping * (metric @ result.step)
            at = now.chi + result.step
            proposal = self._subproblem.solve(at, value, linear, curvature, quadratic, trust.reach, result.met)
            if proposal is None:
                break
            result.met = proposal.met
            s = proposal.step
            hs, dx = model.product(now, s)
            result.products += 1
            curvature.learn(s, hs)
            bend = float(s @ hs) + (1.0 / dt**2 + damping) * float(s @ (metric @ s))
            length, gain, value = self._along(at, s, proposal.value, value, float(linear @ s), bend)
            gains.append(gain)
            result.step, result.dx, bent = result.step + length * s, result.dx + length * dx, bent + length * hs
            result.change -= gain
            if float(np.abs(result.step).max()) > trust.reach:
                break
            lately = sum(gains[-controls.window :]) if len(gains) > controls.window else np.inf
            if min(lately, gain if length == 1.0 else np.inf) < max(controls.negligible_gain * sum(gains), worth):
                break
        return result

    def _along(
        self, chi: Floats, s: Floats, end: float, start: float, slope: float, bend: float
    ) -> tuple[float, float, float]:
        """Best length along a step, its gain, and the design terms there; zero if none is lower."""
        values = {1.0: end}

        def gain(length: float) -> float:
            if length not in values:
                values[length] = self._objective.design.value(chi + length * s)
            return start - values[length] - length * slope - 0.5 * length**2 * bend

        back, best, length = self._controls.backtracking, 1.0, 1.0
        while length > self._controls.shortest and not 0.0 < gain(best) > gain(length):
            best, length = length, back * length
        if gain(best) <= 0.0:
            return 0.0, 0.0, start
        if best < 1.0:
            found = minimize_scalar(
                lambda length: -gain(float(length)),
                bounds=(back * best, min(best / back, 1.0)),
                method="bounded",
                options={"maxiter": self._controls.max_corrections},
            )
            best = max(best, float(found.x), key=gain)
        return best, gain(best), values[best]

    def _land(self, model: Model, now: ModelPoint, step: _Newton, dt: float) -> _Landing:
        """Back along a Newton step to where the model is low enough after a correction of its displacements."""
        controls, length, start = self._controls, 1.0, self._value(now, dt)
        drifted = False
        while step.change < 0.0 and length > controls.shortest and not (drifted and now.delta.any()):
            trial = model(now.delta + length * step.step, now.dx + length * step.dx)
            least = controls.sufficient_decrease * length
            if trial is not None and (self._value(trial, dt) - start) / step.change > least:
                corrected = model.corrected(trial)
                if corrected is not None:
                    gain, moved = start - self._value(corrected, dt), abs(corrected.value - trial.value)
                    left = np.linalg.norm(corrected.force) > controls.force_drift * np.linalg.norm(trial.force)
                    if -gain / step.change > least:
                        spent = bool(left and moved > controls.negligible_gain * gain)
                        return _Landing(corrected, length, -gain / step.change, spent)
                drifted = True
            length *= controls.backtracking
        return _Landing(drifted=drifted)


def _adapted(trust: Trust, step: _Newton, landing: _Landing, controls: Controls) -> Trust:
    """Trust after a Newton step."""
    mistrusted = trust.damping * controls.trust_factor
    if landing.point is None:
        return Trust(mistrusted, trust.reach * controls.backtracking)
    size = landing.length * float(np.abs(step.step).max())
    if landing.length < 1.0:
        return Trust(mistrusted, size)
    if landing.quality < controls.poor_agreement:
        return replace(trust, damping=mistrusted)
    reach = max(trust.reach, min(2.0 * size, controls.reach_range[1]))
    if step.products > controls.max_products_per_step // 2:
        return Trust(mistrusted, reach)
    factor = controls.trust_factor**-2 if landing.quality > controls.good_agreement else 1.0
    return Trust(max(controls.damping_range[0], factor * trust.damping), reach)
