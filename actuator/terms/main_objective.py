"""C_0 of Eq. (9): how far the arm is lifted and how little it turns down."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator.parameters import Load
from actuator.terms.interface import Derivatives, Fields, Problem, StateTerm, Value

#: Factor of Eq. (9) on the squared lift of the arm's root, which keeps it from rising.
LIFT_WEIGHT = 500.0


class MainObjective(StateTerm):
    """C_0 = T3 / L_arm - sin θ2 + 500 ⟨T3 / L_arm⟩²."""

    def __init__(self, problem: Problem) -> None:
        self._load = problem.load

    def value(self, at: Fields) -> Value:
        """C_0, dimensionless."""
        return Value(main_objective(at.arm, self._load))

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add ∂C_0/∂T, the arm's entries alone."""
        into.arm[:] += main_objective_gradient(at.arm, self._load)


def main_objective(arm: NDArray[Any], load: Load) -> float:
    """C_0 of T = [T1, T3 (mm), θ2 (rad)], dimensionless."""
    _, rise, angle = arm
    lift = rise / load.arm_length
    return float(lift - np.sin(angle) + LIFT_WEIGHT * max(lift, 0.0) ** 2)


def main_objective_gradient(arm: NDArray[Any], load: Load) -> NDArray[Any]:
    """∂C_0/∂T, (3,), of a real or complex T."""
    _, rise, angle = arm
    lift = rise / load.arm_length
    positive = lift if lift.real > 0.0 else 0.0 * lift
    return np.array([0.0 * lift, (1.0 + 2.0 * LIFT_WEIGHT * positive) / load.arm_length, -np.cos(angle)])
