"""Regions of a case from its file to the part: what stays solid and void, and what is refused with its line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import TO_PART, Poro
from shapes import block, surface

import poro as door
from actuator.arrays import Floats
from actuator.geometry.distance import signed_distance
from actuator.geometry.zero_set import Surface
from pipeline.exit_codes import ExitCode
from pipeline.store import artifact
from stages.formats import FORMATS

MESH = "domain: {core_cells: 4, rings: 2, layers: 6}\noptimizer: {max_updates: 1}\n"
#: A flange with a hole for the hose and, on either side, one for a screw; and the wall around, of at least 2 mm.
FLANGE = f"""{MESH}\
objective: {{strain_energy_shift: 4/L_i}}
mirror: {{threshold: -0.5}}
regions:
  - {{kind: solid, shape: box, corner: [0.0, -15.0, -15.0], opposite: [3.0, 15.0, 15.0]}}
  - {{kind: solid, shape: skin, surface: outside, thickness: 2.0}}
  - {{kind: free, shape: cylinder, start: [-1.0, 0.0, 0.0], end: [5.0, 0.0, 0.0], radius: 5.0}}
  - {{kind: free, shape: cylinder, start: [-1.0, 9.5, 0.0], end: [5.0, 9.5, 0.0], radius: 2.5}}
  - {{kind: void, shape: cylinder, start: [-1.0, 9.5, 0.0], end: [5.0, 9.5, 0.0], radius: 2.5}}
