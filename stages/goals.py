"""The key ``objective.goal``: what C_0 is, one goal or several with weights.

A goal is a subclass of :class:`actuator.terms.goals.interface.Goal` and its section here, registered in :data:`GOALS`;
those of another program too, before a case is read.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator

from actuator.registry import Registry
from stages.section import Kinds, Section

if TYPE_CHECKING:
    from actuator.parameters import Load
    from actuator.terms.goals.interface import Goal

#: Directions that have a name.
DIRECTIONS = {"up": (0.0, 0.0, 1.0), "down": (0.0, 0.0, -1.0), "along": (1.0, 0.0, 0.0)}
#: The paper's goal.
DEFAULT = "bending"


class GoalSettings(Section):
    """What the sections of all goals have."""

    name: str
    weight: float = Field(1.0, gt=0, description="factor on this goal in C_0 [-]")

    @abstractmethod
    def build(self, load: Load, size: float) -> Goal:
        """The goal.

        Args:
            load: pressure, arm and spring, in N and mm.
            size: R of the domain, mm.
        """


class BendingSettings(GoalSettings):
    """C_0 of Eq. (9): the arm is turned down, and its root is not lifted."""

    name: Literal["bending"] = "bending"

    def build(self, load: Load, size: float) -> Goal:
        """The paper's goal."""
        from actuator.terms.goals.bending import Bending

        return Bending()


def _pointing(value: Any) -> Any:
    """A direction that has a name, as a vector."""
    if isinstance(value, str):
        if value not in DIRECTIONS:
            raise ValueError(f"must be {', '.join(DIRECTIONS)} or a vector such as [0.0, 0.0, -1.0], not '{value}'")
        return list(DIRECTIONS[value])
    return value


def _words_too(schema: dict[str, Any]) -> None:
    """Let the JSON Schema allow the names of directions."""
    vector = {key: schema.pop(key) for key in ("items", "maxItems", "minItems", "type")}
    schema["anyOf"] = [{"enum": list(DIRECTIONS)}, vector]


class TravelSettings(GoalSettings):
    """How far a point of the arm travels in a direction."""

    name: Literal["travel"]
    direction: Annotated[list[float], BeforeValidator(_pointing)] = Field(
        list(DIRECTIONS["down"]),
        min_length=3,
        max_length=3,
        description="of the travel: up, down, along (the axis) or a vector of X1, X2 and X3 [-]",
        json_schema_extra=_words_too,
    )
    point: list[float] | None = Field(
        None,
        min_length=3,
        max_length=3,
        description="at rest, X1, X2 and X3 from the middle of the glued face; left out, the arm's end [mm]",
    )
    target: float | None = Field(None, description="travel to reach at p_in; left out, as far as can be [mm]")

    @field_validator("direction")
    @classmethod
    def _has_length(cls, direction: list[float]) -> list[float]:
        """Refuse a vector that points nowhere."""
        if not any(direction):
            raise ValueError("the vector has no length; write one such as [0.0, 0.0, -1.0]")
        return direction

    def build(self, load: Load, size: float) -> Goal:
        """Travel over L_arm."""
        from actuator.terms.goals.travel import Travel

        length = math.hypot(*self.direction)
        target = None if self.target is None else self.target / load.arm_length
        return Travel(
            target,
            tuple(component / length for component in self.direction),
            None if self.point is None else tuple(self.point),
        )


class ExtensionSettings(GoalSettings):
    """How much longer the actuator becomes."""

    name: Literal["extension"]
    target: float | None = Field(None, description="extension to reach at p_in; left out, as long as can be [mm]")

    def build(self, load: Load, size: float) -> Goal:
        """Travel of the middle of the glued face along the axis, over L_arm."""
        from actuator.terms.goals.travel import Travel

        target = None if self.target is None else self.target / load.arm_length
        return Travel(target, DIRECTIONS["along"], (0.0, 0.0, 0.0))


class RotationSettings(GoalSettings):
    """How far the arm turns about an axis."""

    name: Literal["rotation"]
    axis: Literal["X1", "X2", "X3"] = Field("X2", description="X1 twists, X2 bends the arm down, X3 turns it sideways")
    sense: Literal[1, -1] = Field(1, description="1 by the right hand, -1 the other way [-]")
    target: float | None = Field(None, description="angle to reach at p_in; left out, as far as can be [°]")

    def build(self, load: Load, size: float) -> Goal:
        """The angle in radians."""
        from actuator.terms.goals.rotation import Rotation

        target = None if self.target is None else math.radians(self.target)
        return Rotation(target, f"theta{self.axis[1]}", float(self.sense))


class ForceSettings(GoalSettings):
    """How hard the arm's end presses down on its spring; a stiff one holds it."""

    name: Literal["force"]
    target: float | None = Field(
        None, description="force to reach at p_in, of what is modelled, over p_in R²; left out, as large as can be [-]"
    )

    def build(self, load: Load, size: float) -> Goal:
        """The spring's force over p_in R²."""
        from actuator.terms.goals.force import Force

        # Without pressure it is the force itself, in N.
        return Force(self.target, load.pressure * size**2 or 1.0)


#: The goals that a case may name, in the order in which they are listed.
GOALS: Registry[type[GoalSettings]] = Registry("goal")
GOALS.register("bending", BendingSettings)
GOALS.register("travel", TravelSettings)
GOALS.register("extension", ExtensionSettings)
GOALS.register("rotation", RotationSettings)
GOALS.register("force", ForceSettings)


def _named(value: Any) -> Any:
    """``goal: extension`` is short for a section with that name."""
    return {"name": value} if isinstance(value, str) else value


AnyGoalSettings = Annotated[GoalSettings, Kinds(GOALS, default=DEFAULT), BeforeValidator(_named)]


def _listed(value: Any) -> Any:
    """One goal is short for a list of one."""
    return value if isinstance(value, list) or value is None else [value]


#: One goal or several, or the paper's.
Goals = Annotated[list[AnyGoalSettings] | None, BeforeValidator(_listed)]


def goal_of(goals: list[GoalSettings] | None, load: Load, size: float) -> Goal:
    """The goal that a case names, or the weighted sum of those that it names; the paper's if it names none."""
    from actuator.terms.goals.interface import Sum

    parts = [(each.weight, each.build(load, size)) for each in goals or [BendingSettings()]]
    return parts[0][1] if len(parts) == 1 and parts[0][0] == 1.0 else Sum(tuple(parts))
