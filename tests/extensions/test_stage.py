"""A stage of another program: one file and one row of the table, and everything else follows."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from command_line import TINY, Poro
from made_up_stage import WEIGH

from pipeline.exit_codes import ExitCode
from pipeline.store import artifact, contents
from stages.chain import STAGES

HERE = ("--output", ".")

#: Stages before it, of which none runs again.
BEFORE: dict[str, list[str]] = {"optimize": [], "refine": [], "finish": [], "mirror": []}


@pytest.fixture
def weigh() -> Iterator[None]:
    """The stage is registered."""
    with STAGES.registered("weigh", WEIGH):
        yield


def plan(poro: Poro, *options: object) -> dict[str, list[str]]:
    """Reasons of every stage of a dry run."""
    ended = poro("run", "tiny.yaml", *HERE, "--dry-run", "--json", *options)
    assert ended.code == ExitCode.OK, ended.err
    return {step["stage"]: step["reasons"] for step in json.loads(ended.out)["steps"]}


@pytest.mark.usefixtures("weigh")
def test_case_file_has_its_section_which_is_checked(poro: Poro) -> None:
    schema = json.loads(poro("schema").out)
    section = schema["$defs"][schema["properties"]["weigh"]["$ref"].rpartition("/")[2]]
    assert section["title"] == "Section weigh"
    assert section["properties"]["density"]["default"] == 1.1
    assert poro("new", "mine").code == ExitCode.OK
    assert yaml.safe_load(Path("mine.yaml").read_text())["weigh"] == {"density": 1.1}
    Path("wrong.yaml").write_text("weigh: {density: -1.0}\n")
    ended = poro("weigh", "wrong.yaml")
    assert ended.code == ExitCode.USAGE
    assert ended.err == "poro: wrong.yaml:1: weigh.density: must be greater than 0, not -1.0; change the value.\n"
    Path("wrong.yaml").write_text("name: tiny.weigh\n")
    assert "name: must not end in .weigh" in poro("weigh", "wrong.yaml").err


@pytest.mark.usefixtures("weigh")
def test_it_is_run_by_its_command_and_as_a_goal(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text(TINY + "weigh: {density: 1.5}\n")
    assert plan(poro, "--until", "weigh") == {
        "optimize": [],
        "refine": [],
        "finish": [],
        "mirror": [],
        "weigh": ["missing"],
    }
    explained = poro("run", "tiny.yaml", *HERE, "--until", "weigh", "--dry-run", "--explain").out
    assert explained.splitlines()[-1].split() == ["weigh", "run", "missing"]
    ended = poro("run", "tiny.yaml", *HERE, "--until", "weigh")
    assert ended.code == ExitCode.OK, ended.err
    volume = contents.summary(folder / "tiny/details/tiny.weigh.h5", "weigh")["volume"]
    assert volume == pytest.approx(contents.summary(folder / "tiny/details/tiny.stl.h5", "export")["volume"], rel=1e-3)
    assert f"  mass                {1.5e-3 * volume:.3f} g\n" in ended.out
    assert "tiny.weigh.h5" in ended.out
    (mass,) = artifact.read(folder / "tiny/details/tiny.weigh.h5", "weigh", "weight/mass")
    assert mass == pytest.approx(1.5e-3 * volume)
    found = json.loads(poro("weigh", "tiny.yaml", *HERE, "--density", 1.2, "--json").out)
    assert found["command"] == "weigh"
    assert found["weigh"]["mass"] == pytest.approx(1.2e-3 * volume)
    assert "Density of the cured resin" in poro("weigh", "--help").out
    assert poro("weigh", "tiny.yaml", "--density", 0).err.startswith("poro: --density: must be greater than 0")


@pytest.mark.usefixtures("weigh")
def test_it_runs_again_only_for_what_it_depends_on(folder: Path, poro: Poro) -> None:
    assert poro("weigh", "tiny.yaml", *HERE).code == ExitCode.OK
    assert plan(poro, "--until", "weigh")["weigh"] == []
    last = poro("status", "tiny.yaml", *HERE).out.splitlines()[-1]
    assert last.split() == ["weigh", "up", "to", "date", "tiny/details/tiny.weigh.h5"]
    (folder / "tiny.yaml").write_text(TINY + "export: {scale: 2.0}\nsimulate: {max_load: 1.1}\n")
    assert plan(poro, "--until", "weigh")["weigh"] == []
    (folder / "tiny.yaml").write_text(TINY + "weigh: {density: 1.5}\n")
    assert plan(poro, "--until", "weigh") == BEFORE | {"weigh": ["settings changed: weigh.density 1.1 → 1.5"]}
    assert plan(poro, "--from", "weigh")["weigh"] != []
    assert plan(poro) == {
        "optimize": [],
        "refine": [],
        "finish": [],
        "mirror": [],
        "export": [],
        "inflate": ["missing"],
    }
    (folder / "tiny.yaml").write_text(TINY + "mirror: {threshold: 0.1}\n")
    assert plan(poro, "--until", "weigh")["weigh"] == ["upstream changed: mirror runs again"]


def test_what_knows_it_not_can_still_be_used(folder: Path, poro: Poro) -> None:
    """Artifacts made beside it hold its section; a program without it leaves that out."""
    with STAGES.registered("weigh", WEIGH):
        assert poro("refine", "tiny.yaml", *HERE, "--force").code == ExitCode.OK
        assert poro("weigh", "tiny.yaml", *HERE).code == ExitCode.OK
    assert artifact.read_header(folder / "tiny/details/tiny.refined.h5").case_resolved["weigh"] == {"density": 1.1}
    assert poro("mirror", "tiny.refined.h5").code == ExitCode.OK
    assert "this is the result of 'weigh'; give the case file" in poro("status", "tiny.weigh.h5").err
    assert "weigh" not in poro("--help").out
