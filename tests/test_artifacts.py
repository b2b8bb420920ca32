"""Artifacts: whole or not there, self-describing, and refused with a sentence when anything is wrong with them."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import Poro
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline import artifact
from pipeline.artifact import Dataset, Header
from pipeline.exit_codes import ExitCode, Fault

HEADER = Header(
    stage="refine",
    stage_version=3,
    content_key="ab" * 32,
    identity="this run",
    upstream_keys=("cd" * 32,),
    upstream_identity="that run",
    case_text="# Größe in mm\nname: x\n",
    case_resolved={"name": "x", "domain": {"radius": 15.0}},
)
FIELD = np.random.default_rng(1).normal(size=2000)
DATASETS = {
    "fields/chi": Dataset(FIELD, "1", "a field"),
    "fields/count": Dataset(7, "1", "a number"),
    "fields/note": Dataset("θ2 in rad", "", "a text"),
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """An artifact as it should be."""
    path = tmp_path / "x.h5"
    artifact.write(path, HEADER, DATASETS)
    return path


def test_what_is_written_is_read(path: Path) -> None:
    found = artifact.read_group(path, "refine", "fields")
    np.testing.assert_array_equal(found["chi"], FIELD)
    assert found["count"] == 7
    assert found["note"] == "θ2 in rad"
    header = artifact.read_header(path)
    written = {name: getattr(header, name) for name in HEADER.__dataclass_fields__ if getattr(HEADER, name)}
    assert written == {name: getattr(HEADER, name) for name in written}
    assert header.program_version == artifact.program_version()
    assert abs(datetime.fromisoformat(header.date) - datetime.now(UTC)) < timedelta(minutes=5)


def test_file_describes_itself(path: Path) -> None:
    with h5py.File(path) as file:
        assert file.attrs["file_type"] == "poro artifact"
        assert file.attrs["schema_version"] == artifact.SCHEMA_VERSION
        assert file.attrs["complete"]
        described = []
        file.visititems(lambda name, entry: described.append((name, entry)))
        datasets = [entry for _, entry in described if isinstance(entry, h5py.Dataset)]
        assert len(datasets) == len(DATASETS) + 2
        assert all({"units", "description"} <= set(entry.attrs) for entry in datasets)


def test_failed_write_leaves_the_old_file_and_no_other(path: Path) -> None:
    before = path.read_bytes()
    with pytest.raises(TypeError):
        artifact.write(path, HEADER, DATASETS | {"fields/bad": Dataset(np.array([object()]), "", "")})
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_file_of_another_stage_is_refused(path: Path) -> None:
    with pytest.raises(Fault, match=r"'refine'.*'mirror'") as caught:
        artifact.read(path, "mirror", "fields/chi")
    assert caught.value.code == ExitCode.ARTIFACT


def _no_hdf5(path: Path) -> None:
    path.write_text("solid x\nendsolid x\n")


def _empty(path: Path) -> None:
    path.write_bytes(b"")


def _truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def _foreign(path: Path) -> None:
    path.unlink()
    with h5py.File(path, "w") as file:
        file["data"] = np.arange(3)


def _incomplete(path: Path) -> None:
    with h5py.File(path, "a") as file:
        del file.attrs["complete"]


def _newer(path: Path) -> None:
    with h5py.File(path, "a") as file:
        file.attrs["schema_version"] = artifact.SCHEMA_VERSION + 1


def _removed(path: Path) -> None:
    path.unlink()


SPOILT = {
    _no_hdf5: "no HDF5 file",
    _empty: "no HDF5 file",
    _truncated: "cut short",
    _foreign: "no poro artifact",
    _incomplete: "not written to its end",
    _newer: "newer poro",
    _removed: "no such file",
}


@pytest.mark.parametrize("spoil", SPOILT, ids=lambda spoil: spoil.__name__.strip("_"))
def test_unusable_artifact_gives_one_sentence_and_code_4(spoil: Callable[[Path], None], path: Path, poro: Poro) -> None:
    spoil(path)
    for command in (["refine", path], ["export", "--json", path], ["convert", path, "x.vtu"], ["status", path]):
        ended = poro(*command)
        assert ended.code == ExitCode.ARTIFACT
        assert ended.out == ""
        assert ended.err.startswith(f"poro: {path}: ")
        assert SPOILT[spoil] in ended.err
        assert ended.err.count("\n") == 1


@given(st.floats(0.0, 1.0), st.integers(0, 7))
@settings(deadline=None, max_examples=60, derandomize=True)
def test_flipped_bit_is_noticed_or_harmless(tmp_path_factory: pytest.TempPathFactory, place: float, bit: int) -> None:
    path = tmp_path_factory.mktemp("flip") / "x.h5"
    artifact.write(path, HEADER, DATASETS)
    content = bytearray(path.read_bytes())
    content[min(int(place * len(content)), len(content) - 1)] ^= 1 << bit
    path.write_bytes(content)
    try:
        (found,) = artifact.read(path, "refine", "fields/chi")
    except Fault:
        return
    np.testing.assert_array_equal(found, FIELD)
