"""The inner problem: the design step that minimises the model plus the step term δᵀ M δ / (2 Δt²).

Newton's method with preconditioned conjugate gradients and a line search. No mechanical solve is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator.domain import Floats
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver
from actuator.optimiser.metric import Metric
from actuator.optimiser.model import Model, ModelPoint
from actuator.reduced import ReducedObjective
from actuator.tangent import symmetric_product

MAX_NEWTON = 15
MAX_CG = 40
#: Most corrections of the design Hessian by what lies ahead.
LOOK_AHEAD = 4
#: Backtracking: factor per trial, and the length at which a direction is given up. The leak grows exponentially as a
#: wall thins, so that full steps often overshoot.
SHRINK, SHORTEST = 0.4, 5e-3


@dataclass(frozen=True)
class InnerStep:
    """Solution of the inner problem.

    Attributes:
        delta: δ, (n_vertices,).
        change: predicted change of the total objective, without the step term; not positive.
        step_term: C_t of the step.
        newton, products: Newton steps and Hessian products it took.
    """

    delta: Floats
    change: float
    step_term: float
    newton: int
    products: int


class InnerProblem:
    """Solves the inner problems of one case; reuses the analysis of the preconditioner's pattern."""

    def __init__(self, objective: ReducedObjective, metric: Metric) -> None:
        self._gather, self._metric = objective.design.gather, metric
        self._solver: DirectSolver = objective.equilibrium.design_solver

    def solve(self, model: Model, dt: float, tolerance: float = 0.02) -> InnerStep:
        """Minimise from δ = 0.

        Args:
            dt: Δt.
            tolerance: norm of the gradient left over, relative to that of what is modelled; both in the norm of the
                preconditioner.
        """
        metric, solver = self._metric, self._solver
        start = now = model(np.zeros(metric.size))
        target, products, newton = None, 0, 0
        while newton < MAX_NEWTON:
            newton += 1
            gradient = now.gradient + metric @ now.delta / dt**2
            hessian = self._look_ahead(model, now, gradient, dt)
            z = solver.solve(gradient, check=None)
            norm = _root(gradient @ z)
            if target is None:
                # What the mechanics asks for sets the precision, not a stiff term that is violated at the start.
                asked = _root(model.linear @ solver.solve(model.linear, check=None))
                target = tolerance * min(norm, asked or norm)
            if norm <= target:
                break
            matrix = self._gather.matrix(hessian)

            def product(v: Floats, at: ModelPoint = now, upper=matrix) -> Floats:  # type: ignore[no-untyped-def]
                return symmetric_product(upper, v) + metric @ v / dt**2 + model.product(at, v)

            forcing = max(0.5 * target / norm, min(0.1, np.sqrt(target / norm)))
            step, used = _conjugate_gradients(product, gradient, z, solver, forcing)
            products += used

            def value(at: ModelPoint) -> float:
                return at.value + 0.5 * float(at.delta @ (metric @ at.delta)) / dt**2

            found = _line_search(model, value, now, gradient, step) or _line_search(model, value, now, gradient, -z)
            if found is None:
                break
            now = found
        step_term = 0.5 * float(now.delta @ (metric @ now.delta)) / dt**2
        return InnerStep(now.delta, now.value - start.value, step_term, newton, products)

    def _look_ahead(self, model: Model, now: ModelPoint, gradient: Floats, dt: float) -> Floats:
        """Factorise the preconditioner and return the design Hessian it uses, data of the upper triangle.

        C_χ and C_i are walls that the Hessian at a point inside them does not show. A cheap step without the
        physics tells which parts of the walls it would run into; their curvature is averaged in.
        """
        hessian, walls = now.design.hessian, now.design.passive + now.design.slope
        for _ in range(LOOK_AHEAD):
            self._factorise(hessian, dt)
            step = -self._solver.solve(gradient, check=None)
            there = model.design(now.delta + step / max(1.0, float(np.abs(step).max())))
            if there.passive + there.slope <= 2.0 * walls + 1e-3 * abs(now.value):
                return hessian
            hessian = 0.5 * (hessian + there.hessian)
        self._factorise(hessian, dt)
        return hessian

    def _factorise(self, hessian: Floats, dt: float) -> None:
        """Factorise the design Hessian and the step metric, with more of the latter where C_A is too concave."""
        upper = self._metric.upper
        data = hessian + upper / dt**2
        shift = 0.0
        for _ in range(6):
            try:
                self._solver.factorise(data + shift * upper)
            except SolveFailure:
                shift = max(10.0 * shift, 0.1 / dt**2)
                continue
            return
        self._solver.factorise(upper / dt**2)


def _root(square: Any) -> float:
    """Norm from its square, which rounding may have made negative."""
    return float(np.sqrt(abs(square)))


def _line_search(
    model: Model, value: Callable[[ModelPoint], float], now: ModelPoint, gradient: Floats, step: Floats
) -> ModelPoint | None:
    """First point along a step with enough decrease (Armijo), or None."""
    slope, start = float(gradient @ step), value(now)
    length = 1.0
    while length > SHORTEST:
        trial = model(now.delta + length * step)
        if value(trial) <= start + 1e-4 * length * slope:
            return trial
        length *= SHRINK
    return None


def _conjugate_gradients(
    product: Callable[[Floats], Floats], gradient: Floats, z: Floats, preconditioner: DirectSolver, forcing: float
) -> tuple[Floats, int]:
    """Step of truncated Newton (Nocedal & Wright 2006, Alg. 7.1): stops at negative curvature."""
    x, r = np.zeros_like(gradient), gradient.copy()
    d, rz = -z, float(gradient @ z)
    target = forcing**2 * rz
    for used in range(1, MAX_CG + 1):
        hd = product(d)
        bend = float(d @ hd)
        if bend <= 0.0:
            return (d if used == 1 else x), used
        alpha = rz / bend
        x += alpha * d
        r += alpha * hd
        z = preconditioner.solve(r, check=None)
        new = float(r @ z)
        if new <= target:
            return x, used
        d = -z + new / rz * d
        rz = new
    return x, MAX_CG
