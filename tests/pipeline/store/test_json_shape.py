"""``--json``: every command that prints results has it, and all print one object of the same shape."""

from __future__ import annotations

import json
import shutil
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
from command_line import TO_PART, Poro
from synthetic import EXAMPLE

from pipeline.cli.app import program
from pipeline.exit_codes import ExitCode

#: Commands that compute nothing and whose output is a format of its own.
OTHERS = {"schema"}
STUDY = "case: tiny.yaml\nvary: {mirror.threshold: [0.0]}\n"
RUBBER = "stretch,stress [MPa]\n1.0,0.0\n1.1,0.11\n1.2,0.2\n1.4,0.35\n1.6,0.48\n"
#: How every command is called in a folder where the tiny case has run, and keys of its own.
CALLS: dict[str, tuple[list[str], set[str]]] = {
    "optimize": (["tiny.yaml", "--output", "."], {"name", "C", "terms", "updates"}),
    "refine": (["tiny.h5"], {"refine"}),
    "finish": (["tiny.h5"], {"finish"}),
    "mirror": (["tiny.h5"], {"mirror"}),
    "export": (["tiny.h5"], {"export"}),
    "run": (["tiny.yaml", *TO_PART, "--output", "."], {"name", "export", "stage_seconds"}),
    "status": (["tiny.yaml", "--output", "."], {"steps"}),
    "plot": (["tiny.h5"], {"name", "problems"}),
    "check": (["tiny.stl", "--pitch", "1.0"], {"passed", "findings"}),
    "slice": (["tiny.stl", "--layer", "1.0"], {"layers"}),
    "convert": (["tiny.h5", "tiny.vtu"], {"source"}),
    "new": (["mine"], set()),
    "fit": (["rubber.csv"], {"best", "fits"}),
    "compare": (["tiny.h5", "measured.csv", "--youngs", "1.0"], {"target", "hysteresis", "linearity"}),
    "simulate": (["tiny.h5", "--max-load", "0.2"], {"simulate"}),
    "inflate": (["tiny.stl", "--size", "4", "--max-load", "0.5"], {"name", "inflate"}),
    "report": (["tiny.h5", "--no-check"], {"name", "problems"}),
    "sweep": (["study.yaml", "--dry-run"], {"study", "cases"}),
    "film": (["tiny.h5", "--size", "300"], {"of", "frames"}),
    "clean": (["tiny", "--output", "."], {"removed", "found"}),
}


def commands() -> set[str]:
    """Names of all commands of the program."""
    return {command.name or command.callback.__name__ for command in program().registered_commands if command.callback}


def printed(poro: Poro, *arguments: str) -> dict[str, Any]:
    """The object that a command prints."""
    ended = poro(*arguments, "--json")
    assert ended.code in (ExitCode.OK, ExitCode.BAD_SOLID), ended.err
    found = json.loads(ended.out)
    assert isinstance(found, dict)
    return found


def test_every_command_is_looked_at() -> None:
    assert commands() == set(CALLS) | OTHERS


@pytest.mark.usefixtures("quickly")
@pytest.mark.parametrize("command", CALLS)
def test_command_prints_one_object_of_the_common_shape(command: str, poro: Poro, folder: Path) -> None:
    (folder / "study.yaml").write_text(STUDY)
    (folder / "rubber.csv").write_text(RUBBER)
    shutil.copy(EXAMPLE, folder / "measured.csv")
    arguments, own = CALLS[command]
    found = printed(poro, command, *arguments)
    assert next(iter(found)) == "command"
    assert found["command"] == command
    assert found["program_version"] == metadata.version("poro")
    assert list(found)[-1] == "files"
    assert all(Path(file).is_file() for file in found["files"])
    assert own <= set(found)
    if command not in ("status", "sweep", "clean"):
        assert found["files"]


def test_plans_and_single_layers_have_it_too(poro: Poro, folder: Path) -> None:
    plan = printed(poro, "run", "tiny.yaml", *TO_PART, "--output", ".", "--dry-run")
    assert plan["command"] == "run"
    assert [step["stage"] for step in plan["steps"]] == ["optimize", "refine", "finish", "mirror", "export"]
    assert [Path(file).name for file in plan["files"]] == [Path(step["path"]).name for step in plan["steps"]]
    layers = printed(poro, "slice", "tiny.stl", "--layer", "1.0", "--number", "2")
    assert [entry["file"] for entry in layers["slices"]] == layers["files"]
    report = printed(poro, "check", "tiny.stl", "--pitch", "1.0", "--no-save")
    assert report["files"] == []
