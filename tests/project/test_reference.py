"""The pages of docs/reference that are written by hand, against the program: exit codes, and the files of commands."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest
from command_line import COARSE, TINY, Poro
from documents import PAGES, ROOT, follow
from synthetic import EXAMPLE

from pipeline.exit_codes import ExitCode

REFERENCE = ROOT / "docs" / "reference"
FAULTS = REFERENCE / "faults.md"
ARTIFACTS = REFERENCE / "artifacts.md"


def table(page: Path, heading: str) -> dict[str, str]:
    """First two columns of the table under a heading."""
    text = page.read_text(encoding="utf-8")
    rows = re.search(rf"^\| {heading} \|.*\n\|.*\n((?:\|.*\n)+)", text, flags=re.MULTILINE)
    assert rows, heading
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in rows[1].splitlines()]
    return {cell[0]: cell[1] for cell in cells}


def test_exit_codes_are_those_of_the_program() -> None:
    listed = {int(code): meaning for code, meaning in table(FAULTS, "exit code").items()}
    assert listed == {code.value: code.meaning for code in ExitCode}


def test_exit_codes_stand_once() -> None:
    with_table = [page for page in PAGES if re.search(r"^\| exit code \|", page.read_text("utf-8"), flags=re.MULTILINE)]
    assert with_table == [FAULTS]


@pytest.mark.usefixtures("quickly")
def test_commands_write_the_files_that_are_listed(tmp_path: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch) -> None:
    """In order and in one folder, with a tiny case of the name of the shipped one; figures are test_plots' matter."""
    monkeypatch.setattr("pipeline.runs.films.MOST", 2)  # frames of a film
    (tmp_path / "outputs").mkdir()
    # As many updates as the command that asks for a number of them: fewer than are stored would be refused. Cheap ones.
    tiny = TINY.replace("max_updates: 1", "max_updates: 20\n  max_inner_steps: 2")
    shutil.copy(EXAMPLE, tmp_path / "measured.csv")
    short = "export: {scale: 1.5}\nsimulate: {max_load: 1.0, states: [1.0]}\n"
    short += "finish: {method: strain, steps: 0, size: 4.0}\n"
    # Walls this thick hold air, so that the part can be inflated.
    (tmp_path / "case14.yaml").write_text(tiny + COARSE + "mirror: {threshold: -6.0}\n" + short)
    (tmp_path / "tiny.yaml").write_text(TINY.replace("max_updates: 1", "max_updates: 0"))
    (tmp_path / "study.yaml").write_text("case: tiny.yaml\nvary: {load.pressure_ratio: [0.01]}\nuntil: optimize\n")
    assert follow(ARTIFACTS, poro, tmp_path) > 10
    found = {path.name for path in (tmp_path / "outputs").rglob("*")}
    rows = {**table(ARTIFACTS, "on top"), **table(ARTIFACTS, "in `details/`")}
    promised = {name.replace("NAME", "case14") for row in rows for name in re.findall(r"`(NAME[^`]*)`", row)}
    # The optimisation has ended, so that nothing of one under way is left, and one film is enough.
    left = {"case14.checkpoint.h5", "case14.updates", "case14.simulation.gif", "case14.inflation.gif"}
    assert promised - found == left
    assert {f"study.sweep.{ending}" for ending in ("csv", "md", "png", "log")} <= found
    assert (tmp_path / "case14.vtu").exists()
    assert (tmp_path / "case14.glb").exists()
