"""The inner problem: the design step that minimises the model plus the step term δᵀ M δ / (2 Δt²).

Newton's method with a trust region: preconditioned conjugate gradients up to its boundary (Steihaug 1983,
doi:10.1137/0720042), and a search back along the path they took. No mechanical factorisation is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from actuator.domain import Floats
from actuator.optimiser.metric import Metric
from actuator.optimiser.model import Model, ModelPoint
from actuator.optimiser.preconditioner import Preconditioner
from actuator.reduced import ReducedObjective
from actuator.tangent import symmetric_product

MAX_NEWTON = 60
MAX_CG = 40
#: Relative residual at which conjugate gradients stop.
FORCING = 0.1
#: Most corrections of the design Hessian by what lies ahead.
LOOK_AHEAD = 4
#: Search along the path: factor per trial and the length at which it is given up; share of the predicted decrease
#: that is enough, and the one above which the trust region grows and not only widens.
SHRINK, SHORTEST, ENOUGH, GOOD = 0.4, 1e-4, 0.1, 0.6
GROW, WIDEN = 2.5, 1.2
#: The inner problem ends when this many Newton steps together brought less than this part of all that was gained.
WINDOW, STALLED = 4, 0.05


@dataclass(frozen=True)
class InnerStep:
    """Solution of the inner problem.

    Attributes:
        point: the model there.
        change: predicted change of the total objective, without the step term; negative if a step was found.
        step_term: C_t of the step.
        newton, products: Newton steps and Hessian products it took.
        radius: trust region to begin the next inner problem with.
    """

    point: ModelPoint
    change: float
    step_term: float
    newton: int
    products: int
    radius: float


@dataclass(frozen=True)
class _Knot:
    """A corner of the path of conjugate gradients: its norm, the step, S times it, and the quadratic's change."""

    norm: float
    step: Floats
    dx: Floats
    change: float


class InnerProblem:
    """Solves the inner problems of one case; reuses the analysis of the preconditioner's pattern."""

    def __init__(self, objective: ReducedObjective, metric: Metric) -> None:
        self._objective, self._metric = objective, metric
        self._preconditioner = Preconditioner(objective.equilibrium.design_solver, metric, objective.design.gather)

    def solve(self, model: Model, dt: float, max_products: int, radius: float = np.inf) -> InnerStep:
        """Minimise from δ = 0.

        Args:
            dt: Δt.
            max_products: Hessian products after which the best step so far is returned.
            radius: of the trust region of the first Newton step, in the norm of the preconditioner.
        """
        metric, preconditioner = self._metric, self._preconditioner
        preconditioner.forget()
        now = start = model.start()
        gains, products, newton = [0.0], 0, 0

        def value(at: ModelPoint) -> float:
            return at.value + 0.5 * float(at.delta @ (metric @ at.delta)) / dt**2

        while newton < MAX_NEWTON and products < max_products:
            newton += 1
            gradient = model.gradient(now) + metric @ now.delta / dt**2
            hessian = self._objective.design.gather.matrix(self._look_ahead(now, gradient, dt))

            def product(v: Floats, at: ModelPoint = now, upper: sp.csr_array = hessian) -> tuple[Floats, Floats]:
                physics, dx = model.product(at, v)
                return physics + symmetric_product(upper, v) + metric @ v / dt**2, dx

            origin = _Knot(0.0, np.zeros_like(now.delta), np.zeros_like(now.dx), 0.0)
            limit = min(MAX_CG, max_products - products)
            path, used = _path(product, gradient, preconditioner, origin, radius, limit)
            products += used
            found = _search(model, value, now, path, min(radius, path[-1].norm))
            if found is None:
                break
            now, reached, quality = found
            if reached < path[-1].norm or np.isfinite(radius):
                radius = reached * (GROW if quality > GOOD else WIDEN)
            gains.append(value(start) - value(now))
            if len(gains) > WINDOW and gains[-1] - gains[-1 - WINDOW] < STALLED * gains[-1]:
                break
        step_term = 0.5 * float(now.delta @ (metric @ now.delta)) / dt**2
        return InnerStep(now, now.value - start.value, step_term, newton, products, radius)

    def _look_ahead(self, now: ModelPoint, gradient: Floats, dt: float) -> Floats:
        """Factorise the preconditioner and return the design Hessian it uses, data of the upper triangle.

        C_χ and C_i are walls that the Hessian at a point inside them does not show. A cheap step without the
        physics tells which parts of the walls it would run into; their curvature is averaged in.
        """
        hessian, walls = now.design.hessian, now.design.passive + now.design.slope
        for _ in range(LOOK_AHEAD):
            self._preconditioner.factorise(hessian, dt)
            step = -self._preconditioner.plain(gradient)
            there = self._objective.design(now.chi + step / max(1.0, float(np.abs(step).max())))
            if there.passive + there.slope <= 2.0 * walls + 1e-3 * abs(now.value):
                return hessian
            hessian = 0.5 * (hessian + there.hessian)
        self._preconditioner.factorise(hessian, dt)
        return hessian


