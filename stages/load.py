"""What a case's spring does to the arm's end, and the force there."""

from __future__ import annotations

from typing import Any

from actuator.failure import InvalidSettings
from stages.settings import ProblemSettings

#: Spring ratio from which the arm's end counts as held. On 384 cells of the paper's case the travel is then 1/970
#: of that without a spring, and the force 0.1 % less than at 1e6 (measured).
HELD = 100.0


def held(problem: ProblemSettings) -> bool:
    """Whether the spring is so stiff that there is nothing to optimise; of several load cases, that of the first."""
    return problem.leading.load.spring_ratio >= HELD


def travel(problem: ProblemSettings) -> str:
    """What the travel of the arm's end is called."""
    return "elongation of the spring" if problem.leading.load.spring_ratio else "travel of the arm's end"


def refuse_across(problem: ProblemSettings) -> None:
    """Refuse a force that half an actuator cannot take.

    Raises:
        actuator.failure.InvalidSettings: if it has a part across a symmetry plane.
    """
    forces = [problem.load.force_ratio, *(case.force_ratio for case in problem.load.cases)]
    if problem.domain.halves == 1 and any(force and force[1] for force in forces):
        raise InvalidSettings(
            "load.force_ratio: half an actuator takes no force along X2, across its symmetry plane; write 0.0 as the "
            "second number, or take a domain without a symmetry plane."
        )


def arm_end(problem: ProblemSettings, elongation: float) -> dict[str, Any]:
    """What a summary says of the arm's end at an elongation, mm, of its spring: what holds it, with which force."""
    end = "held" if held(problem) else "sprung" if problem.leading.load.spring_ratio else "free"
    return {"arm_end": end, "spring_force": whole_force(problem, elongation)}


def whole_force(problem: ProblemSettings, elongation: float) -> float:
    """Force of the spring at an elongation, mm, of the whole actuator, N."""
    _, load, _ = problem.parameters()
    # Of what is modelled: half an actuator, or a whole one.
    return 2.0 / problem.domain.halves * load.spring_stiffness * elongation
