"""What shells offer: asked as their own scripts ask, by the environment of the program."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

SHELLS = ("bash", "zsh", "fish")


def offered(shell: str, folder: Path, line: str) -> set[str]:
    """Completions of the last word of a command line."""
    words = line.split(" ")
    asked = {
        "bash": {"COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)},
        "zsh": {"_TYPER_COMPLETE_ARGS": line},
        "fish": {"_TYPER_COMPLETE_ARGS": line, "_TYPER_COMPLETE_FISH_ACTION": "get-args"},
    }[shell]
    path = os.pathsep.join(entry for entry in sys.path if entry)
    environment = os.environ | asked | {"_PORO_COMPLETE": f"complete_{shell}", "PYTHONPATH": path}
    ended = subprocess.run(
        [sys.executable, "-m", "poro"], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    if shell == "zsh":
        return set(re.findall(r'"([^"]+)"(?::"[^"]*")?', ended.stdout))
    return {line.partition("\t")[0] for line in ended.stdout.splitlines()}


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with files to choose from."""
    for name in ("small.yaml", "small.h5", "small.stl", ".small.yaml", "cases/arm.yaml", "cases/arm.log"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    return tmp_path


@pytest.mark.parametrize("shell", SHELLS)
def test_commands_options_values_and_case_files_are_completed(shell: str, files: Path) -> None:
    assert offered(shell, files, "poro ref") == {"refine"}
    assert offered(shell, files, "poro run --dry") == {"--dry-run"}
    assert offered(shell, files, "poro run s") == {"small.yaml", "small.h5"}


def test_values_shipped_cases_folders_artifacts_and_studies_are_completed(files: Path) -> None:
    assert offered("bash", files, "poro run --until mi") == {"mirror"}
    assert offered("bash", files, "poro export cases/a") == {"cases/arm.yaml"}
    shipped = {f"case{limit}{kind}.yaml" for limit in (11, 14) for kind in ("", "-eq14-shift")}
    assert offered("bash", files, "poro run ca") == {*shipped, "cases/"}
    assert offered("bash", files, "poro convert s") == {"small.yaml", "small.h5"}
    assert offered("bash", files, "poro sweep s") == {"small.yaml"}
    assert offered("bash", files, "poro new x --like q") == {"quick.yaml"}


@pytest.mark.parametrize("shell", SHELLS)
def test_script_for_the_shell_is_shown(shell: str, files: Path) -> None:
    path = os.pathsep.join(entry for entry in sys.path if entry)
    environment = os.environ | {"_PORO_COMPLETE": f"source_{shell}", "PYTHONPATH": path}
    ended = subprocess.run([sys.executable, "-m", "poro"], env=environment, capture_output=True, text=True, check=True)
    assert f"_PORO_COMPLETE=complete_{shell}" in ended.stdout
