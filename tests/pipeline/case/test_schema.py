"""The JSON Schema of the case file, by a validator of its own, and the new case made from it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from command_line import Poro
from jsonschema import Draft202012Validator

from pipeline.case.model import case_schema, case_type, parse_case, read_case
from pipeline.case.shipped import shipped_case, shipped_names
from pipeline.exit_codes import ExitCode
from stages.settings import LoadSettings

SCHEMA: dict[str, Any] = json.loads(case_schema())
VALIDATOR = Draft202012Validator(SCHEMA)
SECTIONS = {name: field["$ref"].rpartition("/")[2] for name, field in SCHEMA["properties"].items() if "$ref" in field}


#: Keys that a case has in place of ratios, which are those that have a default.
INSTEAD = {f"load.{key}" for key in LoadSettings.instead}


def keys() -> dict[str, dict[str, Any]]:
    """Every key of every section but those: what the schema says of it."""
    return {
        f"{section}.{key}": found
        for section, model in SECTIONS.items()
        for key, found in SCHEMA["$defs"][model]["properties"].items()
        if f"{section}.{key}" not in INSTEAD
    }


def test_schema_is_one_and_says_so() -> None:
    Draft202012Validator.check_schema(SCHEMA)
    assert SCHEMA["$schema"] == Draft202012Validator.META_SCHEMA["$schema"]
    assert re.match(r"^[a-z]+:", SCHEMA["$id"])
    assert set(SECTIONS) | {"name", "regions"} == set(case_type().model_fields)


def test_every_key_has_what_editors_show() -> None:
    for key, found in keys().items():
        assert {"title", "description", "default"} <= set(found), key
        kinds = {found.get("type"), *(option.get("type") for option in found.get("anyOf", []))}
        if kinds & {"number", "integer"}:
            assert re.search(r"\[.+\]", found["description"]), f"{key} has no unit"
    for section, model in SECTIONS.items():
        assert SCHEMA["$defs"][model]["title"] == f"Section {section}"
        assert SCHEMA["$defs"][model]["description"]


@pytest.mark.parametrize("name", shipped_names())
def test_shipped_cases_are_valid(name: str) -> None:
    path = shipped_case(name)
    assert path is not None
    VALIDATOR.validate(yaml.safe_load(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    "text",
    [
        "domain: {radiu: 15.0}",
        "domian: {radius: 15.0}",
        "domain: {radius: -15.0}",
        "domain: {layers: 9.5}",
        "domain: 15.0",
        "load: {pressure_ratio: high}",
        "export: {format: obj}",
        "material: {poisson_ratio: 0.5}",
        "rig: {youngs_modulus: 0.0}",
        "domain: {radius: wide}",
        "load: {pressure: 10 kPa, pressure_ratio: 0.02}",
        "name: quick.refined",
        "name: ../x",
    ],
)
def test_schema_refuses_what_the_program_refuses(text: str) -> None:
    assert list(VALIDATOR.iter_errors(yaml.safe_load(text)))
    with pytest.raises(Exception, match=r"case\.yaml:1: "):
        parse_case(text.encode(), "case.yaml", "case")


@pytest.mark.parametrize("like", ["case14", "case11", "quick", "quick.yaml"])
def test_new_case_is_the_shipped_one_with_every_key_explained(like: str, poro: Poro) -> None:
    ended = poro("new", "mine", "--like", like)
    assert ended.code == ExitCode.OK, ended.err
    assert ended.out == "mine.yaml\n"
    text = Path("mine.yaml").read_text(encoding="utf-8")
    path = shipped_case(like if like.endswith(".yaml") else f"{like}.yaml")
    assert path is not None
    case, _ = read_case(Path("mine.yaml"))
    assert case == read_case(path)[0].model_copy(update={"name": "mine"})
    written = yaml.safe_load(text)
    VALIDATOR.validate(written)
    assert {f"{section}.{key}" for section in SECTIONS for key in written[section]} == set(keys())
    lines = text.splitlines()
    for key, found in keys().items():
        name = key.rpartition(".")[2]
        told = [line.partition("  # ")[2] for line in lines if line.startswith(f"  {name}: ")]
        comments = [comment.rpartition("; default ") for comment in told]
        assert found["description"] in [comment[0] for comment in comments], key
        assert found["default"] in [yaml.safe_load(comment[2]) for comment in comments], key


def test_new_case_tells_of_the_quantities_in_place_of_ratios(poro: Poro) -> None:
    assert poro("new", "mine", "--like", "quick").code == ExitCode.OK
    text = Path("mine.yaml").read_text(encoding="utf-8")
    assert "\n  # pressure: 54.72 kPa  " in text
    Path("mine.yaml").write_text(text.replace("  pressure_ratio: ", "  # ").replace("  # pressure: ", "  pressure: "))
    VALIDATOR.validate(yaml.safe_load(Path("mine.yaml").read_text(encoding="utf-8")))
    shipped = shipped_case("quick.yaml")
    assert shipped
    assert read_case(Path("mine.yaml"))[0].load == read_case(shipped)[0].load
    # A case with a quantity gives one with it.
    assert poro("new", "again", "--like", "mine.yaml").code == ExitCode.OK
    assert "\n  pressure: 54.72 kPa  " in Path("again.yaml").read_text(encoding="utf-8")
    assert read_case(Path("again.yaml"))[0].load == read_case(Path("mine.yaml"))[0].load


def test_new_case_names_its_schema_to_editors(poro: Poro) -> None:
    assert poro("new", "mine.yaml", "--schema", "--json").code == ExitCode.OK
    first = Path("mine.yaml").read_text(encoding="utf-8").splitlines()[0]
    named = first.removeprefix("# yaml-language-server: $schema=")
    assert json.loads(Path(named).read_text(encoding="utf-8")) == SCHEMA
    # A second case shares the schema.
    assert poro("new", "other", "--schema").code == ExitCode.OK


def test_new_case_overwrites_nothing_unless_told_to(poro: Poro) -> None:
    Path("mine.yaml").write_text("# notes\n")
    ended = poro("new", "mine")
    assert ended.code == ExitCode.USAGE
    assert "mine.yaml: there is such a file" in ended.err
    assert Path("mine.yaml").read_text() == "# notes\n"
    assert poro("new", "mine", "--output", "there.yaml").code == ExitCode.OK
    assert read_case(Path("there.yaml"))[0].name == "mine"
    assert poro("new", "mine", "--force").code == ExitCode.OK
    assert read_case(Path("mine.yaml"))[0].name == "mine"


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (["../x"], "may only have letters"),
        (["x.refined"], "must not end in .refined"),
        (["x", "--like", "nothing"], "there is no such file"),
        (["x", "--output", "no/x.yaml"], "there is no folder no"),
        (["x", "--output", "."], "this is a folder"),
    ],
)
def test_new_cases_that_cannot_be_give_one_sentence(arguments: list[str], part: str, poro: Poro) -> None:
    ended = poro("new", *arguments)
    assert ended.code == ExitCode.USAGE
    assert part in ended.err
    assert ended.err.count("\n") == 1
    assert list(Path().iterdir()) == []
