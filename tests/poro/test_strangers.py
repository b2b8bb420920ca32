"""Someone else's file with the name of one of poro's packages: a sentence, whichever way poro is started."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from documents import ROOT

NAMES = ("actuator", "pipeline", "stages")

#: What an installer makes of the entry point in pyproject.toml, but for its first line.
SCRIPT = "import sys\nfrom {module} import {function}\nif __name__ == '__main__':\n    sys.exit({function}())\n"


@pytest.fixture(params=[f"{name}{ending}" for name in NAMES for ending in (".py", "/__init__.py")])
def stranger(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A module or package of one of these names in a folder of its own."""
    path: Path = tmp_path / "theirs" / request.param
    path.parent.mkdir(parents=True)
    path.write_text("raise SystemExit('their code ran')\n")
    return path


def sentence(stranger: Path) -> str:
    name = stranger.stem if stranger.stem != "__init__" else stranger.parent.name
    return f"{stranger} hides poro's own package '{name}'; rename it or start Python elsewhere."


def started(*arguments: str, cwd: Path, before: Path | None = None) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join(str(entry) for entry in (before, ROOT) if entry)
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=cwd,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


def script(folder: Path) -> Path:
    """The console script, as it is installed."""
    entry = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"]["poro"]
    module, _, function = entry.partition(":")
    path = folder / "bin" / "poro"
    path.parent.mkdir()
    path.write_text(SCRIPT.format(module=module, function=function))
    return path


def test_import_says_so(stranger: Path, tmp_path: Path) -> None:
    theirs = tmp_path / "theirs"
    code = "try:\n    import poro\nexcept ImportError as error:\n    print(error)"
    assert started("-c", code, cwd=theirs).stdout.strip() == sentence(stranger)
    assert started("-c", code, cwd=tmp_path, before=theirs).stdout.strip() == sentence(stranger)


def test_module_as_a_program_says_so(stranger: Path, tmp_path: Path) -> None:
    ended = started("-m", "poro", "--help", cwd=tmp_path / "theirs")
    assert (ended.returncode, ended.stdout, ended.stderr) == (2, "", f"poro: {sentence(stranger)}\n")


def test_console_script_says_so(stranger: Path, tmp_path: Path) -> None:
    ended = started(str(script(tmp_path)), "--help", cwd=tmp_path, before=tmp_path / "theirs")
    assert (ended.returncode, ended.stdout, ended.stderr) == (2, "", f"poro: {sentence(stranger)}\n")


def test_console_script_runs_where_nothing_is_hidden(tmp_path: Path) -> None:
    """A folder without code, such as one of results, hides nothing."""
    (tmp_path / "pipeline").mkdir()
    ended = started(str(script(tmp_path)), "--version", cwd=tmp_path, before=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.startswith("poro ")
