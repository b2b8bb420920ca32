"""``poro clean``: what it calls superfluous, what it removes, and what stays."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from command_line import Poro

from pipeline.exit_codes import ExitCode
from pipeline.runs import cleaning
from pipeline.runs.claim import claimed
from pipeline.store.files import Files

HERE = ("--output", ".")


@pytest.fixture
def left(folder: Path) -> set[str]:
    """Names of what a finished case has left on its way, beside a part of another scale and another case."""
    files = Files(folder / "tiny", "tiny", "tiny.stl")
    files.checkpoint.write_bytes(b"of an interrupted run")
    files.updates.mkdir()
    (files.updates / "000001.h5").write_bytes(100 * b"x")
    cut_short = folder / "tiny/.tiny.h5.01234567.tmp"
    for path in (cut_short, folder / "tiny/tiny.scale-2.stl", folder / "tiny/details/tiny2.refined.h5"):
        path.write_bytes(b"x")
    intermediate = [files.artifact(stage) for stage in ("refine", "finish", "mirror")]
    sidecars = [path.with_suffix(".vtkhdf") for path in intermediate]
    return {path.name for path in (*intermediate, *sidecars, files.checkpoint, files.updates, cut_short)}


def names(folder: Path) -> set[str]:
    """Of what is in a folder, but for the file that is locked."""
    return {path.name for path in folder.rglob("*")} - {".tiny.lock"}


@pytest.mark.parametrize("argument", ["tiny", "tiny.yaml", "tiny.h5"])
def test_says_what_it_would_remove_and_removes_nothing(argument: str, folder: Path, left: set[str], poro: Poro) -> None:
    before = names(folder)
    ended = poro("clean", argument, *HERE)
    assert ended.code == ExitCode.OK, ended.err
    *lines, last = ended.out.splitlines()
    assert {Path(line.split()[-1 - 2 * (line.split()[-1] in ("kB", "bytes"))]).name for line in lines[:2]} <= left
    assert all(any(name in line for line in lines) for name in left)
    assert "100 bytes" in next(line for line in lines if "tiny.updates" in line)
    assert last.startswith(f"{len(left)} entries, ")
    assert last.endswith("would be removed; add --yes to do so.")
    assert names(folder) == before


def test_removes_what_is_left_and_keeps_design_and_parts(folder: Path, left: set[str], poro: Poro) -> None:
    before = names(folder)
    found = json.loads(poro("clean", "tiny", *HERE, "--json").out)["found"]
    assert {Path(entry["path"]).name for entry in found} == left
    ended = poro("clean", "tiny", *HERE, "--yes")
    assert ended.out.splitlines()[-1].startswith(f"Removed {len(left)} entries, ")
    assert names(folder) == before - left - {"000001.h5"}
    assert {"tiny.h5", "tiny.stl", "tiny.stl.h5", "tiny.png", "tiny.scale-2.stl", "tiny.log"} <= names(folder)
    assert poro("clean", "tiny", *HERE).out == "Nothing to remove.\n"


def test_all_removes_the_case_and_no_other(finished: Path, folder: Path, left: set[str], poro: Poro) -> None:
    assert poro("clean", "tiny", *HERE, "--all", "--yes").code == ExitCode.OK
    assert names(folder) == {"tiny.yaml", "tiny", "details", "tiny2.refined.h5"}
    (folder / "tiny/details/tiny2.refined.h5").unlink()
    (folder / "tiny/tiny.h5").write_bytes((finished / "tiny/tiny.h5").read_bytes())
    assert poro("clean", "tiny", *HERE, "--all", "--yes").code == ExitCode.OK
    assert names(folder) == {"tiny.yaml"}


def test_a_case_that_another_process_works_on_is_left_alone(folder: Path, left: set[str], poro: Poro) -> None:
    with claimed(Files(folder / "tiny", "tiny", "")):
        ended = poro("clean", "tiny", *HERE, "--yes")
    assert ended.code == ExitCode.BUSY
    assert "tiny.refined.h5" in names(folder)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "Name a case to clean, or give --kernels."),
        (("nosuch", *HERE), "nosuch: no case of this name left anything in nosuch; see --output."),
        (("a/b", *HERE), "name: 'a/b' may only have letters"),
        (("tiny.stl",), "tiny/tiny.stl: this is a part, which stays"),
    ],
)
def test_what_is_no_case_is_refused(arguments: tuple[str, ...], said: str, folder: Path, poro: Poro) -> None:
    ended = poro("clean", *arguments)
    assert ended.code == ExitCode.USAGE
    assert ended.err.startswith(f"poro: {said}")


def test_kernels_are_removed_unless_the_user_chose_their_folder(
    tmp_path: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("kernels-0", "kernels-1", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "kernel.nbc").write_bytes(2000 * b"x")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "other"))
    ended = poro("clean", "--kernels", "--yes")
    assert ended.out == "Nothing to remove.\n"
    assert "NUMBA_CACHE_DIR" in ended.err
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels-1"))
    ended = poro("clean", "--kernels")
    assert "2 entries, 4 kB would be removed" in ended.out
    assert poro("clean", "--kernels", "--yes").out.endswith("Removed 2 entries, 4 kB.\n")
    assert [path.name for path in tmp_path.iterdir()] == ["other"]
    assert cleaning.of_kernels() == []
