"""The inner problem: the best design step for a given model of the mechanics and step length Δt.

    min over δ of  C_χ + C_A + C_i + C_p(·; u frozen) at χ + δ  +  gᵀδ + ½ δᵀ B δ  +  δᵀ M δ / (2 Δt²)

Everything cheap is exact; g and B model what needs the mechanical factorisation. Solved by Newton's method with
preconditioned conjugate gradients and a line search.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from actuator.domain import Floats
from actuator.failure import SolveFailure
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.leak import FrozenLeak, LeakPoint
from actuator.reduced import ReducedObjective
from actuator.design_terms import DesignTerms

MAX_NEWTON = 30
MAX_CG = 60


@dataclass(frozen=True)
class InnerStep:
    """Solution of the inner problem.

    Attributes:
        delta: δ, (n_vertices,).
        change: predicted change of the total objective, without the step term; negative.
        newton, products: Newton steps and Hessian products it took.
    """

    delta: Floats
    change: float
    newton: int
    products: int


@dataclass
class _Point:
    delta: Floats
    value: float
    gradient: Floats
    design: DesignTerms
    leak: LeakPoint
    step_term: float


class InnerProblem:
    """Inner problems of one case; reuses the pattern and the analysis of the preconditioner's solver."""

    def __init__(self, objective: ReducedObjective, metric: sp.csr_array) -> None:
        self._objective, self._metric = objective, metric
        self._gather = objective.design.gather
        upper = sp.csr_array(sp.triu(metric, format="csr"))
        upper.sort_indices()
        if not np.array_equal(upper.indices, self._gather.indices):
            raise ValueError("the step metric must have the pattern of the vertices")
        self._metric_upper = upper.data

    def solve(
        self, chi: Floats, linear: Floats, curvature: Curvature, leak: FrozenLeak, dt: float, tolerance: float = 1e-2
    ) -> InnerStep:
        """Minimise from δ = 0.

        Args:
            chi: design the step starts from.
            linear: g, gradient at χ of what is modelled.
            dt: Δt.
            tolerance: norm of the gradient left over, relative to that of g; both in the norm of the preconditioner.
        """

        def point(delta: Floats) -> _Point:
            design, frozen = self._objective.design(chi + delta), leak(chi + delta)
            bent, damped = curvature @ delta, self._metric @ delta / dt**2
            step_term = 0.5 * float(delta @ damped)
            value = design.value + frozen.value + float(delta @ (linear + 0.5 * bent)) + step_term
            gradient = design.gradient + frozen.gradient + linear + bent + damped
            return _Point(delta, value, gradient, design, frozen, step_term)

        now = start = point(np.zeros_like(chi))
        target, products = None, 0
        newton = 0
        for newton in range(1, MAX_NEWTON + 1):
            self._precondition(now, dt)
            solver = self._objective.equilibrium.design_solver
            z = solver.solve(now.gradient, check=None)
            norm = np.sqrt(abs(float(now.gradient @ z)))
            if target is None:
                # What the mechanics asks for sets the precision, not a stiff term that is violated at the start.
                target = tolerance * min(norm, np.sqrt(abs(float(linear @ solver.solve(linear, check=None)))) or norm)
            if norm <= target:
                break
            matrix = self._gather.matrix(now.design.hessian)

            def hessian(v: Floats, at: _Point = now, upper: sp.csr_array = matrix) -> Floats:
                own = upper @ v + upper.T @ v - upper.diagonal() * v + self._metric @ v / dt**2
                return own + curvature @ v + leak.product(chi + at.delta, at.leak, v)

            forcing = max(0.5 * target / norm, min(0.1, np.sqrt(target / norm)))
            step, used = _conjugate_gradients(hessian, now.gradient, z, solver.solve, forcing)
            products += used
            slope = float(now.gradient @ step)
            length = 1.0
            while True:
                trial = point(now.delta + length * step)
                if trial.value <= now.value + 1e-4 * length * slope:
                    break
                length *= 0.5
                if length < 1e-6:
                    trial = now
                    break
            if trial is now:
                break
            now = trial
        return InnerStep(now.delta, now.value - now.step_term - start.value, newton, products)

    def _precondition(self, at: _Point, dt: float) -> None:
        """Factorise the design Hessian and the step metric, without the concave part of C_A if need be."""
        solver = self._objective.equilibrium.design_solver
        data = at.design.hessian + self._metric_upper / dt**2
        shift = 0.0
        for _ in range(6):
            try:
                solver.factorise(data + shift * self._metric_upper)
            except SolveFailure:
                shift = max(10.0 * shift, 0.1 / dt**2)
                continue
            return
        solver.factorise(self._metric_upper / dt**2)


def _conjugate_gradients(hessian, gradient: Floats, z: Floats, precondition, forcing: float) -> tuple[Floats, int]:  # type: ignore[no-untyped-def]
    """Step of truncated Newton (Nocedal & Wright 2006, Alg. 7.1): stops at negative curvature."""
    x, r = np.zeros_like(gradient), gradient.copy()
    d, rz = -z, float(gradient @ z)
    target = forcing**2 * rz
    for used in range(1, MAX_CG + 1):
        hd = hessian(d)
        bend = float(d @ hd)
        if bend <= 0.0:
            return (d if used == 1 else x), used
        alpha = rz / bend
        x += alpha * d
        r += alpha * hd
        z = precondition(r, check=None)
        new = float(r @ z)
        if new <= target:
            return x, used
        d = -z + new / rz * d
        rz = new
    return x, MAX_CG
