"""Disks that are full and folders that may not be written: a sentence, and what was there before stays whole."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import PROGRAM, TINY, TO_PART, Ended, Poro, environment

from pipeline.exit_codes import ExitCode
from pipeline.store import artifact

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="limits and mounts of POSIX")


def contents(folder: Path) -> dict[str, bytes]:
    """Every file but the log, to which a failing run may append, and the empty file that is locked."""
    left_out = (".log", ".lock")
    found = (path for path in folder.rglob("*") if path.is_file() and path.suffix not in left_out)
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def called(folder: Path, *arguments: str, output: str = ".") -> Ended:
    command = [*PROGRAM, *arguments, "--output", output]
    ended = subprocess.run(command, cwd=folder, env=environment(), capture_output=True, text=True, check=False)
    return Ended(ended.returncode, ended.stdout, ended.stderr)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of one MiB of its own; mounting one is for the superuser only."""
    mount = tmp_path / "small"
    mount.mkdir()
    if os.geteuid() or not shutil.which("mount"):
        pytest.skip("only the superuser may mount a file system")
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(mount)], capture_output=True, text=True, check=False
    )
    if mounted.returncode:
        pytest.skip(f"a file system could not be mounted: {mounted.stderr.strip()}")
    try:
        yield mount
    finally:
        subprocess.run(["umount", str(mount)], check=True)


def fill(disk: Path, left: int) -> None:
    """Leave so many bytes, a multiple of the 4 KiB of a page."""
    free = os.statvfs(disk)
    (disk / "full").write_bytes(bytes(max(free.f_bavail * free.f_frsize - left, 0)))


FORCED = ("optimize", "tiny.yaml", "--fresh", "--force", "--threads", "1")
LARGER = ("export", "tiny.yaml", "--scale", "1.5")


@pytest.mark.parametrize(
    ("left", "arguments"), [(0, FORCED), (8_192, ("refine", "tiny.yaml", "--force")), (8_192, LARGER)]
)
def test_full_disk_ends_in_a_sentence_and_spoils_nothing(
    left: int, arguments: tuple[str, ...], finished: Path, small_disk: Path
) -> None:
    shutil.copytree(finished, small_disk, dirs_exist_ok=True)
    fill(small_disk, left)
    before = contents(small_disk)
    ended = called(small_disk, *arguments)
    assert ended.code == ExitCode.UNEXPECTED, ended.err
    remedy = "make room or choose another folder, and run the same command to continue."
    assert ended.err.splitlines()[-1].endswith(remedy)
    assert "Traceback" not in ended.err
    assert contents(small_disk) == before


def test_disk_that_fills_during_an_optimisation_keeps_the_last_checkpoint(tmp_path: Path, small_disk: Path) -> None:
    (tmp_path / "tiny.yaml").write_text(TINY)
    # Room for a checkpoint, of some 35 kB, and a second one beside it while it is replaced, but not for the result.
    fill(small_disk, 98_304)
    command = ("optimize", "tiny.yaml", "--threads", "1")
    ended = called(tmp_path, *command, output=str(small_disk))
    assert ended.code == ExitCode.UNEXPECTED, ended.err
    assert "could not be written" in ended.err.splitlines()[-1]
    left = {path.name for path in (small_disk / "tiny/details").iterdir()} - {".tiny.lock"}
    assert left == {"tiny.log", "tiny.checkpoint.h5", "tiny.updates"}
    stored = int(artifact.read(small_disk / "tiny/details/tiny.checkpoint.h5", "checkpoint", "progress/updates")[0])
    (small_disk / "full").unlink()
    again = called(tmp_path, *command, output=str(small_disk))
    assert again.code == ExitCode.OK
    assert f"Continuing after design update {stored}." in again.err


@pytest.fixture
def read_only(finished: Path, tmp_path: Path) -> Iterator[Path]:
    """A finished case in a folder that may be read only."""
    folder = tmp_path / "case"
    shutil.copytree(finished, folder)
    if os.geteuid():
        folder.chmod(0o555)
        yield folder
        folder.chmod(0o755)
        return
    # Permissions do not hold the superuser; a mount does.
    bound = subprocess.run(["mount", "--bind", str(folder), str(folder)], capture_output=True, check=False)
    if bound.returncode:
        pytest.skip("nothing could be mounted")
    try:
        subprocess.run(["mount", "-o", "remount,ro,bind", str(folder)], check=True)
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def test_read_only_output_ends_in_a_sentence_and_reading_works(read_only: Path) -> None:
    before = contents(read_only)
    for arguments in (("run", "tiny.yaml", *TO_PART, "--force"), ("plot", "tiny.h5")):
        ended = called(read_only, *arguments)
        assert ended.code == ExitCode.UNEXPECTED
        assert ended.err.startswith("poro: ")
        assert ended.err.count("\n") == 1
        assert "Read-only" in ended.err or "Permission denied" in ended.err
    assert contents(read_only) == before
    status = called(read_only, "status", "tiny.yaml")
    assert status.out.count("up to date") == 5


def test_weird_folders_for_the_output_give_one_sentence(tmp_path: Path, poro: Poro) -> None:
    (tmp_path / "tiny.yaml").write_text(TINY)
    for output in ("tiny.yaml", "tiny.yaml/x", "x" * 300, "/dev/null", "/proc/nothing/here"):
        ended = poro("refine", "tiny.yaml", "--output", output)
        assert ended.code == ExitCode.USAGE, (output, ended.err)
        assert ended.err.count("\n") == 1
        assert "choose another --output" in ended.err
    ended = poro("refine", "y" * 5_000 + ".yaml")
    assert (ended.code, ended.err.count("\n")) == (ExitCode.USAGE, 1)
    assert [path.name for path in tmp_path.iterdir()] == ["tiny.yaml"]
