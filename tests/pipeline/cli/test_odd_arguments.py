"""Every command that reads, on every kind of argument: a sentence that a user can act on, never an unexpected error."""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import TINY, Poro, edited

from pipeline.exit_codes import ExitCode

#: Names of files that are no UTF-8, as an old archive or a memory stick leaves them.
ODD = os.fsdecode(b"caf\xe9")
odd_names = pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such names")

COMMANDS = {
    "plot": ["{}", "--only", "history", "--output", "out"],
    "report": ["{}", "--no-check", "--output", "out"],
    "convert": ["{}", "x.vtu"],
    "status": ["{}"],
    "run": ["{}", "--dry-run"],
    "check": ["{}", "--pitch", "2.0"],
    "slice": ["{}", "--layer", "4.0"],
    "compare": ["{}", "measured.csv"],
    "fit": ["{}"],
    "sweep": ["{}", "--dry-run"],
    "new": ["mine", "--force", "--like", "{}"],
}


#: Of the arguments, those on which commands part most; all of them take minutes.
FEW = ("text.yaml", "latin.yaml", "binary.stl", "text.h5", "folder", "tiny.refined.h5", f"{ODD}.yaml", f"{ODD}.stl")


@pytest.fixture
def arguments(poro: Poro, folder: Path) -> list[str]:
    """Files and folders of every kind, spoilt ones too; the working folder of ``poro``."""
    contents = {
        "empty": b"",
        "text": b"hello\n",
        "latin": "name: caf\xe9\n".encode("latin-1"),
        "binary": bytes(range(256)) * 8,
        "list": b"- 1\n",
    }
    for name, data in contents.items():
        for ending in ("yaml", "h5", "stl", "csv"):
            Path(f"{name}.{ending}").write_bytes(data)
    Path("measured.csv").write_text("pressure [kPa],displacement [mm]\n0,0\n10,2\n20,4\n10,2\n0,0\n")
    for name in ("folder", "folder.h5", "folder.stl", "folder.yaml"):
        Path(name).mkdir()
    if sys.platform == "linux":
        for ending in ("yaml", "h5", "stl"):
            shutil.copy(f"{'' if ending == 'yaml' else 'tiny/'}tiny.{ending}", f"{ODD}.{ending}")
    artifacts = sorted(path.name for path in (folder / "tiny").rglob("tiny.*"))
    here = sorted(path.name for path in folder.iterdir())
    return [*here, *artifacts, "missing.yaml", "missing.h5", "missing.stl", ""]


@pytest.mark.usefixtures("quickly")
@pytest.mark.parametrize("few", [True, pytest.param(False, marks=pytest.mark.slow)], ids=["few", "all"])
@pytest.mark.parametrize("command", COMMANDS)
def test_no_argument_ends_in_an_unexpected_error(command: str, few: bool, arguments: list[str], poro: Poro) -> None:
    for argument in arguments:
        if few and argument not in FEW:
            continue
        ended = poro(command, *(word.format(argument) for word in COMMANDS[command]))
        assert ended.code != ExitCode.UNEXPECTED, (argument, ended.err)
        assert "Traceback" not in ended.err, (argument, ended.err)
        if ended.code not in (ExitCode.OK, ExitCode.BAD_SOLID):
            assert ended.err.rstrip().endswith((".", "?")), (argument, ended.err)


#: Datasets of each artifact on which commands rest.
RESTED_ON = {
    "tiny/tiny.h5": ("vertices/chi", "nodes/connectivity", "domain/radius", "report/summary"),
    "tiny/details/tiny.solid.h5": ("surface/connectivity", "surface/points"),
    "tiny/details/tiny.stl.h5": ("report/summary",),
}


@pytest.mark.usefixtures("quickly")
@pytest.mark.parametrize("name", RESTED_ON)
def test_artifacts_that_lack_something_are_refused_with_a_sentence(name: str, folder: Path, poro: Poro) -> None:
    before = (folder / name).read_bytes()
    for dataset in RESTED_ON[name]:
        for spoil in ("gone", "short", "older"):
            (folder / name).write_bytes(before)
            with edited(folder / name) as file:
                values = file[dataset][()]
                del file[dataset]
                if spoil == "short" and isinstance(values, np.ndarray):
                    file[dataset] = values[:-1]
                elif spoil == "older" and dataset == "report/summary":
                    file[dataset] = json.dumps({"updates": 1})
            for command in ("report", "convert"):
                ended = poro(command, *(word.format(name) for word in COMMANDS[command]))
                assert ended.code in (ExitCode.OK, ExitCode.USAGE, ExitCode.ARTIFACT), (dataset, spoil, ended.err)


@pytest.mark.parametrize("ending", ["bdf", "su2", "exo", "svg", "ele", "obj", "vol.gz", "glb", "3mf", "h5", ""])
def test_formats_that_cannot_hold_a_mesh_say_what_can(ending: str, folder: Path, poro: Poro) -> None:
    ended = poro("convert", "tiny.h5", f"x.{ending}")
    if ended.code == ExitCode.OK:  # the package that it needs is installed here
        return
    assert ended.code == ExitCode.USAGE
    said = ended.err.rstrip()
    assert "use another format, such as .vtu." in said or ("use one of" in said and "--colour" in said)
    for raw in ("No module", "AssertionError", "StopIteration", "__format__", "KeyError"):
        assert raw not in said


@odd_names
def test_names_that_are_no_utf8_work(folder: Path, poro: Poro) -> None:
    shutil.copy("tiny/tiny.h5", f"{ODD}.h5")
    shutil.copy("tiny/tiny.stl", f"{ODD}.stl")
    os.mkdir(ODD)
    assert poro("check", f"{ODD}.stl", "--pitch", "2.0", "--json").code in (ExitCode.OK, ExitCode.BAD_SOLID)
    (stored,) = (path for path in folder.rglob("*.check.json") if ODD in path.name)
    assert f"{ODD}.stl" in json.dumps(json.loads(stored.read_text(encoding="utf-8")), ensure_ascii=False)
    assert poro("convert", f"{ODD}.h5", f"{ODD}/x.vtu").code == ExitCode.OK
    ended = poro("refine", f"{ODD}.h5", "--output", ODD)
    assert (ended.code, "Logging error" in ended.err) == (ExitCode.OK, False)
    (folder / f"{ODD}.yaml").write_text(TINY)
    ended = poro("status", f"{ODD}.yaml")
    assert ended.code == ExitCode.USAGE
    assert "name: 'caf?' may only have letters" in ended.err
    (folder / f"{ODD}.yaml").write_text(f"name: tiny\n{TINY}")
    assert poro("status", f"{ODD}.yaml", "--output", ODD).code == ExitCode.OK
