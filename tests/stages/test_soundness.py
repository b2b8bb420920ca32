"""Whether triangles bound a solid, and how large: one answer of `poro check`, `poro slice` and `poro inflate`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import Poro
from solid_files import ascii_stl, cube, stl

from actuator.geometry.crossings import crossings
from actuator.geometry.merging import merged
from actuator.geometry.zero_set import Surface
from pipeline.exit_codes import ExitCode


def verdicts(poro: Poro, data: bytes | str) -> tuple[dict[str, dict[str, object]], list[str]]:
    """Findings of `check` by name, and what `slice` and `inflate` say on standard error."""
    Path("part.stl").write_bytes(data.encode() if isinstance(data, str) else data)
    found = json.loads(poro("check", "part.stl", "--json", "--no-save", "--pitch", 1).out)["findings"]
    said = [poro(command, "part.stl").err for command in ("slice", "inflate")]
    return {finding["name"]: finding for finding in found}, said


def noisy(text: str) -> str:
    """Every second zero of an ASCII STL as what cancellation leaves of it."""
    pieces = text.split(" 0 ")
    return (
        "".join(piece + (" 3e-17 " if number % 2 else " 0 ") for number, piece in enumerate(pieces[:-1])) + pieces[-1]
    )


@pytest.mark.parametrize(("corner", "within"), [(0.0, 1e-5), (1000.0, 1e-2)])
def test_vertices_are_merged_within_a_stated_distance(corner: float, within: float, poro: Poro) -> None:
    """Zeros that are not quite, and far from the origin six digits."""
    text = noisy(ascii_stl(cube()))
    if corner:
        solid = cube(10.0, corner, 0.0, 0.0)
        shaken = solid.triangles + np.random.default_rng(0).uniform(-2e-3, 2e-3, solid.triangles.shape)
        text = ascii_stl(trimesh.Trimesh(shaken.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False))
    found, said = verdicts(poro, text)
    assert found["closed surface"]["verdict"] == "pass"
    assert found["closed surface"]["measured"]["merged_within"] == pytest.approx(within, rel=0.02)
    assert f"when vertices within {within:.1g} mm are merged" in found["closed surface"]["text"]
    assert found["volume and mass"]["measured"]["volume"] == pytest.approx(1000.0, rel=1e-3)
    assert all(f"vertices within {within:.1g} mm merged" in err for err in said)


def test_what_is_farther_apart_is_open_to_all(poro: Poro) -> None:
    solid = cube()
    vertices = solid.triangles.reshape(-1, 3).copy()
    vertices[0] += 2e-3
    found, said = verdicts(poro, ascii_stl(trimesh.Trimesh(vertices, np.arange(36).reshape(-1, 3), process=False)))
    text = str(found["closed surface"]["text"]).removesuffix(".")
    assert "open edges" in text
    assert all(f"part.stl: {text}; repair the part" in err for err in said)
    assert poro("slice", "part.stl").code == poro("inflate", "part.stl").code == ExitCode.BAD_SOLID


def test_near_vertices_of_a_closed_surface_stay(poro: Poro) -> None:
    two = trimesh.util.concatenate([cube(10.0), cube(10.0, 10.0 + 5e-6, 0.0, 0.0)])
    found = merged(np.asarray(two.vertices), np.asarray(two.faces))
    assert (found.within, len(found.surface.vertices)) == (0.0, 16)


def inward(solid: trimesh.Trimesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(solid.vertices, solid.faces[:, ::-1], process=False)


INNER = cube(4.0, 3.0, 3.0, 3.0)


@pytest.mark.parametrize(
    ("solids", "turned", "bodies", "cavities", "volume"),
    [
        ([cube(), inward(cube(4.0, 20.0, 0.0, 0.0))], [64.0], [1000.0, 64.0], [], 1064.0),
        ([cube(), inward(INNER)], [], [1000.0], [64.0], 936.0),
        ([cube(), inward(INNER), cube(2.0, 4.0, 4.0, 4.0)], [], [1000.0, 8.0], [64.0], 944.0),
        ([cube(), inward(INNER), inward(cube(2.0, 4.0, 4.0, 4.0))], [8.0], [1000.0, 8.0], [64.0], 944.0),
        ([inward(cube()), INNER], [1000.0, -64.0], [1000.0], [64.0], 936.0),
        ([inward(cube())], [1000.0], [1000.0], [], 1000.0),
    ],
)
def test_a_body_is_told_from_a_cavity_by_what_is_around_it(
    solids: list[trimesh.Trimesh],
    turned: list[float],
    bodies: list[float],
    cavities: list[float],
    volume: float,
    poro: Poro,
) -> None:
    found, said = verdicts(poro, stl(*solids))
    assert found["closed surface"]["measured"]["inverted"]["volumes"] == pytest.approx(turned)
    assert found["closed surface"]["verdict"] == ("fail" if turned else "pass")
    assert found["one body"]["measured"]["volumes"] == pytest.approx(bodies)
    assert found["closed cavities"]["measured"]["volumes"] == pytest.approx(cavities)
    assert found["volume and mass"]["measured"]["volume"] == pytest.approx(volume)
    assert found["crossings"]["verdict"] == "pass"
    assert all(("inside out" in err) is bool(turned) for err in said)


@pytest.mark.parametrize(
    ("solids", "text"),
    [
        ([cube(), cube(10.0, 4.0, 3.0, 2.0)], "The surface goes through itself"),
        ([cube(), cube(10.0, 4.0, 0.0, 0.0)], "Bodies overlap: 1000.0 mm³ at"),
        ([cube(), INNER], "Bodies overlap: 64 mm³ at (5.00, 5.00, 5.00)"),
    ],
)
def test_bodies_that_overlap_are_no_solid(solids: list[trimesh.Trimesh], text: str, poro: Poro) -> None:
    found, said = verdicts(poro, stl(*solids))
    assert found["crossings"]["verdict"] == "fail"
    assert str(found["crossings"]["text"]).startswith(text)
    assert all(text in err for err in said)


def found_in(mesh: trimesh.Trimesh) -> int:
    return crossings(merged(np.asarray(mesh.vertices), np.asarray(mesh.faces)).surface).pairs


def test_a_surface_that_goes_through_itself_is_found_wherever_it_lies() -> None:
    ball = trimesh.creation.icosphere(3)
    assert found_in(ball) == 0
    vertices = ball.vertices.copy()
    vertices[:, 0] = np.where(vertices[:, 0] > 0.5, -vertices[:, 0] - 0.2, vertices[:, 0])
    counts = [found_in(trimesh.Trimesh(np.roll(vertices, k, axis=1) + k, ball.faces, process=False)) for k in range(3)]
    assert counts[0] > 50
    assert counts == [counts[0]] * 3


def test_a_bow_tie_crosses_though_its_edges_meet() -> None:
    corners = np.array([(0, 0), (10, 10), (10, 0), (0, 10)], dtype=float)
    vertices = np.concatenate([np.insert(corners, 2, z, axis=1) for z in (0.0, 5.0)])
    sides = [(k, (k + 1) % 4) for k in range(4)]
    faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)]
    faces += [each for a, b in sides for each in ((a, b, b + 4), (a, b + 4, a + 4))]
    assert crossings(Surface(vertices, np.array(faces))).pairs >= 1


@pytest.mark.parametrize("gap", [0.0, 1e-6, -1e-6, 0.1])
def test_bodies_that_touch_do_not_cross(gap: float) -> None:
    assert found_in(trimesh.util.concatenate([cube(10.0), cube(6.0, 10.0 + gap, 2.0, 2.0)])) == 0


# ------------------------------------------------------------------------------------------------ units


@pytest.mark.parametrize(("size", "unit", "length"), [(0.01, "m", 10.0), (1.7, "inch", 43.18), (42_000.0, "um", 42.0)])
def test_a_part_of_no_likely_size_is_asked_for_its_unit(size: float, unit: str, length: float, poro: Poro) -> None:
    Path("part.stl").write_bytes(stl(cube(size)))
    for command in ("check", "slice", "inflate", "status"):
        ended = poro(command, "part.stl")
        assert ended.code == ExitCode.BAD_SOLID
        assert ended.out == ""
        assert f"part.stl: the part would be {size:.3g} mm long" in ended.err
        assert f"{unit} ({length:.3g} mm)" in ended.err
        assert "--unit mm if that is right" in ended.err
    ended = poro("check", "part.stl", "--unit", unit, "--json", "--pitch", 2)
    assert ended.code == ExitCode.OK, ended.err
    found = json.loads(ended.out)
    assert found["size"] == pytest.approx([length] * 3, rel=1e-5)
    assert found["unit"] == unit
    sliced = json.loads(poro("slice", "part.stl", "--unit", unit, "--layer", 1, "--json").out)
    assert sliced["height_mm"] == pytest.approx(length, rel=1e-5)
    assert "The solid does not hold air" in poro("inflate", "part.stl", "--unit", unit).err
    assert poro("check", "part.stl", "--unit", "mm", "--no-save", "--pitch", size / 10.0).code == ExitCode.OK


def test_a_unit_goes_with_what_has_none(poro: Poro) -> None:
    Path("part.3mf").write_bytes(trimesh.Scene(cube(1.0)).export(file_type="3mf"))
    assert poro("check", "part.3mf", "--pitch", 0.5).code == ExitCode.OK
    assert "part.3mf says its unit itself" in poro("check", "part.3mf", "--unit", "inch").err
    Path("case.yaml").write_text("name: a\n")
    assert "--unit inch: goes with a solid" in poro("inflate", "case.yaml", "--unit", "inch").err
