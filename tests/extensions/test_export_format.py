"""A file format of another program: one entry of the registry, and the part is written, read and checked in it."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
import trimesh
from command_line import TINY, Poro

from pipeline.exit_codes import ExitCode
from pipeline.store.files import Files
from stages.formats import FORMATS, by_trimesh

HERE = ("--output", ".")


@pytest.fixture(autouse=True)
def off() -> Iterator[None]:
    """OFF is registered."""
    with FORMATS.registered("off", by_trimesh("off")):
        yield


@pytest.mark.usefixtures("undrawn")
def test_part_is_written_in_it_and_read_back_closed(folder: Path, poro: Poro) -> None:
    ended = poro("export", "tiny.yaml", *HERE, "--format", "off", "--json")
    assert ended.code == ExitCode.OK, ended.err
    found = json.loads(ended.out)
    assert found["export"]["file"] == "tiny.off"
    mesh = trimesh.load_mesh(folder / "tiny/tiny.off")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(trimesh.load_mesh(folder / "tiny/tiny.stl").volume, rel=1e-5)
    assert "up to date" in poro("export", "tiny.yaml", *HERE, "--format", "off").err.splitlines()[-1]
    checked = poro("check", "tiny.off", "--pitch", 1.0, "--json")
    assert checked.code in (ExitCode.OK, ExitCode.BAD_SOLID), checked.err
    assert json.loads(checked.out)["triangles"] == len(mesh.faces)
    assert poro("slice", "tiny.off", "--layer", 1.0).code == ExitCode.OK


def test_case_file_schema_names_and_messages_know_it(poro: Poro, tmp_path: Path) -> None:
    schema = json.loads(poro("schema").out)
    (section,) = (found for found in schema["$defs"].values() if found["title"] == "Section export")
    assert section["properties"]["format"]["enum"] == ["stl", "3mf", "off"]
    Path("case.yaml").write_text(TINY + "export: {format: obj}\n")
    assert "export.format: must be 'stl', '3mf' or 'off', not the text 'obj'" in poro("export", "case.yaml").err
    Path("case.yaml").write_text("name: x.off\n")
    assert "must not end in .off" in poro("export", "case.yaml").err
    files = Files(tmp_path, "tiny", "tiny.off")
    assert files.owns("tiny.off.h5")
    assert files.owns("tiny.scale-1.5.off")
    assert not files.owns("tiny.obj")
    assert "the ending must be .stl or .3mf or .off" in poro("check", "part.obj").err


def test_damaged_file_is_refused(poro: Poro) -> None:
    data = trimesh.creation.box().export(file_type="off")
    assert trimesh.load_mesh(io.BytesIO(data.encode()), file_type="off").is_watertight
    Path("part.off").write_text(data[: len(data) // 2])
    ended = poro("check", "part.off")
    assert ended.code == ExitCode.ARTIFACT
    assert ended.err.count("\n") == 1
