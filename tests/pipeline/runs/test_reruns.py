"""Which stages run again, and the reason given; all on the real chain with the tiny case."""

from __future__ import annotations

import importlib
import itertools
import json
import os
import time
from datetime import datetime, tzinfo
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import trimesh
from command_line import TINY, TO_PART, Poro, edited

from pipeline.exit_codes import ExitCode
from pipeline.store import artifact
from stages import refine
from stages.chain import PART, path_to

#: The stages to the part, in order.
STAGES = path_to(PART)

# What is drawn is looked at in test_pictures, and the finished case has its own picture.
pytestmark = pytest.mark.usefixtures("undrawn")


def _plan(poro: Poro, *options: object) -> dict[str, list[str]]:
    """Reasons of every stage, none if it is up to date."""
    ended = poro("run", "tiny.yaml", *TO_PART, "--output", ".", "--dry-run", "--json", *options)
    assert ended.code == ExitCode.OK, ended.err
    return {step["stage"]: step["reasons"] for step in json.loads(ended.out)["steps"]}


def _runs(poro: Poro, *options: object) -> list[str]:
    return [stage for stage, reasons in _plan(poro, *options).items() if reasons]


def _summary(poro: Poro, *arguments: object) -> dict[str, Any]:
    ended = poro(*arguments, "--json")
    assert ended.code == ExitCode.OK, ended.err
    summary: dict[str, Any] = json.loads(ended.out)
    return summary


def _identities(folder: Path) -> dict[str, str]:
    """Which run made each artifact."""
    found = {}
    for path in folder.rglob("tiny*.h5"):
        with h5py.File(path) as file:
            found[path.name] = file.attrs["identity"]
    return found


def test_finished_case_is_up_to_date_and_nothing_runs(folder: Path, poro: Poro) -> None:
    before = _identities(folder)
    assert _runs(poro) == []
    ended = poro("run", "tiny.yaml", *TO_PART, "--output", ".")
    assert ended.code == ExitCode.OK
    assert _identities(folder) == before
    assert ended.err.count("up to date") == len(STAGES)


@pytest.mark.parametrize(
    ("text", "first", "reason"),
    [
        ("export: {scale: 1.5}", "export", "settings changed: export.scale 1.0 → 1.5"),
        ("mirror: {threshold: 0.25}", "mirror", "settings changed: mirror.threshold 0.0 → 0.25"),
        ("refine: {factor: 1}", "refine", "settings changed: refine.factor 2 → 1"),
        ("load: {arm_ratio: 5.0}", "optimize", "settings changed: load.arm_ratio 4.0 → 5.0"),
    ],
)
def test_changed_setting_runs_its_stage_and_the_later_ones(
    text: str, first: str, reason: str, folder: Path, poro: Poro
) -> None:
    (folder / "tiny.yaml").write_text(TINY + text + "\n")
    plan = _plan(poro)
    at = STAGES.index(first)
    assert [bool(plan[stage]) for stage in STAGES] == [False] * at + [True] * (len(STAGES) - at)
    assert plan[first] == [reason]
    assert all("upstream changed" in plan[stage][0] for stage in STAGES[at + 1 :])


