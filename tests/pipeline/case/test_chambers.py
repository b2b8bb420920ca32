"""Several chambers in a case file, from its refusals to the part."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from command_line import Poro
from jsonschema import Draft202012Validator

from actuator.failure import InvalidSettings
from pipeline.case.model import case_schema, parse_case
from pipeline.case.writer import case_text
from pipeline.exit_codes import ExitCode, Fault
from pipeline.results.design import read_design
from stages.chambers import posed
from stages.inflate import refuse_unlike
from stages.similarity import similar

CASE = """\
domain: {core_cells: 4, rings: 2, layers: 4}
load:
  chambers:
    - {name: upper, centre: [0, 6.5], radius: 2.5 mm}
    - {name: lower, centre: [0.0, -6.5 mm], radius: 2.5}
  cases:
    - {name: down, chambers: {upper: 0.02}}
    - {name: half, chambers: {upper: 0.02, lower: 0.01}, weight: 0.5}
optimizer: {max_updates: 2, keep_updates: 0}
"""


def test_every_load_case_has_pressures_of_its_own() -> None:
    case = parse_case(CASE.encode(), "x.yaml", "x")
    down, half = (each.load for each in case.load_cases())
    assert down.chambers == pytest.approx((0.02 * 2.736, 0.0))
    assert half.chambers == pytest.approx((0.02 * 2.736, 0.01 * 2.736))
    assert down.pressure == half.pressure == down.chambers[0]
    Draft202012Validator(json.loads(case_schema())).validate(yaml.safe_load(CASE))
    again = parse_case(case_text(case, "again").encode(), "x.yaml", "x")
    assert again.load == case.load
    scaled, units = similar(case.model_copy(update={"domain": case.domain.model_copy(update={"radius": 30.0})}))
    assert units.length == 2.0
    assert scaled.load.chambers[0].centre == [0.0, 3.25]


def test_without_load_cases_the_section_has_the_pressures() -> None:
    text = CASE.replace("radius: 2.5}", "radius: 2.5, pressure_ratio: 0.005}").split("  cases:")[0]
    (load,) = (each.load for each in parse_case(text.encode(), "x.yaml", "x").load_cases())
    assert load.chambers == pytest.approx((0.02 * 2.736, 0.005 * 2.736))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            ("-6.5 mm", "3"),
            "3: load.chambers: 'upper' and 'lower' are joined: their channels overlap; move them apart or make them "
            "thinner",
        ),
        (("name: lower", "name: upper"), "3: load.chambers: two chambers are called 'upper'; give each a name"),
        (
            ("{upper: 0.02}", "{uper: 0.02}"),
            "6: load.cases: load case 'down' has a chamber 'uper', and there are upper, lower; write one of these",
        ),
        (("lower: 0.01", "lower: -0.01"), "8: load.cases.1.chambers.lower: must be at least 0, not -0.01"),
        (("[0, 6.5]", "[6.5]"), "4: load.chambers.0.centre: must have at least 2 entries, not 1; change the list"),
        (
            ("weight: 0.5", "pressure_ratio: 0.1"),
            "8: load.cases.1: has both 'pressure_ratio' and 'chambers'; write one of the two",
        ),
    ],
)
def test_a_mistake_is_told_with_its_line(change: tuple[str, str], sentence: str) -> None:
    with pytest.raises(Fault) as caught:
        parse_case(CASE.replace(*change).encode(), "x.yaml", "x")
    assert caught.value.code == ExitCode.USAGE
    assert str(caught.value).startswith(f"x.yaml:{sentence}")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (("-6.5 mm", "-1"), "chambers 'upper' and 'lower' are joined: their channels leave 2.5 mm for a wall, and an"),
        (("[0, 6.5]", "[0, 11]"), "chamber 'upper' is joined to the outside: its channel leaves 1.5 mm for a wall"),
        (("[0, 6.5]", "[0, 30]"), "no vertex of the mesh lies in the channel of chamber 'upper'"),
    ],
)
def test_chambers_without_room_for_walls_are_refused(change: tuple[str, str], sentence: str, poro: Poro) -> None:
    Path("x.yaml").write_text(CASE.replace(*change))
    ended = poro("optimize", "x.yaml", "--threads", "1", "--output", ".")
    assert ended.code == ExitCode.USAGE
    assert f"load.chambers: {sentence}" in ended.err
    assert "Traceback" not in ended.err


def test_chambers_go_from_the_case_to_the_part(poro: Poro) -> None:
    Path("x.yaml").write_text(CASE)
    ended = poro("optimize", "x.yaml", "--threads", "1", "--output", ".", "--json")
    assert ended.code == ExitCode.OK, ended.err
    told = json.loads(ended.out)
    assert told["load_cases"]["down"]["chamber_leak"] <= told["chamber_leak"] < 0.05
    assert told["load_cases"]["down"]["theta2"] > told["load_cases"]["half"]["theta2"]
    design = read_design(Path("x/x.h5"))
    for channel in posed(design.case.optimize).channels:
        inside = channel.radii(design.domain.points) < 0.6 * channel.radius
        assert (design.chi[inside] < 0.0).all()
        own = 0.02 * 2.736 if channel.name == "upper" else 0.0
        assert np.abs(design.pressure[inside] - own).max() < 0.02 * 0.02 * 2.736
    with pytest.raises(InvalidSettings, match=r"load\.chambers is not inflated"):
        refuse_unlike(design.case.optimize)
