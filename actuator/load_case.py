"""Load cases: what a design has to carry and what it is for, each in a state of its own."""

from __future__ import annotations

from dataclasses import dataclass

from actuator.parameters import Load
from actuator.terms.goals.bending import PAPER_GOAL
from actuator.terms.goals.interface import Goal


@dataclass(frozen=True)
class LoadCase:
    """One of the loads of a design.

    Attributes:
        load: pressure, arm and spring.
        weight: factor on what the state is wanted for: C_0 and the terms that the paper does not have. Leak and strain
            energy are penalties for limits that hold under every load, whatever that weighs.
        name: to tell it from others; empty if it is the only one.
        goal: what C_0 is.
    """

    load: Load
    weight: float = 1.0
    name: str = ""
    goal: Goal = PAPER_GOAL
