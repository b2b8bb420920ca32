"""The numbers that steer the optimiser: few, and related as they must be."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, fields, replace
from typing import Any

import pytest

from actuator.optimiser.controls import CONTROLS


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"backtracking": 0.0}, "backtracking must be positive"),
        ({"stiffness_range": (-1.0, 1.0)}, "stiffness_range must be positive"),
        ({"sufficient_decrease": 0.3}, "sufficient_decrease must be below poor_agreement"),
        ({"good_agreement": 0.2}, "poor_agreement must be below good_agreement"),
        ({"worthless_gain": 0.2}, "worthless_gain must be below negligible_gain"),
        ({"reach_range": (2.0, 0.1)}, "reach_range must rise"),
        ({"boundary_share": 1.0}, "boundary_share must be below 1"),
        ({"trust_factor": 1.0}, "trust_factor must be above 1"),
        ({"stiffness_factor": 0.5}, "stiffness_factor must be above 1"),
    ],
)
def test_wrong_relations_are_refused(changes: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        replace(CONTROLS, **changes)


@pytest.mark.parametrize("name", [control.name for control in fields(CONTROLS)])
def test_no_one_changes_them_in_passing(name: str) -> None:
    with pytest.raises(FrozenInstanceError):
        setattr(CONTROLS, name, 1.0)
