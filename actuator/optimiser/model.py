"""The model of the total objective that one design update minimises.

    m(δ) = C_χ + C_A + C_i + C_p(·; u frozen) at χ + δ   +   gᵀδ + ½ δᵀ B δ

What is cheap is exact; g and B model what needs the mechanical factorisation: C_0, C_Ψ and the leak's answer to u.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.design_terms import DesignTerms
from actuator.domain import Floats
from actuator.kernels import strain_energy_excess
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.leak import FrozenLeak, LeakPoint
from actuator.reduced import Evaluation, Gradient, Product, ReducedObjective, main_objective

#: Design changes below this (largest nodal value) teach nothing: the difference of two gradients is then mostly
#: what the linear solves left over.
SMALLEST_LESSON = 1e-3


@dataclass(frozen=True)
class ModelPoint:
    """The model at a step δ, with its gradient there; both without the step term."""

    delta: Floats
    value: float
    gradient: Floats
    design: DesignTerms
    leak: LeakPoint


class Model:
    """Model around one evaluated design; learns from exact answers there and from the next design's gradient.

    Args:
        objective: the case.
        at, gradient: the design the model is built around.
        curvature: B; carries over from design to design and is taught in place.
    """

    def __init__(self, objective: ReducedObjective, at: Evaluation, gradient: Gradient, curvature: Curvature) -> None:
        self._objective, self._at, self._curvature = objective, at, curvature
        self._leak = FrozenLeak(objective, at.state.displacement)
        self._here = self._leak(at.chi)
        #: g, gradient at δ = 0 of what is modelled, (n_vertices,).
        self.linear: Floats = gradient.total - at.design.gradient - self._here.gradient

    def __call__(self, delta: Floats) -> ModelPoint:
        """Evaluate at a step (n_vertices,)."""
        chi = self._at.chi + delta
        design, leak, bent = self._objective.design(chi), self._leak(chi), self._curvature @ delta
        value = design.value + leak.value + float(delta @ (self.linear + 0.5 * bent))
        return ModelPoint(delta, value, design.gradient + leak.gradient + self.linear + bent, design, leak)

    def design(self, delta: Floats) -> DesignTerms:
        """The χ-only terms at a step."""
        return self._objective.design(self._at.chi + delta)

    def product(self, at: ModelPoint, direction: Floats) -> Floats:
        """Hessian, without the χ-only terms, times a direction at the point evaluated last; (n_vertices,)."""
        return self._curvature @ direction + self._leak.product(self._at.chi + at.delta, at.leak, direction)

    def learn(self, delta: Floats, product: Product) -> float:
        """Take up an exact Hessian product at δ = 0; returns by how much ½ δᵀ B δ was wrong."""
        self._leak(self._at.chi)  # its Darcy matrix is needed again
        known = self._objective.design_product(self._at, delta) + self._leak.product(self._at.chi, self._here, delta)
        exact = product.hessian - known
        error = 0.5 * float(delta @ (exact - self._curvature @ delta))
        self._curvature.learn(delta, exact)
        return abs(error)

    def learn_from(self, new: Evaluation, gradient: Gradient) -> None:
        """Take up the gradient at an accepted design: the curvature averaged along the step."""
        delta = new.chi - self._at.chi
        if float(np.abs(delta).max()) < SMALLEST_LESSON:
            return
        average = gradient.total - new.design.gradient - self._leak(new.chi).gradient - self.linear
        self._curvature.learn(delta, average)

    def predict(self, delta: Floats, dx: Floats) -> tuple[float, Floats] | None:
        """Change of the true objective if the displacements change by ``dx`` (n_x,), and p there.

        None if an element inverts. Only a scalar Darcy problem is solved.
        """
        objective, equilibrium = self._objective, self._objective.equilibrium
        chi, x = self._at.chi + delta, self._at.state.x + dx
        u = equilibrium.kinematics.displacement(x)
        energy, _ = strain_energy_excess(equilibrium.geometry, equilibrium.coefficients, chi, u)
        if not np.isfinite(energy):
            return None
        leak = FrozenLeak(objective, u)(chi)
        value = main_objective(x, objective.load) + objective.design(chi).value + leak.value + float(energy)
        return value - self._at.value, leak.p
