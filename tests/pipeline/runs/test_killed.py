"""kill -9 in every stage at random moments: the next run goes on, and ends where an undisturbed one does."""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from command_line import POSIX_SIGNALS, PROGRAM, TINY, TO_PART, environment

from pipeline.exit_codes import ExitCode
from pipeline.store.files import Files
from stages.chain import PART, path_to

CASE = TINY.replace("max_updates: 1", "max_updates: 3")
#: The stages to the part, in order.
STAGES = path_to(PART)
#: What each stage leaves, for it to be taken away so that the stage runs again.
MADE = {stage: Files(Path("tiny"), "tiny", "tiny.stl").artifact(stage) for stage in STAGES}


def run(folder: Path) -> subprocess.Popen[str]:
    command = [*PROGRAM, "run", "tiny.yaml", *TO_PART, "--output", ".", "--threads", "1"]
    return subprocess.Popen(
        command, cwd=folder, env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


def finish(folder: Path) -> str:
    """Run to the end; returns what was said."""
    process = run(folder)
    said = process.communicate(timeout=600)[1]
    assert process.returncode == ExitCode.OK, said
    return said


def kill_in(stage: str, after: float, folder: Path) -> str:
    """Run, and kill the process some seconds after a stage has begun; returns the stage it died in, if it did."""
    process = run(folder)
    assert process.stderr
    for line in process.stderr:
        if line.startswith(f"{stage}: "):
            break
    time.sleep(after)
    process.kill()
    for line in process.stderr:
        name = line.partition(":")[0]
        stage = name if name in STAGES else stage
    process.communicate()
    return stage if process.returncode < 0 else ""


def seconds(whole: Path, stage: str) -> float:
    """How long a stage took when nothing disturbed it."""
    with h5py.File(whole / MADE[stage]) as file:
        return float(json.loads(file["report/summary"][()])["stage_seconds"])


def datasets(path: Path) -> dict[str, Any]:
    """All of a file but times, memory and the solver's work, which a resumed run may have more of."""
    found: dict[str, Any] = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, entry: found.update({name: entry[()]} if isinstance(entry, h5py.Dataset) else {}))
    return {name: value for name, value in found.items() if not name.startswith(("history/", "checkpoint/", "report/"))}


def check_killed(whole: Path, folder: Path, kills: int, seed: int) -> dict[str, int]:
    """Kill a number of runs, each stage in turn, and compare what the last one leaves with an undisturbed run.

    Returns how often a run died in each stage.
    """
    (folder / "tiny.yaml").write_text(CASE)
    dice = random.Random(seed)
    hit = dict.fromkeys((*STAGES, ""), 0)
    for number in range(kills):
        # The stages in order: as each begins, the earlier ones are done, by this run or by the ones before.
        stage = STAGES[number * len(STAGES) // kills]
        (folder / MADE[stage]).unlink(missing_ok=True)
        hit[kill_in(stage, dice.uniform(0.0, seconds(whole, stage)), folder)] += 1
        for path in folder.rglob("tiny*.h5"):
            datasets(path)  # whole, or HDF5 would raise
    finish(folder)
    assert {path.name for path in folder.rglob("*")} == {path.name for path in whole.rglob("*")}
    for name in MADE.values():
        expected, found = datasets(whole / name), datasets(folder / name)
        assert found.keys() == expected.keys()
        for key, value in expected.items():
            np.testing.assert_array_equal(found[key], value, err_msg=f"{name}: {key}")
    assert (folder / "tiny/tiny.stl").read_bytes() == (whole / "tiny/tiny.stl").read_bytes()
    assert "up to date" in finish(folder)
    return hit


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the case has run undisturbed."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "tiny.yaml").write_text(CASE)
    finish(folder)
    return folder


pytestmark = POSIX_SIGNALS


def test_killed_runs_end_where_an_undisturbed_one_does(whole: Path, tmp_path: Path) -> None:
    hit = check_killed(whole, tmp_path, kills=3, seed=1)
    assert sum(hit[stage] for stage in STAGES) >= 2, hit


@pytest.mark.slow
def test_twenty_killed_runs_end_where_an_undisturbed_one_does(whole: Path, tmp_path: Path) -> None:
    hit = check_killed(whole, tmp_path, kills=20, seed=2)
    assert all(hit[stage] for stage in STAGES), hit


@pytest.mark.parametrize("killed_after", ["artifact", pytest.param("part", marks=pytest.mark.slow)])
def test_run_killed_between_two_files_of_a_stage_is_completed(killed_after: str, whole: Path, tmp_path: Path) -> None:
    shutil.copytree(whole, tmp_path, dirs_exist_ok=True)
    if killed_after == "artifact":  # before its sidecar
        (tmp_path / "tiny/tiny.vtkhdf").unlink()
    else:  # before the record beside it and the picture
        (tmp_path / "tiny/details/tiny.stl.h5").unlink()
        (tmp_path / "tiny/tiny.png").unlink()
    finish(tmp_path)
    assert {path.name for path in tmp_path.rglob("*")} == {path.name for path in whole.rglob("*")}
    assert (tmp_path / "tiny/tiny.vtkhdf").read_bytes() == (whole / "tiny/tiny.vtkhdf").read_bytes()
