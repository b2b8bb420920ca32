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

from actuator.arrays import Floats
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.model import Model, ModelPoint
from actuator.optimiser.subproblem import Subproblem
from actuator.solve.reduced import ReducedObjective
from actuator.terms.step import Metric

MAX_NEWTON = 60
#: Most Hessian products in one Newton step; it ends when this many brought less than this part of its gain.
MAX_PRODUCTS, LAST, LITTLE = 30, 3, 0.1
#: Share of the gain below which a product whose whole proposal was taken says that there is no more.
NOTHING = 0.01
#: Lengths that are tried along a subproblem's solution, longest first.
LENGTHS = (1.0, 0.6, 0.36, 0.2, 0.1, 0.04, 0.015, 0.005, 0.001)
#: Search back from the end of a Newton step: factor per trial, least length, and share of the promise that is enough.
SHRINK, SHORTEST, ENOUGH = 0.4, 1e-3, 0.1
#: Share of the force residual that a correction of the displacements may leave where it moves the objective by more
#: than a part of the gain; beyond that, their prediction is spent.
DRIFT, MATTERS = 0.3, 0.01
#: Truth over promise of a Newton step below and above which the trust in the quadratic falls and grows.
POOR, GOOD = 0.4, 0.75
TIGHTEN, LOOSEN = 4.0, 0.1
#: Truth over promise above which it is the damping that holds a Newton step back, and the factor on it then.
HELD_BACK, LET_GO = 1.5, 0.01
#: Products of a Newton step above which the damping grows: with less of it the quadratic is worse conditioned than
#: products can resolve, and the step that they leave, good as the quadratic is there, brings next to nothing.
MANY = 15
LOOSEST, TIGHTEST, FARTHEST = 1e-6, 1e6, 2.0
#: Most damping and least reach that an inner problem begins with: its model is new, and mistrust of the last one
#: counts less.
NEW_DAMPING, NEW_REACH = 1.0, 0.1
#: The inner problem ends when this many Newton steps together brought less than this part of all that was gained.
WINDOW, STALLED = 4, 0.05
#: Share of all that was gained below which a Newton step is not worth more products, nor another Newton step.
WORTHLESS = 1e-3
#: Curvature of the physics before anything is known, per unit step in the norm of C_t over the volume.
GUESS = 1e-2


