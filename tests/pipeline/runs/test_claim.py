"""Two processes on one case: the second is refused with a sentence, and a dead one is in nobody's way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command_line import POSIX_SIGNALS, PROGRAM, Poro, edited, environment

from pipeline.exit_codes import ExitCode
from pipeline.runs.claim import claimed
from pipeline.store.files import Files

TOP, DETAILS = ("tiny.h5", "tiny.stl"), ("tiny.refined.h5", "tiny.solid.h5", "tiny.stl.h5")
FILES = (*(f"tiny/{name}" for name in TOP), *(f"tiny/details/{name}" for name in DETAILS))

#: Holds the case as a run does, until it is killed.
HOLDER = """
import time
from pathlib import Path
from pipeline.runs.claim import claimed
from pipeline.store.files import Files
with claimed(Files(Path("tiny"), "tiny", "tiny.stl")):
    print("held", flush=True)
    time.sleep(600.0)
"""


@contextmanager
def held(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process works on the case in a folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER], cwd=folder, env=environment(), stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout
        assert process.stdout.readline() == "held\n"
        yield process
    finally:
        process.kill()
        process.communicate()


def test_second_process_is_refused_and_told_who_holds_the_case(folder: Path, poro: Poro) -> None:
    before = {name: (folder / name).read_bytes() for name in (*FILES, "tiny/details/tiny.log")}
    with held(folder) as process:
        for command in (["run", "tiny.yaml"], ["refine", "tiny.yaml", "--force"], ["optimize", "tiny.yaml", "--fresh"]):
            ended = poro(*command, "--output", ".")
            assert ended.code == ExitCode.BUSY
            assert ended.out == ""
            assert ended.err.count("\n") == 1
            assert f"process {process.pid} on " in ended.err
            assert "wait until it has ended, or choose another --output" in ended.err
    assert {name: (folder / name).read_bytes() for name in before} == before


def test_reading_needs_no_claim(folder: Path, poro: Poro) -> None:
    with held(folder):
        assert poro("status", "tiny.yaml", "--output", ".").out.count("up to date") == 5
        assert poro("run", "tiny.yaml", "--output", ".", "--dry-run").code == ExitCode.OK
        assert poro("convert", "tiny.h5", "x.vtu").code == ExitCode.OK


def test_same_case_elsewhere_and_another_case_here_are_free(folder: Path) -> None:
    (folder / "elsewhere/details").mkdir(parents=True)
    with (
        held(folder),
        claimed(Files(folder / "elsewhere", "tiny", "tiny.stl")),
        claimed(Files(folder / "tiny", "tiny.b", "tiny.b.stl")),
    ):
        pass


@POSIX_SIGNALS
def test_claim_of_a_killed_process_is_free_and_what_it_left_is_cleared_away(folder: Path, poro: Poro) -> None:
    own = [".tiny.h5.0123abcd.tmp", ".tiny.scale-1.5.stl.0123abcd.tmp", ".tiny.checkpoint.h5.ffffffff.tmp"]
    others = [".tiny.b.h5.0123abcd.tmp", ".tiny.history.png.0123abcd.tmp", ".tiny.h5.tmp", "tiny.h5.0123abcd.tmp"]
    with held(folder) as process:
        for name in own + others:
            (folder / "tiny" / ("details" if ".checkpoint." in name else "") / name).touch()
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert poro("refine", "tiny.yaml", "--output", ".").code == ExitCode.OK
    found = {path.name for path in folder.rglob("*")}
    assert not found & set(own)
    assert found >= set(others)


def test_processes_at_the_same_moment_leave_a_whole_case(folder: Path, poro: Poro) -> None:
    command = [*PROGRAM, "mirror", "tiny.yaml", "--output", ".", "--force"]
    running = [
        subprocess.Popen(command, cwd=folder, env=environment(), stderr=subprocess.PIPE, text=True) for _ in range(3)
    ]
    ended = [(process.communicate()[1], process.returncode) for process in running]
    assert {code for _, code in ended} <= {ExitCode.OK, ExitCode.BUSY}
    assert ExitCode.OK in {code for _, code in ended}
    assert all("working on the case" in said or "replaced" in said for said, code in ended if code == ExitCode.BUSY)
    status = poro("status", "tiny.yaml", "--output", ".")
    assert status.out.count("up to date") == 4
    assert "export    run         upstream changed" in status.out
    assert not [path for path in folder.rglob("*") if path.suffix == ".tmp"]


def test_plan_that_another_process_overtakes_is_refused(
    folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between the plan and the claim, another process replaces what the plan rests on."""
    make = os.mkdir

    def overtaken(path: Path, mode: int = 0o777) -> None:
        with edited(folder / "tiny/tiny.h5") as file:
            file.attrs["identity"] = "another"
        make(path, mode)

    monkeypatch.setattr(os, "mkdir", overtaken)
    ended = poro("refine", "tiny.yaml", "--output", ".", "--force")
    assert ended.code == ExitCode.BUSY
    assert "tiny.h5: was replaced by another process" in ended.err
