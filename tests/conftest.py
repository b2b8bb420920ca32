"""The program called as a user calls it, and a finished run to look at or to spoil."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from command_line import TINY, Ended, Poro
from matplotlib.figure import Figure

from actuator import compilation
from pipeline import contents
from pipeline.cli import call


@pytest.fixture(scope="session", autouse=True)
def kernels() -> None:
    """Compiled before any test by what a user's run calls; a fault in it must not pass for slow first runs."""
    subprocess.run([sys.executable, "-m", compilation.__name__], check=True)


@pytest.fixture
def poro(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Poro:
    """Call the program with arguments, in an empty working folder."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Ended:
        capsys.readouterr()
        code = call([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Ended(int(code), captured.out, captured.err)

    return run


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which the tiny case has run to the end."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "tiny.yaml").write_text(TINY)
    assert call(["run", str(folder / "tiny.yaml"), "--output", str(folder), "--threads", "1"]) == 0
    return folder


@pytest.fixture
def folder(finished: Path, tmp_path: Path) -> Path:
    """A copy of that folder, to be spoilt; it is the working folder of ``poro``."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.fixture(scope="session")
def report(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of that run."""
    folder = tmp_path_factory.mktemp("report")
    assert call(["report", str(finished / "tiny.h5"), "--output", str(folder)]) == 0
    return folder / "tiny.report.html"


@pytest.fixture(scope="session")
def summary(finished: Path) -> dict[str, Any]:
    """What the optimisation of that run reports."""
    return contents.summary(finished / "tiny.h5", "optimize")


@pytest.fixture
def simulation(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A simulation beside the design of :func:`folder`, read and drawn by stand-ins of the modules that do that."""
    path = folder / "tiny.simulation.h5"
    path.write_bytes(b"a simulation")
    reader, drawer = ModuleType("pipeline.simulation"), ModuleType("pipeline.path_plot")
    found = SimpleNamespace(name="tiny", summary={"density": {"elongation": 0.603, "steps": 7}})

    def drawn(simulation: object) -> Figure:
        assert simulation is found
        figure = Figure()
        figure.subplots().plot([0.0, 1.0], [0.0, 2.0])
        return figure

    monkeypatch.setattr(reader, "read_simulation", {path: found}.__getitem__, raising=False)
    monkeypatch.setattr(drawer, "pressure_displacement", drawn, raising=False)
    for module in (reader, drawer):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return path
