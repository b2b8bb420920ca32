"""The goal in the case file: spelling, units, mistakes, keys of earlier results, and what an optimisation does."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from command_line import TINY, Poro

from actuator.terms.goals.bending import PAPER_GOAL
from actuator.terms.goals.interface import Goal, Sum
from actuator.terms.goals.rotation import Rotation
from actuator.terms.goals.travel import Travel
from pipeline.case.model import parse_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.paper import reference_of
from pipeline.runs import keys


def goal_of(text: str) -> Goal:
    case = parse_case(f"objective:\n  goal: {text}\n".encode(), "case.yaml", "case")
    return case.goal(case.parameters()[1])


@pytest.mark.parametrize(
    ("text", "goal"),
    [
        ("bending", PAPER_GOAL),
        ("extension", Travel(None, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))),
        ("{name: travel, direction: [0.0, 3.0, -4.0], target: 1.2 cm}", Travel(0.2, (0.0, 0.6, -0.8))),
        ("{name: travel, point: [1 cm, 0.0, -2.5]}", Travel(None, (0.0, 0.0, -1.0), (10.0, 0.0, -2.5))),
        ("{name: rotation, axis: X1, sense: -1, target: 90.0}", Rotation(0.5 * math.pi, "theta1", -1.0)),
        ("[bending, {name: rotation, weight: 0.5}]", Sum(((1.0, PAPER_GOAL), (0.5, Rotation(None, "theta2"))))),
    ],
)
def test_goal_of_a_case(text: str, goal: Goal) -> None:
    assert goal_of(text) == goal


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("bend", 2, ["objective.goal.0.name: 'bend' is unknown", "'bending'"]),
        ("[]", 2, ["objective.goal: must have at least 1 entries"]),
        ("\n    - bending\n    - {name: rotation, axs: X1}", 4, ["objective.goal.1.axs: unknown key", "'axis'"]),
        ("\n    - {name: travel, direction: left}", 3, ["direction: must be up, down, along or a vector", "'left'"]),
        ("{name: travel, direction: [0.0, 0.0, 0.0]}", 2, ["the vector has no length", "write one"]),
        ("{name: travel, point: [1.0, 2.0]}", 2, ["point: must have at least 3 entries, not 2"]),
        ("{name: travel, point: [1 kPa, 0.0, 0.0]}", 2, ["point", "1 kPa"]),
        ("{name: rotation, weight: 0.0}", 2, ["weight: must be greater than 0"]),
    ],
)
def test_mistakes_are_named_with_their_line(text: str, line: int, words: list[str]) -> None:
    with pytest.raises(Fault) as fault:
        goal_of(text)
    assert fault.value.code == ExitCode.USAGE
    message = str(fault.value)
    assert message.startswith(f"case.yaml:{line}: objective.goal")
    assert all(word in message for word in words), message


def test_lengths_of_a_goal_scale_with_the_units() -> None:
    case = parse_case(b"objective:\n  goal: {name: travel, point: [6.0, 0.0, 3.0], target: 9.0}\n", "case.yaml", "case")
    assert case.objective.goal is not None
    goal = case.in_units(3.0, 2.0).objective.goal[0]
    assert (goal.point, goal.target, goal.direction) == ([2.0, 0.0, 1.0], 3.0, [0.0, 0.0, -1.0])


def test_a_case_without_a_goal_keeps_its_key_and_its_comparison_with_the_paper() -> None:
    plain, other = (parse_case(text, "case.yaml", "case") for text in (b"name: a", b"objective: {goal: extension}"))
    assert "goal" not in keys.plain(plain)["objective"]
    assert "goal" in keys.plain(other)["objective"]
    assert reference_of(plain) is not None
    assert reference_of(other) is None


def test_what_is_asked_for_is_what_grows(tmp_path: Path, poro: Poro) -> None:
    """Bent and extended by the same number of updates: each is better at its own goal."""
    T1, theta2 = {}, {}
    for goal in ("bending", "extension"):
        text = TINY.replace("max_updates: 1", "max_updates: 4")
        (tmp_path / f"{goal}.yaml").write_text(text.replace("objective:\n", f"objective:\n  goal: {goal}\n"))
        ended = poro("optimize", f"{goal}.yaml", "--output", ".", "--threads", 1, "--json")
        assert ended.code in (ExitCode.OK, ExitCode.UNSTABLE), ended.err
        summary = json.loads(ended.out)
        T1[goal], theta2[goal] = summary["T1"], summary["theta2"]
        expected = -summary["T1"] / 60.0 if goal == "extension" else summary["T3"] / 60.0 - math.sin(theta2[goal])
        assert summary["terms"]["C0"] == pytest.approx(expected, rel=1e-12)
    assert T1["extension"] > T1["bending"]
    assert theta2["bending"] > theta2["extension"]
    assert "paper" not in poro("status", "extension.yaml", "--output", ".").out
