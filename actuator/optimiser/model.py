"""The model of the total objective that one design update minimises: the Lagrangian along predicted states.

    m(δ) = C(χ + δ, x(δ), p(δ)) + Λ_x · R_x(χ + δ, x(δ), p(δ)),   x(δ) = x + S δ,   R_p(χ + δ, x(δ), p(δ)) = 0

The displacements follow linearly, everything else is exact: all terms of the objective with their walls, and the
pressure. What the displacements miss is of second order, and the adjoint turns it into the objective's error, so that
value, gradient and Hessian at δ = 0 are those of the reduced objective. Nothing here needs a mechanical factorisation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from actuator.arrays import Floats
from actuator.optimiser.controls import CONTROLS
from actuator.solve.flow import Inverted
from actuator.solve.reduced import Evaluation, Gradient, LoadedCase, ReducedObjective
from actuator.solve.sensitivity import JointSensitivity, Sensitivity
from actuator.solve.stacking import stacked, summed
from actuator.terms.design import DesignTerms

#: Change of χ over which :meth:`Model.diagonal` takes its difference: six digits, of which an estimate needs one.
DIFFERENCE = 1e-6


@dataclass
class ModelPoint:
    """The model at a step, without the step term; of several load cases, what belongs to states one after the other.

    Attributes:
        delta, dx: δ (n_vertices,) and S δ (n_cases n_x,).
        chi, x, p: design and predicted states.
        value: m(δ).
        force: residual of the mechanical equations, (n_cases n_x,).
        tip: nodal residual forces, right on Γ only, (n_cases n_nodes, 3), N.
        design: the terms that depend on χ alone.
        gradient: dm/dδ, (n_vertices,); from :meth:`Model.gradient`.
        flow_adjoint: multiplier of R_p, (n_cases n_vertices,); from :meth:`Model.gradient`.
    """

    delta: Floats
    dx: Floats
    chi: Floats
    x: Floats
    p: Floats
    value: float
    force: Floats
    tip: Floats
    design: DesignTerms
    gradient: Floats | None = None
    flow_adjoint: Floats | None = None


class Model:
    """Model around one evaluated design.

    Args:
        objective: the case.
        at, gradient: the design the model is built around; its state is linearised here, and the model can be used
            until another state is.
        fresh: whether to factorise the tangent there, or let the factors at hand serve.

    Attributes:
        sensitivity: S, around that state.
    """

    def __init__(self, objective: ReducedObjective, at: Evaluation, gradient: Gradient, *, fresh: bool = True) -> None:
        self._objective, self._at = objective, at
        self.sensitivity = JointSensitivity(
            [
                Sensitivity(case.equilibrium, state, fresh=fresh)
                for case, state in zip(objective.cases, at.states, strict=True)
            ]
        )
        self._adjoint = gradient.adjoint[0]
        self._no_force, self._no_flow = np.zeros_like(at.x), np.zeros_like(at.p)

    def start(self) -> ModelPoint:
        """The model at δ = 0."""
        point = self(np.zeros_like(self._at.chi), self._no_force)
        assert point is not None, "the state itself has no inverted element"
        return point

    def __call__(self, delta: Floats, dx: Floats) -> ModelPoint | None:
        """Evaluate at a step with its S δ; None if an element inverts there."""
        objective, chi, x = self._objective, self._at.chi + delta, self._at.x + dx
        try:
            p = stacked([case.equilibrium.pressure(chi, own) for case, own in self._by_case(x)])
        except Inverted:
            return None
        found = [case.equilibrium.residual(chi, *own) for case, *own in self._by_case(x, p)]
        force, nodal = (stacked([parts[i] for parts in found]) for i in (0, 2))
        design = objective.design(chi)
        terms = objective.total.value(design, objective.fields(chi, x, p))
        value = terms + float(self._adjoint @ force)
        return ModelPoint(delta, dx, chi, x, p, value, force, nodal, design)

    def _by_case(self, *whole: Floats) -> Iterator[tuple[Any, ...]]:
        """Every load case with its parts of what stands one after the other."""
        return zip(self._objective.cases, *map(self._objective.split, whole), strict=True)

    def corrected(self, at: ModelPoint) -> ModelPoint | None:
        """The model with the displacements moved by one step of Newton's method with the factors at hand.

        The difference of the two values is a measure of how far the model may be trusted there.
        """
        return self(at.delta, at.dx - self.sensitivity.mechanics(at.force))

    def gradient(self, at: ModelPoint) -> Floats:
        """dm/dδ at a point, (n_vertices,); kept there."""
        if at.gradient is not None:
            return at.gradient
        g_chi, g_x, g_p = self._objective.derivatives(at.chi, at.x, at.p, self._adjoint, self._no_flow, at.tip)
        adjoints, by_x, by_chi = [], [], []
        for case, x, p, own in self._by_case(at.x, at.p, g_p):
            equilibrium = case.equilibrium
            adjoints.append(equilibrium.flow(at.chi, x).solve(-own))
            px, pc = equilibrium.tangent.flow_blocks(equilibrium.coefficients, at.chi, x, p)
            by_x.append(px.T @ adjoints[-1])
            by_chi.append(pc.T @ adjoints[-1])
        at.flow_adjoint = stacked(adjoints)
        of_state = self.sensitivity.transposed(g_x + stacked(by_x))
        at.gradient = at.design.gradient + g_chi + summed(by_chi) + of_state
        return at.gradient

    def diagonal(self, at: ModelPoint, probes: int = CONTROLS.curvature_probes) -> Floats:
        """Estimate of the Hessian's diagonal without the χ-only terms, (n_vertices,); never negative.

        What χ does with the state held, its rows summed, plus the diagonal of the Gauss-Newton Hessian of the leak with
        the displacements held, by the estimator of Bekas, Kokiopoulou & Saad (doi:10.1016/j.apnum.2007.01.003).

        Args:
            at: the model's start, after its gradient has been evaluated.
            probes: random vectors of the estimator, the same ones each time.
        """
        assert at.flow_adjoint is not None
        here, there = (
            self._objective.derivatives(chi, at.x, at.p, self._adjoint, at.flow_adjoint, at.tip)[0]
            for chi in (at.chi, at.chi + DIFFERENCE)
        )
        held = np.abs(there - here) / DIFFERENCE
        leaks = [
            self._leak_diagonal(case, part, at.chi, x, probes)
            for (case, x), part in zip(self._by_case(at.x), self.sensitivity.parts, strict=True)
        ]
        return summed([held, *(leak for leak in leaks if leak is not None)])

    @staticmethod
    def _leak_diagonal(case: LoadedCase, of: Sensitivity, chi: Floats, x: Floats, probes: int) -> Floats | None:
        """What the leak of one load case adds to the diagonal; None if it has none."""
        weights = case.terms.pressure_roots()
        if weights is None:
            return None
        signs = np.random.default_rng(0).choice((-1.0, 1.0), (len(weights), probes))
        flow = case.equilibrium.flow(chi, x)
        responses = of.linearisation.tangent.pc.T @ flow.solve(weights[:, None] * signs, check=False)
        return np.asarray(np.mean(responses**2, axis=1))
