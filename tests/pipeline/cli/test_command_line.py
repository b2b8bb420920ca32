"""The program as a whole: help, exit codes, and ends that nobody wants."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import TINY, TO_PART, Poro

from pipeline.exit_codes import ExitCode

ROOT = Path(__file__).parents[3]
COMMANDS = ["optimize", "refine", "mirror", "export", "run", "status", "plot", "check", "slice", "convert", "schema"]
COMMANDS += ["new", "sweep"]


def test_help_names_the_commands_and_the_exit_codes(poro: Poro) -> None:
    ended = poro("--help")
    words = " ".join(ended.out.split())
    assert ended.code == ExitCode.OK
    assert all(f" {command} " in words for command in COMMANDS)
    assert all(f"{code.value} {code.meaning}" in words for code in ExitCode)
    assert poro().out == ended.out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command: str, poro: Poro) -> None:
    ended = poro(command, "--help")
    assert ended.code == ExitCode.OK
    assert ended.out.startswith("Usage: poro")


@pytest.mark.parametrize(
    "arguments",
    [
        ["solve"],
        ["optimize"],
        ["optimize", "quick.yaml", "--updates", "many"],
        ["optimize", "quick.yaml", "--updates", "-1"],
        ["optimize", "quick.yaml", "--threads", "-1"],
        ["export", "quick.yaml", "--scale", "0"],
        ["export", "quick.yaml", "--scale", "nan"],
        ["export", "quick.yaml", "--format", "obj"],
        ["run", "quick.yaml", "--until", "print"],
    ],
)
def test_wrong_usage_gives_one_sentence_and_code_2(arguments: list[str], poro: Poro) -> None:
    ended = poro(*arguments)
    assert ended.code == ExitCode.USAGE
    assert ended.out == ""
    assert ended.err.startswith("poro: ")
    assert ended.err.count("\n") == 1
    assert list(Path().iterdir()) == []


def test_progress_goes_to_standard_error_and_into_the_log(folder: Path, poro: Poro) -> None:
    (folder / "tiny/details/tiny.solid.h5").unlink()
    ended = poro("mirror", "tiny.yaml", "--output", ".")
    assert "mirror: missing" in ended.err
    assert "mirror: missing" not in ended.out
    log = (folder / "tiny/details/tiny.log").read_text(encoding="utf-8")
    assert "mirror: missing" in log
    assert log.count("INFO poro ") == 2  # this call and the first


def test_summary_tells_what_a_user_wants_to_know(folder: Path, poro: Poro) -> None:
    out = poro("run", "tiny.yaml", *TO_PART, "--output", ".").out
    assert out.startswith("tiny\n  holds air           yes\n")
    for name in ("C0", "T3", "theta2", "spring elongation", "volume", "watertight", "bounding box", "seconds", "files"):
        assert re.search(rf"^  {name} {{2,}}", out, flags=re.MULTILINE), name
    assert re.search(r"bounding box +15\.00 x ", out)
    for path in ("tiny.h5", "tiny.refined.h5", "tiny.solid.h5", "tiny.stl", "tiny.png"):
        assert path in out


def test_design_without_a_solid_ends_with_code_5(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text(TINY + "mirror: {threshold: 100.0}\n")
    (folder / "tiny/tiny.stl").unlink()
    ended = poro("export", "tiny.yaml", "--output", ".")
    assert ended.code == ExitCode.BAD_SOLID
    assert "lower the threshold" in ended.err.splitlines()[-1]
    assert not (folder / "tiny/tiny.stl").exists()


def _limited(folder: Path, largest_file: int, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Call the program with a limit on the size of files, which fails as a full disk does."""
    limited = (
        f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({largest_file}, {largest_file})); "
        f"from pipeline.cli.app import call; import sys; sys.exit(call({list(arguments)!r}))"
    )
    return subprocess.run([sys.executable, "-c", limited], cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.skipif(sys.platform == "win32", reason="limits of POSIX")
@pytest.mark.parametrize(
    ("largest", "command"),
    [
        (5_000, ("refine", "tiny.yaml", "--force")),
        (50_000, ("refine", "tiny.yaml", "--force")),
        (5_000, ("optimize", "tiny.yaml", "--force", "--fresh", "--threads", "1")),
        (50_000, ("export", "tiny.yaml", "--scale", "1.5")),
    ],
)
def test_disk_that_takes_no_more_ends_in_a_sentence_and_spoils_nothing(
    largest: int, command: tuple[str, ...], folder: Path
) -> None:
    before = _files(folder)
    ended = _limited(folder, largest, *command, "--output", ".")
    assert ended.returncode == ExitCode.UNEXPECTED, ended.stderr
    assert "could not be written" in ended.stderr.splitlines()[-1]
    assert "Traceback" not in ended.stderr
    assert _files(folder) == before


def _files(folder: Path) -> dict[Path, bytes]:
    """All but the log, which says what happened."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and path.suffix != ".log"}


def test_everything_the_readme_and_the_list_of_files_call_exists(poro: Poro) -> None:
    pages = (ROOT / "README.md", ROOT / "docs" / "reference" / "artifacts.md")
    lines = [line for page in pages for line in page.read_text(encoding="utf-8").splitlines()]
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    calls = [line.split("#")[0].split() for line in lines if line.startswith(("poro ", "make "))]
    assert len(calls) > 20
    for program, name, *words in calls:
        if program == "make":
            assert re.search(rf"^{name}:", makefile, flags=re.MULTILINE), name
            continue
        explained = poro(name, "--help")
        assert explained.code == ExitCode.OK, name
        for option in (word for word in words if word.startswith("-")):
            assert option in explained.out, shlex.join([program, name, option])
