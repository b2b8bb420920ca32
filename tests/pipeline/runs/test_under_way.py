"""What is shown of an optimisation that runs or was interrupted: its checkpoint, labelled as unfinished."""

from __future__ import annotations

import json
import os
import platform
from pathlib import Path

import meshio
import numpy as np
import pytest
from command_line import TINY, Poro
from PIL import Image

from pipeline.exit_codes import ExitCode
from pipeline.results.design import read_design
from pipeline.runs.claim import claimed
from pipeline.runs.job import open_job
from pipeline.store import artifact, contents
from pipeline.store.artifact import Header
from stages.datasets import Dataset

HERE = ("--output", ".")
LABEL = "after 1 update, unfinished"


def interrupted(folder: Path, case: str = TINY.replace("max_updates: 1", "max_updates: 9")) -> Path:
    """Turn the finished case of a folder into one that was interrupted after its update; returns the checkpoint."""
    (folder / "tiny.yaml").write_text(case)
    files = open_job(folder / "tiny.yaml", folder).files
    finished = artifact.read_header(files.artifact("optimize"))
    state = contents.checkpoint(files.artifact("optimize"), "optimize")
    resolved = finished.case_resolved | {"optimizer": finished.case_resolved["optimizer"] | {"max_updates": 9}}
    header = Header("checkpoint", finished.stage_version, "key", "", (), "", case, resolved)
    datasets = {f"checkpoint/{name}": Dataset(value, "", "") for name, value in state.items()}
    artifact.write(files.checkpoint, header, datasets | {"progress/updates": Dataset(1, "1", "")})
    return files.checkpoint


def test_state_of_a_checkpoint_is_that_of_the_finished_design(folder: Path) -> None:
    finished, reached = read_design(folder / "tiny/tiny.h5"), read_design(interrupted(folder))
    for name in ("chi", "displacement", "pressure", "arm"):
        np.testing.assert_array_equal(getattr(reached, name), getattr(finished, name), err_msg=name)
    assert (reached.label, finished.label) == (LABEL, "")
    only_at_the_end = {"C_p_second_order", "wall_leak_second_order", "passive_share", "negative_eigenvalues"}
    assert finished.summary.keys() - reached.summary.keys() - only_at_the_end == {"stage_seconds", "peak_memory"}
    for name in ("C", "terms", "theta2", "spring_elongation", "wall_leak", "energy_ratio", "evaluations", "work"):
        assert reached.summary[name] == pytest.approx(finished.summary[name], rel=1e-12), name


@pytest.mark.usefixtures("quickly")
@pytest.mark.parametrize("argument", ["tiny.yaml", "tiny.h5", "checkpoint"])
def test_plot_report_and_convert_take_a_checkpoint_and_say_so(argument: str, folder: Path, poro: Poro) -> None:
    left = interrupted(folder)
    domain, chi = contents.design(folder / "tiny/tiny.h5", "optimize")
    (folder / "tiny/tiny.h5").unlink()
    source = str(left) if argument == "checkpoint" else argument
    for command in (["plot", source, *HERE, "--only", "history"], ["report", source, *HERE]):
        ended = poro(*command)
        assert ended.code == ExitCode.OK, ended.err
        assert LABEL in ended.out.splitlines()
        assert json.loads(poro(*command, "--json").out)["unfinished"] == LABEL
    (page,) = folder.rglob("*.report.html")
    assert f"<small>{LABEL}</small>" in page.read_text(encoding="utf-8")
    assert poro("convert", source, "x.vtu").out == f"x.vtu: {LABEL}\n"
    found = meshio.read("x.vtu")
    assert len(found.points) == len(domain.nodes)
    np.testing.assert_array_equal(found.point_data["chi"][: len(chi)], chi)


def test_figures_of_an_unfinished_design_are_labelled(folder: Path, poro: Poro) -> None:
    left = interrupted(folder)

    def red(source: Path) -> int:
        (drawn,) = json.loads(poro("plot", source, *HERE, "--only", "section", "--json").out)["files"]
        with Image.open(drawn) as picture:
            pixels = np.asarray(picture.convert("RGB")).astype(int)
        return int(((pixels[..., 0] > 150) & (pixels[..., 1:].max(axis=2) < 60)).sum())

    assert red(folder / "tiny/tiny.h5") < 20 < 100 < red(left)


@pytest.mark.usefixtures("quickly")
def test_farthest_state_of_the_same_case_is_shown(folder: Path, poro: Poro) -> None:
    left = interrupted(folder)
    plot = ("plot", "tiny.yaml", *HERE, "--only", "history", "--json")
    assert json.loads(poro(*plot).out)["unfinished"] == ""  # as far as the finished design, which is whole
    (folder / "tiny.yaml").write_text(TINY + "load: {pressure_ratio: 0.01}\n")
    assert json.loads(poro(*plot).out)["unfinished"] == ""  # both are of another case
    left.write_bytes(b"no artifact")
    assert json.loads(poro(*plot).out)["unfinished"] == ""
    (folder / "tiny/tiny.h5").unlink()
    ended = poro(*plot)
    assert ended.code == ExitCode.ARTIFACT
    left.unlink()
    ended = poro(*plot)
    assert "run the stage that makes it, `poro optimize`, or say with --output where it lies" in ended.err


def test_status_says_how_far_it_is_and_who_is_at_it(folder: Path, poro: Poro) -> None:
    left = interrupted(folder)
    (folder / "tiny/tiny.h5").unlink()
    rows = [line.split(maxsplit=2) for line in poro("status", "tiny.yaml", *HERE).out.splitlines()]
    (state,) = [row for row in rows if row[0] == "now"]
    assert state[1:] == ["interrupted", "run the same command again to continue"]
    (reached,) = [row for row in rows if row[0] == "reached"]
    assert reached[2].startswith("after 1 update of at most 9, the last at 20")
    assert " each, at most " in reached[2]
    found = json.loads(poro("status", "tiny.yaml", *HERE, "--json").out)["under_way"]
    assert (found["state"], found["process"], found["updates"], found["max_updates"]) == ("interrupted", None, 1, 9)
    seconds = artifact.read_group(left, "checkpoint", "checkpoint")["history.seconds"]
    assert found["seconds_per_update"] == pytest.approx(seconds[1] - seconds[0])
    assert found["seconds_left_at_most"] == pytest.approx(8 * found["seconds_per_update"])
    assert found["last_update"] == artifact.read_header(left).date
    with claimed(open_job(Path("tiny.yaml"), Path()).files):
        said = poro("status", left, *HERE).out
        assert f"now       running     process {os.getpid()} on {platform.node()} since 20" in said
        found = json.loads(poro("status", "tiny.yaml", *HERE, "--json").out)["under_way"]
    assert (found["state"], found["process"]["pid"]) == ("running", os.getpid())


def test_status_of_a_finished_case_has_nothing_to_add(folder: Path, poro: Poro) -> None:
    assert json.loads(poro("status", "tiny.yaml", *HERE, "--json").out)["under_way"] is None
    assert "now" not in poro("status", "tiny.yaml", *HERE).out
