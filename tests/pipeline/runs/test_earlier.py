"""Results of another problem under the same name are kept, and files are found in the folder of their case."""

from __future__ import annotations

from pathlib import Path

import pytest
from command_line import TINY, Poro

from pipeline.exit_codes import ExitCode
from pipeline.store import artifact

pytestmark = pytest.mark.usefixtures("undrawn")

#: A copy of the tiny case with one key changed and the same name.
COPY = TINY + "name: tiny\nload: {arm_ratio: 5.0}\n"


def _identity(path: Path) -> str:
    return artifact.read_header(path).identity


def _files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("tiny*") if path.is_file()}


def test_design_of_another_problem_is_kept_whole(folder: Path, poro: Poro) -> None:
    earlier, files = _identity(folder / "tiny/tiny.h5"), _files(folder / "tiny")
    (folder / "copy.yaml").write_text(COPY)
    ended = poro("optimize", "copy.yaml", "--updates", 0, "--output", ".")
    assert ended.code == ExitCode.OK, ended.err
    assert "load.arm_ratio 4.0 → 5.0" in ended.err
    assert "kept in tiny.1" in ended.err
    assert _identity(folder / "tiny.1/tiny.h5") == earlier
    assert _files(folder / "tiny.1") == files
    assert _files(folder / "tiny") == {"tiny.h5", "tiny.vtkhdf", "details/tiny.log"}
    # What was kept is as good as it was.
    assert "run " not in poro("run", "tiny.1", "--until", "export", "--dry-run").out


def test_next_one_gets_the_next_number(folder: Path, poro: Poro) -> None:
    (folder / "tiny.1").mkdir()
    (folder / "copy.yaml").write_text(COPY)
    assert poro("optimize", "copy.yaml", "--updates", 0, "--output", ".").code == ExitCode.OK
    assert (folder / "tiny.2/tiny.h5").is_file()


def test_force_replaces(folder: Path, poro: Poro) -> None:
    (folder / "copy.yaml").write_text(COPY)
    ended = poro("optimize", "copy.yaml", "--updates", 0, "--output", ".", "--force")
    assert ended.code == ExitCode.OK, ended.err
    assert not (folder / "tiny.1").exists()


def test_another_setting_of_a_later_stage_replaces_what_that_stage_made(folder: Path, poro: Poro) -> None:
    earlier = _identity(folder / "tiny/tiny.h5")
    (folder / "tiny.yaml").write_text(TINY + "mirror: {threshold: 0.25}\n")
    assert poro("mirror", "tiny.yaml", "--output", ".").code == ExitCode.OK
    assert not (folder / "tiny.1").exists()
    assert _identity(folder / "tiny/tiny.h5") == earlier


def test_parts_of_another_design_are_kept(folder: Path, poro: Poro) -> None:
    (folder / "copy.yaml").write_text(COPY)
    assert poro("optimize", "copy.yaml", "--updates", 0, "--output", "elsewhere").code == ExitCode.OK
    earlier = _identity(folder / "tiny/details/tiny.refined.h5")
    ended = poro("refine", "elsewhere/tiny", "--output", ".")
    assert ended.code == ExitCode.OK, ended.err
    assert "kept in tiny.1" in ended.err
    assert _identity(folder / "tiny.1/details/tiny.refined.h5") == earlier
    assert (folder / "tiny.1/tiny.stl").is_file()


@pytest.mark.parametrize("named", ["tiny", "tiny.h5", "tiny/tiny.h5", "tiny.refined.h5"])
def test_files_of_a_case_are_found_by_name(named: str, folder: Path, poro: Poro) -> None:
    ended = poro("status", named)
    assert ended.code == ExitCode.OK, ended.err
    assert "given" in ended.out
    (folder / "tiny").rename(folder / "kept")
    (folder / "outputs").mkdir()
    (folder / "kept").rename(folder / "outputs/tiny")
    if "/" not in named and named != "tiny":
        assert "outputs/tiny" in poro("status", named).out


def test_part_of_a_case_is_found_by_name(folder: Path, poro: Poro) -> None:
    ended = poro("slice", "tiny.stl", "--layer", 2)
    assert ended.code == ExitCode.OK, ended.err
    assert (folder / "tiny/details/tiny.areas.csv").is_file()
