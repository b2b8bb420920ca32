"""``--set key=value``: any key of the case from the command line, as if it stood in the file."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml
from command_line import TINY, Poro

from pipeline.exit_codes import ExitCode
from pipeline.store import artifact

HERE = ("--output", ".")


def plan(poro: Poro, command: str, *arguments: object) -> dict[str, tuple[bool, list[str]]]:
    """Whether stages run, and why."""
    dry = () if command == "status" else ("--dry-run",)
    ended = poro(command, "tiny.yaml", *HERE, *dry, "--json", *arguments)
    assert ended.code == ExitCode.OK, ended.err
    return {step["stage"]: (step["runs"], step["reasons"]) for step in json.loads(ended.out)["steps"]}


def test_value_is_part_of_the_content_key_and_is_recorded(folder: Path, poro: Poro) -> None:
    changed = ("--set", "refine.factor=1")
    assert plan(poro, "mirror", *changed)["refine"] == (True, ["settings changed: refine.factor 2 → 1"])
    assert poro("refine", "tiny.yaml", *HERE, *changed).code == ExitCode.OK
    header = artifact.read_header(folder / "tiny/details/tiny.refined.h5")
    assert (header.replaced, header.case_resolved["refine"]["factor"]) == ({"refine.factor": 2}, 1)
    # With the same value there is nothing to do, for `status` neither without it; the file's own value is due again.
    assert not plan(poro, "refine", *changed)["refine"][0]
    assert not plan(poro, "status")["refine"][0]
    assert "refine.factor 1 → 2" in plan(poro, "refine")["refine"][1][0]
    said = poro("status", "tiny.yaml", *HERE).out
    assert "tiny.refined.h5 (made with refine.factor 1)" in said


def test_keys_nested_deeper_and_lists_are_set_too(folder: Path, poro: Poro) -> None:
    law = [f"--set=material.law.{each}" for each in ("name=yeoh", "c2=0.1", "c3=0.2")]
    assert "material.law.c2 unset → 0.1" in plan(poro, "run", *law)["optimize"][1][0]
    (folder / "tiny.yaml").write_text(TINY + "simulate: {max_load: 0.3, states: [0.2]}\n")
    assert poro("simulate", "tiny.yaml", *HERE, "--set", "simulate.states=[0.1, 0.2]", "--threads", 1).code == 0
    header = artifact.read_header(folder / "tiny/details/tiny.simulation.h5")
    assert header.case_resolved["simulate"]["states"] == [0.1, 0.2]
    assert not plan(poro, "status")["simulate"][0]


def test_a_part_made_with_a_set_scale_is_called_as_one_made_with_the_option(folder: Path, poro: Poro) -> None:
    by_option, by_key = (
        poro("export", "tiny.yaml", *HERE, "--dry-run", *arguments).out
        for arguments in (("--scale", 2), ("--set", "export.scale=2"))
    )
    assert by_key == by_option
    assert "tiny.scale-2.stl.h5" in by_key


def test_another_name_is_another_case(folder: Path, poro: Poro) -> None:
    assert "tiny2.h5" in poro("run", "tiny.yaml", *HERE, "--dry-run", "--set", "name=tiny2").out


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (["optimizer.max_updates=-3"], "--set: optimizer.max_updates: must be at least 0, not -3; change the value."),
        (
            ["optimizer.max_update=3"],
            "--set: optimizer.max_update: unknown key; write 'max_updates' if",
        ),
        (["max_updates=3"], "--set: max_updates: unknown key here; it belongs below 'optimizer:'."),
        (["domain.length=5O"], "--set: domain.length: must be "),
        (["domain.length="], "--set: domain.length: must be a number, not nothing; write a number"),
        (["simulate.states=[1"], "--set: simulate.states: not valid YAML ("),
        (["domain={layers: 3}"], "--set: domain: is a section; set its keys one by one, domain.KEY=VALUE."),
        (["domain.layers"], "--set: must be key=value, such as --set optimizer.max_updates=10, not 'domain.layers'"),
        (["domain.layers=3", "domain.layers=4"], "--set: domain.layers: is there twice; remove one of them."),
        (["name=a/b"], "--set: name: 'a/b' may only have letters, digits and . _ -; write another name."),
    ],
)
def test_mistakes_are_told_as_those_of_a_case_file(settings: list[str], said: str, poro: Poro) -> None:
    Path("tiny.yaml").write_text(TINY)
    for command in ("run", "optimize", "status"):
        ended = poro(command, "tiny.yaml", *(word for setting in settings for word in ("--set", setting)))
        assert ended.code == ExitCode.USAGE
        assert ended.err.startswith(f"poro: {said}")
    assert [path.name for path in Path().iterdir()] == ["tiny.yaml"]


def test_an_option_that_says_the_same_is_refused(poro: Poro) -> None:
    Path("tiny.yaml").write_text(TINY)
    ended = poro("run", "tiny.yaml", "--updates", 3, "--set", "optimizer.max_updates=4")
    assert ended.code == ExitCode.USAGE
    assert "--set: optimizer.max_updates: --updates says it too" in ended.err


def test_a_new_case_takes_values(poro: Poro) -> None:
    settings = ("--set", "optimizer.max_updates=7", "--set", "load.pressure_ratio=0.03")
    assert poro("new", "mine", "--like", "quick", *settings).code == ExitCode.OK
    made = yaml.safe_load(Path("mine.yaml").read_text(encoding="utf-8"))
    assert (made["optimizer"]["max_updates"], made["load"]["pressure_ratio"]) == (7, 0.03)
    assert poro("new", "other", "--set", "optimizer.max_updates=-7").code == ExitCode.USAGE
    assert not Path("other.yaml").exists()
