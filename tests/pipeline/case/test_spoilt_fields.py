"""Values that are not finite in artifacts and checkpoints, and checkpoints that cannot be used."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import Poro, edited

from pipeline.exit_codes import ExitCode
from pipeline.store import artifact


def spoil(path: Path, dataset: str, value: float) -> bytes:
    """Put a value into the middle of a dataset; returns the file as it is then."""
    with edited(path) as file:
        values = file[dataset][()]
        values.flat[values.size // 2] = value
        file[dataset][...] = values
    return path.read_bytes()


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize(
    ("name", "dataset", "command"),
    [
        ("tiny/tiny.h5", "vertices/chi", ("refine", "--force")),
        ("tiny/tiny.h5", "vertices/chi", ("plot",)),
        ("tiny/tiny.h5", "nodes/displacement", ("plot",)),
        ("tiny/details/tiny.refined.h5", "vertices/chi", ("finish", "--force")),
        ("tiny/details/tiny.finished.h5", "vertices/chi", ("mirror", "--force")),
        ("tiny/details/tiny.solid.h5", "surface/points", ("export", "--force")),
        ("tiny/tiny.h5", "checkpoint/x", ("optimize", "--updates", "2")),
        ("tiny/tiny.h5", "checkpoint/chi", ("optimize", "--updates", "2")),
    ],
)
def test_field_that_is_not_finite_is_refused(
    name: str, dataset: str, command: tuple[str, ...], value: float, folder: Path, poro: Poro
) -> None:
    before = {path: path.read_bytes() for path in folder.rglob("tiny*.h5")}
    before[folder / name] = spoil(folder / name, dataset, value)
    ended = poro(command[0], "tiny.yaml", "--output", ".", *command[1:])
    assert ended.code == ExitCode.ARTIFACT, ended.err
    last = ended.err.splitlines()[-1]
    assert last.startswith(f"poro: {name}: {dataset} is not finite in 1 of ")
    assert {path: path.read_bytes() for path in folder.rglob("tiny*.h5")} == before


def _not_finite(path: Path) -> None:
    spoil(path, "checkpoint/chi", np.nan)


def _newer(path: Path) -> None:
    with edited(path) as file:
        file.attrs["schema_version"] = artifact.SCHEMA_VERSION + 1


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def _foreign(path: Path) -> None:
    path.write_text("my notes")


SPOILT = {_not_finite: "not finite", _newer: "newer poro", _cut: "cut short", _foreign: "no HDF5 file"}


@pytest.mark.parametrize("spoilt", SPOILT, ids=lambda spoilt: spoilt.__name__.strip("_"))
def test_checkpoint_that_cannot_be_used_is_not_written_over(spoilt: object, folder: Path, poro: Poro) -> None:
    """It may hold days of work, for a newer program or a patient user."""
    assert callable(spoilt)
    checkpoint = folder / "tiny/details/tiny.checkpoint.h5"
    shutil.copy(folder / "tiny/tiny.h5", checkpoint)
    with edited(checkpoint) as file:
        file.attrs["stage"] = "checkpoint"
    spoilt(checkpoint)
    before = checkpoint.read_bytes()
    command = ("optimize", "tiny.yaml", "--output", ".", "--updates", 2, "--threads", 1)
    ended = poro(*command)
    assert ended.code == ExitCode.ARTIFACT
    last = ended.err.splitlines()[-1]
    assert last.startswith("poro: tiny/details/tiny.checkpoint.h5: ")
    assert SPOILT[spoilt] in last
    assert last.endswith("start over with --fresh.")
    assert checkpoint.read_bytes() == before
    assert poro(*command, "--fresh").code == ExitCode.OK
    assert not checkpoint.exists()


def test_checkpoint_left_beside_its_finished_design_is_removed(folder: Path, poro: Poro) -> None:
    """As a kill between the two leaves them."""
    checkpoint = folder / "tiny/details/tiny.checkpoint.h5"
    shutil.copy(folder / "tiny/tiny.h5", checkpoint)
    with edited(checkpoint) as file:
        file.attrs["stage"] = "checkpoint"
    assert poro("optimize", "tiny.yaml", "--output", ".").code == ExitCode.OK
    assert not checkpoint.exists()