def _path(
    product: Callable[[Floats], tuple[Floats, Floats]],
    gradient: Floats,
    preconditioner: Preconditioner,
    origin: _Knot,
    radius: float,
    limit: int,
) -> tuple[list[_Knot], int]:
    """Conjugate gradients from the origin: up to ``radius``, along negative curvature, or to the forcing term.

    The preconditioner learns the pairs it passed.
    """
    r, z = gradient, preconditioner.solve(gradient)
    rz = float(r @ z)
    target, d = FORCING**2 * rz, -z
    path, pairs = [origin], []
    used = 0
    while used < limit:
        hd, dx = product(d)
        used += 1
        last = path[-1]
        bend = float(d @ hd)
        if bend <= 1e-10 * rz:
            # Down to the boundary; without one, as far as χ changes by half at most or the path doubles.
            length = preconditioner.norm(d)
            end = radius if np.isfinite(radius) else max(2.0 * last.norm, 0.5 * length / float(np.abs(d).max()))
            tau = max(end - last.norm, 0.5 * end) / length
            change = last.change - tau * rz
            path.append(_Knot(last.norm + tau * length, last.step + tau * d, last.dx + tau * dx, change))
            break
        pairs.append((d, hd))
        alpha = rz / bend
        step = last.step + alpha * d
        path.append(_Knot(preconditioner.norm(step), step, last.dx + alpha * dx, last.change - 0.5 * alpha * rz))
        r = r + alpha * hd
        z = preconditioner.solve(r)
        new = float(r @ z)
        if new <= target or path[-1].norm >= radius:
            break
        d = -z + new / rz * d
        rz = new
    if pairs:
        preconditioner.learn(pairs)
    return path, used


def _search(
    model: Model, value: Callable[[ModelPoint], float], now: ModelPoint, path: list[_Knot], end: float
) -> tuple[ModelPoint, float, float] | None:
    """Back along the path from norm ``end`` to a point that is low enough.

    Returns the point, its norm, and truth over prediction there; None if nothing on the path is lower.
    """
    start, reached = value(now), end
    while reached > SHORTEST * end:
        step, dx, change = _at(path, reached)
        trial = model(now.delta + step, now.dx + dx)
        if trial is not None and value(trial) - start < ENOUGH * change:
            return trial, reached, (value(trial) - start) / change
        reached *= SHRINK
    return None


def _at(path: list[_Knot], norm: float) -> tuple[Floats, Floats, float]:
    """Step, S times it, and the quadratic's change where the path reaches a norm."""
    index = next((i for i, knot in enumerate(path) if i and knot.norm >= norm), len(path) - 1)
    a, b = path[index - 1], path[index]
    share = min(1.0, (norm - a.norm) / (b.norm - a.norm)) if b.norm > a.norm else 1.0
    return (
        (1 - share) * a.step + share * b.step,
        (1 - share) * a.dx + share * b.dx,
        (1 - share) * a.change + share * b.change,
    )
