"""C_0, what the actuator is for: a goal of the arm's motion, by default that of Eq. (9)."""

from __future__ import annotations

from actuator.terms.interface import Derivatives, Fields, Problem, StateTerm, Value


class MainObjective(StateTerm):
    """C_0 of a problem's goal (:mod:`actuator.terms.goals`)."""

    def __init__(self, problem: Problem) -> None:
        self._goal, self._load = problem.goal, problem.load

    def value(self, at: Fields) -> Value:
        """C_0, dimensionless."""
        return Value(self._goal.value(at.arm, self._load))

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add ∂C_0/∂T, the arm's entries alone."""
        into.arm[:] += self._goal.gradient(at.arm, self._load)
