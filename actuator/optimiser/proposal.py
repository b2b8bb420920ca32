"""A subproblem as its solvers see it, and what they find."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.optimiser.quadratic import Quadratic
from actuator.terms.design import DesignObjective


@dataclass(frozen=True)
class Proposal:
    """Solution of a subproblem.

    Attributes:
        step: s.
        change: what it promises, negative.
        value: the sum of the design terms there.
        rough: whether the solution on the active constraints was not looked for, because it gains little.
    """

    step: Floats
    change: float
    value: float
    rough: bool = False


@dataclass(frozen=True)
class Task:
    """One subproblem, from s = 0.

    Attributes:
        design: the χ-only terms.
        chi, value: the design at s = 0 and the sum of its terms.
        physics: the quadratic.
        reach: largest change of χ.
    """

    design: DesignObjective
    chi: Floats
    value: float
    physics: Quadratic
    reach: float

    @property
    def rounding(self) -> float:
        """What terms may be off by in double precision."""
        return 64.0 * float(np.finfo(np.float64).eps) * abs(self.value)

    def proposal(self, s: Floats, bent: Floats, smooth: float) -> Proposal:
        """What a step promises, of which (B + Q) s and the terms but for C_χ are known."""
        terms = smooth
        if bound := self.design.bound:
            terms += bound.penalty(-bound.room(self.chi + s))
        return Proposal(s, self.physics.value(s, bent) + terms - self.value, terms)
