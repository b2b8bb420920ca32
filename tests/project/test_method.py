"""docs/explain/method.md names every control of the optimiser and of the solution of states, with the value it has."""

from __future__ import annotations

import ast
import re
from dataclasses import fields
from pathlib import Path

from actuator.optimiser.controls import CONTROLS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "explain" / "method.md").read_text(encoding="utf-8")

#: Rooms whose constants steer the method; paths and printing have pages of their own. Those of the optimiser are in one
#: place (:mod:`actuator.optimiser.controls`), but for what is none of its business: numerical limits of a machine.
MODULES = [
    *sorted((ROOT / "actuator" / "optimiser").glob("*.py")),
    ROOT / "actuator" / "solve" / "equilibrium.py",
    ROOT / "actuator" / "solve" / "linearisation.py",
    ROOT / "actuator" / "solve" / "sensitivity.py",
]


def controls() -> dict[str, set[float]]:
    """Values of the numeric constants of all modules by name; a name may be used in several."""
    found: dict[str, set[float]] = {}
    for path in MODULES:
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.Assign):
                continue
            (target,) = node.targets
            pairs = [(target, node.value)]
            if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                pairs = list(zip(target.elts, node.value.elts, strict=True))
            for name, value in pairs:
                if isinstance(name, ast.Name) and isinstance(value, ast.Constant) and not isinstance(value.value, str):
                    found.setdefault(name.id, set()).add(float(value.value))
    return found


def test_every_control_of_the_optimiser_is_named_with_its_value() -> None:
    told = {name: value for name, value in re.findall(r"`(\w+)` \(([^)]+)\)", PAGE)}
    for control in fields(CONTROLS):
        value = getattr(CONTROLS, control.name)
        expected = value if isinstance(value, tuple) else (value,)
        found = tuple(float(number) for number in told[control.name].split(" to "))
        assert found == expected, control.name


def test_half_of_the_controls_are_gone() -> None:
    """There were 57, under names that meant different things in different files."""
    assert len(fields(CONTROLS)) <= 28


def test_every_other_control_is_named_with_its_value() -> None:
    told = {name: set() for name in controls()}
    for name, value in re.findall(r"\b([A-Z][A-Z_]+) \(([-\d.e]+)\)", PAGE):
        assert name in told, f"docs/explain/method.md names {name}, which is no control"
        told[name].add(float(value))
    assert told == controls()


def test_page_is_short() -> None:
    assert len(PAGE.splitlines()) <= 160