"""
RUN = ("--output", ".", "--threads", 1)


def places() -> Floats:
    """Points of the whole cylinder, none of them within 0.3 mm of its surface."""
    rng = np.random.default_rng(4)
    radius, angle = 14.7 * np.sqrt(rng.uniform(0.0, 1.0, 6000)), rng.uniform(0.0, 2.0 * np.pi, 6000)
    return np.column_stack([rng.uniform(0.3, 14.7, 6000), radius * np.cos(angle), radius * np.sin(angle)])


def in_part(path: Path, points: Floats) -> Floats:
    part = trimesh.load_mesh(path)
    assert part.is_watertight
    return signed_distance(points, Surface(np.asarray(part.vertices), np.asarray(part.faces))) < 0.0


def test_what_stays_solid_is_in_the_exported_part_and_what_stays_void_is_not(poro: Poro) -> None:
    Path("flange.yaml").write_text(FLANGE)
    ended = poro("run", "flange.yaml", *TO_PART, *RUN)
    assert ended.code == ExitCode.OK, ended.err
    assert "share of the solid regions that is void" in ended.out
    points = places()
    x1, radii = points[:, 0], np.hypot(points[:, 1], points[:, 2])
    # Distance to the axis of the nearer screw: the one of the file or its mirror image.
    screw = np.hypot(np.abs(points[:, 1]) - 9.5, points[:, 2])
    found, margin = in_part(Path("flange/flange.stl"), points), 0.5  # a sixth of an edge of the finer mesh and more
    flange = (x1 < 3.0 - margin) & (radii > 5.0 + margin)
    skin = radii > 13.0 + margin
    solid = (flange | skin) & (screw > 2.5 + margin)
    hole = (screw < 2.5 - margin) & (x1 < 5.0 - margin)
    assert solid.sum() > 500
    assert hole.sum() > 30
    assert found[solid].all()
    assert not found[hole].any()
    # The holes go through, and the inlet is free.
    assert not found[radii < 4.0].any()
    assert not poro("status", "flange.yaml", "--output", ".", "--json").err
    steps = json.loads(poro("status", "flange.yaml", "--json", "--output", ".").out)["steps"]
    assert [step["runs"] for step in steps] == [*[False] * 5, True]  # all but inflating
    for command, *options in (("check",), ("plot", "--only", "section"), ("report",)):
        part = "flange/flange.stl" if command == "check" else "flange.yaml"
        assert poro(command, part, *options, *(() if command == "check" else ("--output", "."))).code == ExitCode.OK


def test_a_changed_region_is_a_reason_and_an_empty_list_is_none(folder: Path, poro: Poro) -> None:
    def reasons() -> list[str]:
        ended = poro("run", "tiny.yaml", "--until", "optimize", "--output", ".", "--dry-run", "--json")
        assert ended.code == ExitCode.OK, ended.err
        found: list[str] = json.loads(ended.out)["steps"][0]["reasons"]
        return found

    text = (folder / "tiny.yaml").read_text()
    (folder / "tiny.yaml").write_text(text + "regions: []\n")
    assert not reasons()
    (folder / "tiny.yaml").write_text(
        text + "regions: [{kind: void, shape: sphere, centre: [1 cm, 9.0, 0.0], radius: 3.0}]\n"
    )
    (reason,) = reasons()
    assert reason.startswith("settings changed: regions.0.centre unset → [10.0, 9.0, 0.0]")


def test_a_body_from_a_file_is_known_by_what_it_holds_and_goes_with_the_design(poro: Poro, tmp_path: Path) -> None:
    case = MESH + "regions:\n  - {kind: solid, shape: file, file: BODY}\n"
    (tmp_path / "cases").mkdir()
    body = tmp_path / "cases/body.stl"
    body.write_bytes(FORMATS["stl"].write(surface(block(6.0, 6.0, 6.0, 7.0, 9.0, 0.0)), "body"))
    file = tmp_path / "cases/block.yaml"
    file.write_text(case.replace("BODY", "body.stl"))
    assert poro("optimize", "cases/block.yaml", *RUN).code == ExitCode.OK
    shutil.move(body, tmp_path / "elsewhere.stl")
    file.write_text(case.replace("BODY", "../elsewhere.stl"))
    assert "optimize: up to date" in poro("optimize", "cases/block.yaml", *RUN).err
    (tmp_path / "elsewhere.stl").unlink()
    # The part is made of the design alone.
    ended = poro("run", "block/block.h5", "--until", "mirror")
    assert ended.code == ExitCode.OK, ended.err
    vertices, connectivity = artifact.read(
        Path("block/details/block.solid.h5"), "mirror", "surface/points", "surface/connectivity"
    )
    points = np.random.default_rng(1).uniform([4.5, 6.5, -2.5], [9.5, 11.5, 2.5], (200, 3))
    for side in (1.0, -1.0):
        assert (signed_distance(points * (1.0, side, 1.0), Surface(vertices, connectivity.reshape(-1, 3))) < 0.0).all()
    # From Python as well, where the result holds what the file did.
    design = door.load("block/block.h5")
    refined = door.refine(design.case, design)
    np.testing.assert_array_equal(
        refined.chi, artifact.read(Path("block/details/block.refined.h5"), "refine", "vertices/chi")[0]
    )


@pytest.mark.parametrize(
    ("entries", "line", "sentence"),
    [
        ("{kind: solid, shape: blob}", 4, "regions.0.shape: 'blob' is unknown; write one of 'box', 'cylinder'"),
        ("{kind: solid, radius: 2.0}", 4, "regions.0.shape: is missing; write one of 'box'"),
        ("{kind: firm, shape: sphere, centre: [7.0, 9.0, 0.0], radius: 2.0}", 4, "regions.0.kind: must be 'void', 'so"),
        (
            "{kind: void, shape: sphere, centre: [7.0, 9.0], radius: 2.0}",
            4,
            "regions.0.centre: must have at least 3 entries, not 2",
        ),
        ("{kind: void, shape: sphere, centre: [7 kPa, 9.0, 0.0], radius: 2.0}", 4, "'7 kPa' is a pressure"),
        ("{kind: void, shape: sphere, centre: [7.0, 9.0, 0.0], size: 2.0}", 4, "regions.0.size: unknown key"),
        ("{kind: void, shape: box, corner: [0.0, 6.0, 1.0], opposite: [9.0, 6.0, 4.0]}", 4, "the box is flat"),
        ("{kind: void, shape: cylinder, start: [0.0, 6.0, 1.0], end: [0.0, 6.0, 1.0], radius: 2.0}", 4, "same point"),
        ("{kind: solid, shape: sphere, centre: [7.0, 0.0, 0.0], radius: 3.0}", 4, "regions.0: is solid and covers the"),
        (
            "{kind: void, shape: sphere, centre: [70.0, 9.0, 0.0], radius: 2.0}",
            4,
            "regions.0: contains no vertex of the",
        ),
        (
            "{kind: solid, shape: sphere, centre: [7.0, 9.0, 0.0], radius: 3.0}\n"
            "  - {kind: void, shape: sphere, centre: [7.0, 11.0, 0.0], radius: 3.0}",
            5,
            "regions.1: is void and overlaps regions.0, which is solid",
        ),
        ("{kind: solid, shape: file, file: none.stl}", 4, "regions.0.file: "),
    ],
)
def test_what_cannot_be_is_refused_in_one_sentence_with_its_line(
    entries: str, line: int, sentence: str, poro: Poro
) -> None:
    Path("bad.yaml").write_text(f"{MESH}regions:\n  - {entries}\n")
    ended = poro("optimize", "bad.yaml", *RUN)
    assert ended.code == (ExitCode.ARTIFACT if "none.stl" in entries else ExitCode.USAGE), ended.err
    (said,) = ended.err.strip().splitlines()[-1:]
    assert f"bad.yaml:{line}: " in said
    assert sentence in said
    assert "Traceback" not in ended.err


def test_open_triangles_are_no_body(poro: Poro) -> None:
    part = trimesh.Trimesh(*(lambda s: (s.vertices, s.triangles[1:]))(surface(block(6.0, 6.0, 6.0, 7.0, 9.0, 0.0))))
    part.export("open.stl")
    Path("bad.yaml").write_text(f"{MESH}regions:\n  - {{kind: solid, shape: file, file: open.stl}}\n")
    ended = poro("optimize", "bad.yaml", *RUN)
    assert ended.code == ExitCode.BAD_SOLID
    assert "regions.0: The surface bounds no solid" in ended.err


def test_a_list_is_not_changed_on_the_command_line(poro: Poro) -> None:
    Path("flange.yaml").write_text(FLANGE)
    ended = poro("optimize", "flange.yaml", *RUN, "--set", "regions.0.kind=void")
    assert ended.code == ExitCode.USAGE
    assert "--set: regions.0.kind: is in a list; change it in the case file." in ended.err


def test_a_new_case_has_them_with_their_meanings(poro: Poro) -> None:
    Path("flange.yaml").write_text(FLANGE)
    assert poro("new", "other", "--like", "flange.yaml").code == ExitCode.OK
    assert door.read_case("other.yaml").regions == door.read_case("flange.yaml").regions
    assert "thickness: 2.0                    # largest distance from it [mm]" in Path("other.yaml").read_text()
