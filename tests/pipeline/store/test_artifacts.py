"""Artifacts: whole or not there, self-describing, and refused with a sentence when anything is wrong with them."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import Poro, edited
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import artifact, seal
from pipeline.store.artifact import Header
from stages.datasets import Dataset

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
    with edited(path) as file:
        del file.attrs["complete"]


def _newer(path: Path) -> None:
    with edited(path) as file:
        file.attrs["schema_version"] = artifact.SCHEMA_VERSION + 1


def _removed(path: Path) -> None:
    path.unlink()


def _folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def _matlab(path: Path) -> None:
    """As MATLAB's version 7.3 files begin: a text in the user block."""
    path.unlink()
    with h5py.File(path, "w", userblock_size=512) as file:
        file["x"] = np.arange(3.0)
    data = path.read_bytes()
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + data[512:])


def _longer(path: Path) -> None:
    path.write_bytes(path.read_bytes() + b"\0")


def _edited(path: Path) -> None:
    with h5py.File(path, "a") as file:
        file["fields/count"][()] = 8


def _escaping(path: Path) -> None:
    with edited(path) as file:
        del file["case_resolved"]
        file["case_resolved"] = '{"name": "../../x"}'


def _bomb(path: Path) -> None:
    """A petabyte of zeros that takes no room in the file."""
    with edited(path) as file:
        del file["case_text"]
        file.create_dataset("case_text", shape=(1 << 50,), dtype="u1", chunks=(1 << 20,))


def _no_json(path: Path) -> None:
    with edited(path) as file:
        del file["case_resolved"]
        file["case_resolved"] = "{" * 100_000


SPOILT = {
    _no_hdf5: "no HDF5 file",
    _empty: "no HDF5 file",
    _truncated: "cut short",
    _foreign: "no poro artifact",
    _incomplete: "not written to its end",
    _newer: "newer poro",
    _removed: "no such file",
    _folder: "this is a folder",
    _matlab: "no poro artifact",
    _longer: "damaged",
    _edited: "damaged",
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


@pytest.mark.parametrize(("spoil", "part"), [(_bomb, "claims to hold"), (_no_json, "damaged")])
def test_hostile_header_takes_no_memory_and_gives_one_sentence(
    spoil: Callable[[Path], None], part: str, path: Path, poro: Poro
) -> None:
    spoil(path)
    for command in (["refine", path], ["export", "--json", path], ["status", path]):
        ended = poro(*command)
        assert (ended.code, ended.out, ended.err.count("\n")) == (ExitCode.ARTIFACT, "", 1)
        assert part in ended.err


def test_case_inside_an_artifact_cannot_leave_the_folder(path: Path, poro: Poro) -> None:
    _escaping(path)
    ended = poro("mirror", path)
    assert ended.code == ExitCode.ARTIFACT
    assert "may only have letters" in ended.err
    assert list(path.parent.iterdir()) == [path]


@given(st.floats(0.0, 1.0, exclude_max=True), st.integers(0, 7))
@settings(
    deadline=None,
    max_examples=200,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],  # every example writes the file anew
)
def test_flipped_bit_is_refused_wherever_it_is(content: bytes, place: float, bit: int) -> None:
    flipped = bytearray(content)
    flipped[int(place * len(flipped))] ^= 1 << bit
    path = Path("x.h5")
    path.write_bytes(flipped)
    for read in (artifact.read_header, artifact.read_grid, lambda path: artifact.read(path, "refine", "fields/count")):
        with pytest.raises(Fault, match=r"damaged|cut short|no HDF5 file") as caught:
            read(path)
        assert caught.value.code == ExitCode.ARTIFACT


@pytest.fixture
def content(path: Path, monkeypatch: pytest.MonkeyPatch) -> bytes:
    """Bytes of the artifact; its folder is the working folder."""
    monkeypatch.chdir(path.parent)
    return path.read_bytes()


def test_cut_anywhere_is_refused(content: bytes) -> None:
    for length in np.random.default_rng(2).integers(0, len(content), 50):
        Path("x.h5").write_bytes(content[:length])
        with pytest.raises(Fault, match=r"damaged|cut short|no HDF5 file"):
            artifact.read_header(Path("x.h5"))


def test_artifact_of_a_version_without_seals_is_read(content: bytes) -> None:
    Path("x.h5").write_bytes(content[seal.SIZE :])
    assert artifact.read_header(Path("x.h5")).identity == "this run"
    np.testing.assert_array_equal(artifact.read(Path("x.h5"), "refine", "fields/chi")[0], FIELD)
