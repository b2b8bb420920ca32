"""The program called as a user calls it, and a finished run to look at or to spoil."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from command_line import TINY, TO_PART, Ended, Poro

from actuator import compilation
from actuator.threads import use_threads
from pipeline.cli.app import call
from pipeline.store import contents

#: Where files of few tests take long, in order: begun last, one of them would keep one worker busy alone.
LONG = ("tests/project/", "tests/extensions/", "tests/pipeline/")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files that take longest first."""
    place = {room: number for number, room in enumerate(LONG)}
    items.sort(key=lambda item: next((place[room] for room in LONG if item.nodeid.startswith(room)), len(LONG)))


@pytest.fixture(scope="session", autouse=True)
def kernels() -> None:
    """Compiled before any test by what a user's run calls; a fault in it must not pass for slow first runs."""
    subprocess.run([sys.executable, "-m", compilation.__name__], check=True)


@pytest.fixture(scope="session", autouse=True)
def threads() -> None:
    """As a run has them, whichever test comes first: the last bits of dense linear algebra depend on them."""
    use_threads(2)


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
    assert call(["run", str(folder / "tiny.yaml"), *TO_PART, "--output", str(folder), "--threads", "1"]) == 0
    return folder


@pytest.fixture
def folder(finished: Path, tmp_path: Path) -> Path:
    """A copy of that folder, to be spoilt; it is the working folder of ``poro``."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.fixture
def undrawn(finished: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts get the figure of the finished case: the process that draws one starts for seconds."""
    figure = finished / "tiny/tiny.png"
    monkeypatch.setattr("pipeline.figures.part.draw_part", lambda part, path: shutil.copy(figure, path))


@pytest.fixture
def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures and the 3D view of the report replaced by a pixel: for tests of what stands around them."""
    from pipeline.figures import designs
    from pipeline.report import page as report
    from pipeline.results.design import OptimisedDesign

    def pixel(design: OptimisedDesign, name: str, format: str) -> tuple[str, bytes]:
        return format, b"pixel"

    def none(design: OptimisedDesign) -> None:
        return None

    monkeypatch.setattr(designs, "drawn", pixel)
    monkeypatch.setattr(report, "displayed", none)


@pytest.fixture(scope="session")
def report(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The report of that run."""
    folder = tmp_path_factory.mktemp("report")
    assert call(["report", str(finished / "tiny/tiny.h5"), "--output", str(folder)]) == 0
    return folder / "tiny.report.html"


@pytest.fixture(scope="session")
def summary(finished: Path) -> dict[str, Any]:
    """What the optimisation of that run reports."""
    return contents.summary(finished / "tiny/tiny.h5", "optimize")


@pytest.fixture(scope="session")
def pressurised(finished: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny case, simulated."""
    place = tmp_path_factory.mktemp("simulated")
    shutil.copytree(finished, place, dirs_exist_ok=True)
    (place / "tiny.yaml").write_text(TINY + "simulate: {max_load: 1.2, states: [0.5, 1]}\n")
    assert call(["simulate", str(place / "tiny.yaml"), "--output", str(place), "--threads", "1"]) == 0
    return place


@pytest.fixture
def simulation(folder: Path, pressurised: Path) -> Path:
    """The simulation beside the design of :func:`folder`."""
    return Path(shutil.copy(pressurised / "tiny/details/tiny.simulation.h5", folder / "tiny/details"))
