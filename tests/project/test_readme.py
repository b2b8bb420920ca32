"""The README against the program: its commands run as they stand, and its numbers are those of the results."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pytest
from command_line import COARSE, TINY, Poro
from documents import ROOT, follow

from pipeline.case.model import find_case, read_case

README_PATH = ROOT / "README.md"
README = README_PATH.read_text(encoding="utf-8")


@pytest.mark.usefixtures("quickly")
def test_commands_run_as_they_stand(tmp_path: Path, poro: Poro) -> None:
    """In order and in one folder, with tiny cases of the names of the shipped ones; figures are test_plots' matter."""
    (tmp_path / "outputs").mkdir()
    tiny = TINY + COARSE + "export: {scale: 1.5}\nsimulate: {max_load: 1.0, states: [1.0]}\n"
    for name in ("case14", "quick"):
        (tmp_path / f"{name}.yaml").write_text(tiny)
    assert follow(README_PATH, poro, tmp_path) == 8
    found = {path.name for path in (tmp_path / "outputs").rglob("*")}
    assert {"quick.stl", "quick.png", "quick.inflated.png", "case14.report.html", "case14.simulation.h5"} <= found
    assert "case14.stl.check.json" in found
    assert (tmp_path / "arm.yaml").exists()


@pytest.mark.parametrize("name", ["case14", "case11"])
def test_numbers_are_those_of_the_results(name: str) -> None:
    """Of the last design update in the history that is committed."""
    case, _ = read_case(find_case(Path(f"{name}.yaml")))
    with (ROOT / "docs" / "results" / f"{name}-history.csv").open(encoding="utf-8") as file:
        last = {key: float(value) for key, value in list(csv.DictReader(file))[-1].items()}
    arm = case.load.arm_ratio * case.domain.radius
    elongation = arm * math.sin(last["theta2 [rad]"]) - last["T3 [mm]"]
    theta2 = math.degrees(last["theta2 [rad]"])
    cells = f"{last['C0 [1]']:.4f} | {last['T3 [mm]']:.3f} mm | {theta2:.2f}° | {elongation:.2f} mm"
    assert f"| poro, `{name}` | none: looser | {cells} |\n" in README
    assert case.objective.strain_energy_shift == 0.0


def test_readme_is_short() -> None:
    assert len(README.splitlines()) <= 130