@dataclass(frozen=True)
class Trust:
    """How far the quadratic of the physics is trusted.

    Attributes:
        damping: μ of μ/2 ‖d‖², where ‖d‖² is the root mean square of a step d and of L_t times its gradient, squared.
        reach: largest change of χ in a Newton step.
    """

    damping: float = 1.0
    reach: float = 0.5


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
    """A Newton step: d, S d, what it promises, and the products it took."""

    step: Floats
    dx: Floats
    change: float = 0.0
    products: int = 0


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

    def __init__(self, objective: ReducedObjective, metric: Metric) -> None:
        self._objective, self._metric = objective, metric
        self._subproblem = Subproblem(objective.design, objective.equilibrium.vertex_solver(), metric)

    def blank(self) -> Curvature:
        """The curvature before any Hessian product."""
        return Curvature(self._metric, GUESS / self._metric.measure)

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
        curvature = self.blank() if curvature is None else curvature
        trust = Trust() if trust is None else Trust(min(trust.damping, NEW_DAMPING), max(trust.reach, NEW_REACH))
        now = start = model.start()
        model.gradient(now)
        curvature.rebase(model.diagonal(now))
        trail: list[ModelPoint] = []
        gains, products, newton = [0.0], 0, 0
        while newton < MAX_NEWTON and products < max_products and trust.damping < TIGHTEST:
            newton += 1
            limit = min(MAX_PRODUCTS, max_products - products)
            step = self._newton_step(model, now, dt, curvature, trust, limit, WORTHLESS * gains[-1])
            products += step.products
            landing = self._land(model, now, step, dt)
            if landing.point is not None:
                now = landing.point
                trail.append(now)
                gains.append(self._value(start, dt) - self._value(now, dt))
                if gains[-1] - gains[-2] < WORTHLESS * gains[-1]:
                    break
            trust = _adapted(trust, step, landing)
            if landing.drifted and trail:
                break
            if len(gains) > WINDOW and gains[-1] - gains[-1 - WINDOW] < STALLED * gains[-1]:
                break
        return InnerStep(start, tuple(trail), newton, products, trust)

    def _value(self, at: ModelPoint, dt: float) -> float:
        return at.value + 0.5 * float(at.delta @ (self._metric @ at.delta)) / dt**2

    def _newton_step(
        self, model: Model, now: ModelPoint, dt: float, curvature: Curvature, trust: Trust, limit: int, worth: float
    ) -> _Newton:
        """Minimise the quadratic of the physics plus everything that is cheap, from where the model is.

        Not more than ``limit`` products are made, and few if they promise less than ``worth``.
        """
        metric, damping = self._metric, trust.damping / self._metric.measure
        physics = model.gradient(now) - now.design.gradient
        quadratic = (1.0 / dt**2 + damping) * metric.upper
        result = _Newton(np.zeros_like(now.delta), np.zeros_like(now.dx))
        bent = np.zeros_like(physics)  # Hessian of the physics times the step
        value, gains = now.design.value, []

        while result.products < limit:
            linear = physics + bent + metric @ (now.delta + result.step) / dt**2 + damping * (metric @ result.step)
            at = now.chi + result.step
            proposal = self._subproblem.solve(at, value, linear, curvature, quadratic, trust.reach)
            if proposal is None:
                break
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
            if length == 1.0 and gain < NOTHING * sum(gains):
                break
            if len(gains) > LAST and sum(gains[-LAST:]) < max(LITTLE * sum(gains), worth):
                break
        return result

    def _along(
        self, chi: Floats, s: Floats, end: float, start: float, slope: float, bend: float
    ) -> tuple[float, float, float]:
        """Best of the lengths along a step, its gain, and the design terms there; zero if none is lower."""
        best, most, there = 0.0, 0.0, start
        for length in LENGTHS:
            value = end if length == 1.0 else self._objective.design.value(chi + length * s)
            gain = start - value - length * slope - 0.5 * length**2 * bend
            if gain > most:
                best, most, there = length, gain, value
            elif best > 0.0:
                break
        return best, most, there

    def _land(self, model: Model, now: ModelPoint, step: _Newton, dt: float) -> _Landing:
        """Back along a Newton step to where the model is low enough after a correction of its displacements."""
        length, start = 1.0, self._value(now, dt)
        drifted = False
        while step.change < 0.0 and length > SHORTEST and not (drifted and now.delta.any()):
            trial = model(now.delta + length * step.step, now.dx + length * step.dx)
            if trial is not None and (self._value(trial, dt) - start) / step.change > ENOUGH * length:
                corrected = model.corrected(trial)
                if corrected is not None:
                    gain, moved = start - self._value(corrected, dt), abs(corrected.value - trial.value)
                    left = np.linalg.norm(corrected.force) > DRIFT * np.linalg.norm(trial.force)
                    if -gain / step.change > ENOUGH * length:
                        return _Landing(corrected, length, -gain / step.change, bool(left and moved > MATTERS * gain))
                drifted = True
            length *= SHRINK
        return _Landing(drifted=drifted)


def _adapted(trust: Trust, step: _Newton, landing: _Landing) -> Trust:
    """Trust after a Newton step."""
    if landing.point is None:
        return Trust(trust.damping * TIGHTEN, trust.reach * SHRINK)
    size = landing.length * float(np.abs(step.step).max())
    if landing.length < 1.0:
        return Trust(trust.damping * TIGHTEN, size)
    if landing.quality < POOR:
        return replace(trust, damping=trust.damping * TIGHTEN)
    reach = max(trust.reach, min(2.0 * size, FARTHEST))
    if step.products > MANY:
        return Trust(trust.damping * TIGHTEN, reach)
    factor = LET_GO if landing.quality > HELD_BACK else LOOSEN if landing.quality > GOOD else 1.0
    return Trust(max(LOOSEST, factor * trust.damping), reach)
