"""Quantities with units in a case, and those in place of ratios."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from command_line import Poro

import poro as door
from pipeline.case.model import Case, read_case
from pipeline.case.remarks import remarks
from pipeline.case.shipped import shipped_names
from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.keys import content_key, plain, stage_settings
from stages.chain import STAGES

#: One actuator of a soft silicone, in the words of the bench and in those of the paper.
BENCH = """
domain: {radius: 0.6 in, length: 1.5 cm}
material: {youngs_modulus: 70 kPa}
load: {pressure: 0.2 psi, arm_length: 6 cm, spring_stiffness: 2 N/m}
objective: {interface_width: 3000 µm}
refine: {filter_radius: 0.1 mm}
inflate: {size: 2.5 mm, pressure: 30 mbar}
rig: {youngs_modulus: 70000 Pa, spring_modulus: 200 GPa}
"""
R, E = 15.24, 0.07
SPRING = 0.001 * 60.0**2 / (E * R**3)
RATIOS = f"""
domain: {{radius: {R}, length: 15.0}}
material: {{youngs_modulus: {E}}}
load: {{pressure_ratio: {0.2 * 6.894757293168361e-3 / E!r}, arm_ratio: {60.0 / R!r}, spring_ratio: {SPRING!r}}}
objective: {{interface_width: 3.0}}
refine: {{filter_radius: 0.1}}
inflate: {{size: 2.5, pressure: 3.0}}
rig: {{youngs_modulus: 0.07, spring_modulus: 2.0e+5}}
"""


def case_of(text: str) -> Case:
    """The case of a text."""
    Path("case.yaml").write_text(text, encoding="utf-8")
    return read_case(Path("case.yaml"))[0]


def test_a_case_with_units_is_the_one_with_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    bench, ratios = case_of(BENCH), case_of(RATIOS)
    assert bench.load.model_dump() == pytest.approx(ratios.load.model_dump(), rel=1e-12)
    assert bench.model_copy(update={"load": ratios.load}) == ratios


def test_round_quantities_have_the_keys_of_round_ratios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shipped = read_case(Path(__file__).parents[3] / "configs" / "case14.yaml")[0]
    load = "load: {pressure: 54.72 kPa, arm_length: 6 cm, spring_stiffness: 82.08 N/m}"
    same = door.with_changes(
        case_of(f"{load}\nexport: {{scale: 1.5}}\nrig: {{youngs_modulus: 1.0}}\n"), {"name": "case14"}
    )
    assert same == shipped
    keys = [content_key("optimize", 1, stage_settings(plain(case), "optimize")) for case in (same, shipped)]
    assert keys[0] == keys[1]
    assert set(plain(same)["load"]) == {"pressure_ratio", "arm_ratio", "spring_ratio"}
    assert "load" in STAGES["optimize"].sections


MISTAKES = {
    "load:\n  pressure: 10 kPa\n  pressure_ratio: 0.02\n": (
        2,
        "load.pressure: says the same as load.pressure_ratio; remove",
    ),
    "load:\n  arm_length: 6 cm\n  arm_ratio: 4.0\n": (2, "load.arm_length: says the same as load.arm_ratio; remove"),
    "load:\n  pressure: 10 mm\n": (
        2,
        "load.pressure: must be a pressure, and '10 mm' is a length; write it as in '20 kPa'",
    ),
    "load:\n\n  spring_stiffness: 3 N\n": (
        3,
        "load.spring_stiffness: must be a stiffness, and '3 N' is something else",
    ),
    "load:\n  pressure: -1 kPa\n": (2, "load.pressure: as pressure_ratio it must be at least 0"),
    "load:\n  arm_length: 0\n": (2, "load.arm_length: must be greater than 0"),
    "load:\n  pressure: high\n": (2, "load.pressure: must be a pressure, not the text 'high'; write it as in '20 kPa'"),
    "load:\n  pressure: [1.0]\n": (2, "load.pressure: must be a pressure, not a list; write it as in '20 kPa'"),
    "load:\n  pressure_ratio: 10 kPa\n": (
        2,
        "load.pressure_ratio: is a number without a unit; write 'pressure: 10 kPa'",
    ),
    "material:\n  pressure: 10 kPa\n": (2, "material.pressure: unknown key here; it belongs below 'load:'"),
    "material:\n  youngs_modulus: 7 cm\n": (
        2,
        "material.youngs_modulus: must be a stress or modulus, and '7 cm' is a length",
    ),
    "domain:\n  radius: 10 kPa\n": (
        2,
        "domain.radius: must be a length, and '10 kPa' is a pressure; write it as in '15 mm'",
    ),
    "domain:\n  radius: 15 mn\n": (2, "domain.radius: must be a length, and 'mn' is no unit; write it as in '15 mm'"),
    "domain:\n  radius: -1.5 cm\n": (2, "domain.radius: must be greater than 0, not -15.0; change the value"),
}


@pytest.mark.parametrize("text", MISTAKES)
def test_mistakes_give_one_sentence_with_line_key_and_remedy(text: str, poro: Poro) -> None:
    Path("bad.yaml").write_text(text)
    ended = poro("run", "bad.yaml", "--dry-run")
    line, part = MISTAKES[text]
    assert ended.code == ExitCode.USAGE
    assert ended.err.startswith(f"poro: bad.yaml:{line}: {part}")
    assert ended.err.count("\n") == 1


def test_changes_keep_what_is_given_as_a_quantity() -> None:
    case = door.make_case(material={"youngs_modulus": "1 MPa"}, load={"pressure": "20 kPa"})
    assert door.with_changes(case, {"material.youngs_modulus": "0.5 MPa"}).load.pressure_ratio == 0.04
    assert door.with_changes(case, {"load.pressure": "10 kPa"}).load.pressure_ratio == 0.01
    assert door.with_changes(case, {"load.pressure_ratio": 0.03}).load.pressure_ratio == 0.03
    assert door.with_changes(case, {"load.pressure": 10}).load.pressure_ratio == 0.01
    with pytest.raises(Fault, match=r"says the same as load\.arm_ratio"):
        door.make_case(load={"arm_length": "6 cm", "arm_ratio": 4.0})


REMARKS: list[tuple[dict[str, Any], list[str]]] = [
    ({}, []),
    ({"material": {"youngs_modulus": "70 kPa"}, "load": {"pressure": "1 kPa"}}, []),
    ({"load": {"pressure_ratio": 10.0}}, ["load: p_in / E is 10, 500 times the paper's 0.02"]),
    ({"load": {"pressure_ratio": 2.0e-5}}, ["0.001 times the paper's 0.02; hardly anything moves: check the units"]),
    ({"load": {"pressure": "10 kPa"}}, ["load.pressure: counts with the paper's E, 2.736 N/mm²"]),
    (
        {"material": {"youngs_modulus": 1.0}, "load": {"pressure": 20}, "rig": {"youngs_modulus": 0.5}},
        ["on the print of rig.youngs_modulus, 0.5 N/mm², it is 10 kPa"],
    ),
    ({"domain": {"core_cells": 2, "rings": 1}}, ["interface_width: is 0.64 cells of 4.7 mm, 1 to 10 were tried"]),
    ({"domain": {"layers": 2}}, ["interface_width: is 0.4 cells of 7.5 mm", "raise domain.layers"]),
    ({"domain": {"length": 150.0}}, ["objective.interface_width: is 0.36 cells of 8.33 mm"]),
    ({"domain": {"layers": 1000}}, ["interface_width: is 2e+02 cells", "cells are 0.015 mm long and 0.818 mm wide"]),
    ({"objective": {"strain_limit": 14.0}}, ["14 % is written 0.14"]),
    ({"material": {"poisson_ratio": 0.3}}, ["material.poisson_ratio: is 0.3"]),
]


@pytest.mark.parametrize(("sections", "parts"), REMARKS)
def test_what_is_far_from_what_was_tried_is_remarked_on(sections: dict[str, Any], parts: list[str]) -> None:
    said = "\n".join(remarks(door.make_case(**sections)))
    assert all(part in said for part in parts), said
    assert bool(said) == bool(parts)


@pytest.mark.parametrize("name", shipped_names())
def test_nothing_is_to_be_said_of_shipped_cases(name: str) -> None:
    assert not remarks(door.read_case(name))


def test_remarks_are_told_and_go_on(poro: Poro) -> None:
    Path("own.yaml").write_text("material: {youngs_modulus: 70 kPa}\nload: {pressure: 10 kPa}\n")
    for command in (("run", "own.yaml", "--dry-run"), ("status", "own.yaml")):
        ended = poro(*command)
        assert ended.code == ExitCode.OK
        assert ended.err.startswith("warning: load: p_in / E is 0.143, 7.14 times the paper's 0.02; ")
        assert len(json.loads(poro(*command, "--json").out)["warnings"]) == 1