def test_threads_solver_name_and_comments_are_no_reason(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text("# a remark\n" + TINY + "compute: {threads: 3, linear_solver: superlu}\n")
    assert _runs(poro) == []
    assert _runs(poro, "--threads", 2) == []


def test_other_stage_version_is_a_reason(folder: Path, poro: Poro) -> None:
    with edited(folder / "tiny/details/tiny.refined.h5") as file:
        file.attrs["stage_version"] -= 1
    assert _plan(poro)["refine"] == [f"stage version {refine.VERSION - 1} → {refine.VERSION}"]
    assert _runs(poro) == ["refine", "finish", "mirror", "export"]


@pytest.mark.parametrize("stage", STAGES)
def test_bump_of_a_stages_version_runs_it_and_the_later_ones(
    stage: str, folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = importlib.import_module(f"stages.{stage}")
    version = module.VERSION
    monkeypatch.setattr(module, "VERSION", version + 1)
    assert _plan(poro)[stage] == [f"stage version {version} → {version + 1}"]
    assert _runs(poro) == list(STAGES[STAGES.index(stage) :])


def test_setting_that_an_older_version_did_not_have_is_a_reason(folder: Path, poro: Poro) -> None:
    with edited(folder / "tiny/details/tiny.solid.h5") as file:
        resolved = json.loads(file["case_resolved"][()])
        del resolved["mirror"]["threshold"]
        del file["case_resolved"]
        file["case_resolved"] = json.dumps(resolved)
    assert _plan(poro)["mirror"] == ["settings changed: mirror.threshold unset → 0.0"]


def test_key_that_does_not_belong_to_the_settings_is_a_reason(folder: Path, poro: Poro) -> None:
    with edited(folder / "tiny/details/tiny.refined.h5") as file:
        file.attrs["content_key"] = "0" * 64
    assert _plan(poro)["refine"] == ["content key differs"]


def test_changed_scale_exports_again_and_optimises_nothing(folder: Path, poro: Poro) -> None:
    before = _identities(folder)
    (folder / "tiny.yaml").write_text(TINY + "export: {scale: 1.25}\n")
    ended = poro("run", "tiny.yaml", *TO_PART, "--output", ".")
    assert ended.code == ExitCode.OK, ended.err
    after = _identities(folder)
    assert [name for name in before if before[name] != after[name]] == ["tiny.stl.h5"]
    assert trimesh.load_mesh(folder / "tiny/tiny.stl").extents[0] == pytest.approx(1.25 * 15.0, rel=1e-3)


def test_clock_and_file_times_are_no_reason(folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock goes back by decades before and during a run; files are of any age."""
    for age, path in enumerate(sorted(folder.rglob("*"))):
        os.utime(path, (0.0, 0.0) if age % 2 else (4e9, 4e9))
    assert _runs(poro) == []
    backwards = itertools.count(0.0, -3600.0)
    monkeypatch.setattr(time, "time", lambda: next(backwards) + 1e6)
    monkeypatch.setattr(artifact, "datetime", _Past)
    assert _runs(poro) == []
    (folder / "tiny/details/tiny.solid.h5").unlink()
    assert poro("run", "tiny.yaml", *TO_PART, "--output", ".").code == ExitCode.OK
    assert artifact.read_header(folder / "tiny/details/tiny.solid.h5").date.startswith("1971")
    assert _runs(poro) == []
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    assert _runs(poro) == []


class _Past(datetime):
    """A clock that someone has set back."""

    @classmethod
    def now(cls, tz: tzinfo | None = None) -> _Past:
        return cls(1971, 1, 1, tzinfo=tz)


def test_missing_artifact_is_a_reason(folder: Path, poro: Poro) -> None:
    (folder / "tiny/details/tiny.solid.h5").unlink()
    assert _plan(poro)["mirror"] == ["missing"]
    assert _runs(poro) == ["mirror", "export"]


def test_missing_or_changed_part_is_a_reason(folder: Path, poro: Poro) -> None:
    part = folder / "tiny/tiny.stl"
    content = part.read_bytes()
    part.write_bytes(content[:-50] + bytes(50))
    assert _plan(poro)["export"] == ["tiny.stl was changed after it was written"]
    part.unlink()
    assert _plan(poro)["export"] == ["missing: tiny.stl"]
    assert poro("export", "tiny.yaml", "--output", ".").code == ExitCode.OK
    assert part.read_bytes() == content


def test_force_runs_what_is_asked_for(folder: Path, poro: Poro) -> None:
    assert _plan(poro, "--force") == {stage: ["forced"] for stage in STAGES}
    assert _runs(poro, "--force", "--from", "mirror") == ["mirror", "export"]
    assert _runs(poro, "--force", "--until", "refine") == ["optimize", "refine"]
    before = _identities(folder)
    assert poro("refine", "tiny.yaml", "--output", ".", "--force").code == ExitCode.OK
    after = _identities(folder)
    assert [name for name in before if before[name] != after[name]] == ["tiny.refined.h5"]
    assert "upstream changed: tiny.refined.h5 is another one" in _plan(poro)["finish"]


def test_from_demands_earlier_stages_that_are_up_to_date(folder: Path, poro: Poro) -> None:
    (folder / "tiny/details/tiny.refined.h5").unlink()
    ended = poro("run", "tiny.yaml", *TO_PART, "--output", ".", "--from", "mirror")
    assert ended.code == ExitCode.ARTIFACT
    assert "'refine' is not up to date (missing)" in ended.err
    assert poro("run", "tiny.yaml", "--from", "export", "--until", "refine").code == ExitCode.USAGE


def test_status_gives_stages_and_reasons(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text(TINY + "export: {scale: 1.5}\n")
    lines = poro("status", "tiny.yaml", "--output", ".").out.splitlines()
    assert [line.split()[0] for line in lines] == [*STAGES, "inflate"]
    assert all("up to date" in line for line in lines[:4])
    assert "export.scale 1.0 → 1.5" in lines[4]


def test_explanation_comes_before_the_run_and_off_the_json(folder: Path, poro: Poro) -> None:
    (folder / "tiny/tiny.stl").unlink()
    ended = poro("run", "tiny.yaml", *TO_PART, "--output", ".", "--explain", "--json")
    assert json.loads(ended.out)["export"]["watertight"]
    assert "export    run         missing: tiny.stl" in ended.err


def test_artifact_is_self_contained(folder: Path, poro: Poro) -> None:
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    (folder / "tiny/tiny.h5").rename(elsewhere / "tiny.h5")
    summary = _summary(poro, "export", elsewhere / "tiny.h5")
    assert summary["files"][-2:] == [str(elsewhere / "tiny.stl"), str(elsewhere / "tiny.png")]
    assert (elsewhere / "tiny.stl").read_bytes() == (folder / "tiny/tiny.stl").read_bytes()
    assert poro("optimize", elsewhere / "tiny.h5").code == ExitCode.USAGE


def test_scale_of_the_command_line_makes_a_second_part(folder: Path, poro: Poro) -> None:
    before = (folder / "tiny/tiny.stl").read_bytes()
    summary = _summary(poro, "export", "tiny.h5", "--scale", 1.5)
    assert set(_identities(folder)) >= {"tiny.stl.h5", "tiny.scale-1.5.stl.h5"}
    assert (folder / "tiny/tiny.stl").read_bytes() == before
    part = trimesh.load_mesh(folder / "tiny/tiny.scale-1.5.stl")
    assert part.is_watertight
    assert part.extents[0] == pytest.approx(22.5, rel=1e-3)
    assert summary["export"]["volume"] == pytest.approx(part.volume)
    assert _runs(poro) == []


def test_scale_of_the_command_line_is_not_recorded_as_the_cases(folder: Path, poro: Poro) -> None:
    for path in folder.rglob("tiny.*h5"):
        path.unlink()
    _summary(poro, "export", "tiny.yaml", "--output", ".", "--scale", 1.5)
    assert _summary(poro, "export", "tiny.h5")["export"]["file"] == "tiny.stl"


def test_3mf_holds_the_same_part(folder: Path, poro: Poro) -> None:
    summary = _summary(poro, "export", "tiny.h5", "--format", "3mf")
    stl, mf = trimesh.load_mesh(folder / "tiny/tiny.stl"), trimesh.load_mesh(folder / "tiny/tiny.3mf")
    assert summary["export"]["file"] == "tiny.3mf"
    np.testing.assert_allclose(mf.extents, stl.extents, rtol=1e-5)
    assert mf.volume == pytest.approx(stl.volume, rel=1e-4)


def test_unreadable_artifact_in_the_way_is_not_overwritten(folder: Path, poro: Poro) -> None:
    (folder / "tiny/details/tiny.refined.h5").write_text("my notes")
    ended = poro("run", "tiny.yaml", *TO_PART, "--output", ".")
    assert ended.code == ExitCode.ARTIFACT
    assert (folder / "tiny/details/tiny.refined.h5").read_text() == "my notes"
    (folder / "tiny/details/tiny.refined.h5").write_bytes((folder / "tiny/details/tiny.solid.h5").read_bytes())
    assert "result of 'mirror', not of 'refine'" in poro("run", "tiny.yaml", *TO_PART, "--output", ".").err


def test_results_go_to_outputs_if_there_is_such_a_folder(folder: Path, poro: Poro) -> None:
    ended = poro("run", "tiny.yaml", "--dry-run")
    assert "tiny.h5" in ended.out
    assert "outputs" not in ended.out
    (folder / "outputs").mkdir()
    assert str(Path("outputs") / "tiny/tiny.h5") in poro("run", "tiny.yaml", "--dry-run").out
    assert list((folder / "outputs").iterdir()) == []
