"""Layers of solids with known sections, their drawings and masks, and the command."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from command_line import Poro
from manifold3d import CrossSection, Manifold
from PIL import Image
from pydantic import ValidationError

from actuator.arrays import Floats
from actuator.failure import EmptySolid, InvalidField, NotManifold
from actuator.geometry.printing.layers import mask
from actuator.geometry.solid import surface_of
from actuator.geometry.zero_set import Surface
from pipeline.exit_codes import ExitCode
from stages import slices

FINE = 256
#: Area of the polygon that stands for a circle, over that of the circle.
FACETED = FINE / (2.0 * np.pi) * np.sin(2.0 * np.pi / FINE)


def cylinder(radius: float, height: float) -> Manifold:
    return Manifold.cylinder(height, radius, radius, FINE)


def ring() -> Manifold:
    """A torus of radii 6 and 2 mm about the z axis."""
    return Manifold.revolve(CrossSection.circle(2.0, FINE).translate((6.0, 0.0)), FINE)


def cut(solid: Manifold, thickness: float = 0.1, direction: str = "z") -> slices.Result:
    surface = surface_of(solid)
    settings = slices.Settings.model_validate({"thickness": thickness, "direction": direction})
    return slices.run(surface.vertices, surface.triangles, settings)


def enclosed(outlines: tuple[Floats, ...]) -> float:
    """Area by the shoelace formula, holes negative."""
    return float(sum(0.5 * np.sum(p[:, 0] * np.roll(p[:, 1], -1) - np.roll(p[:, 0], -1) * p[:, 1]) for p in outlines))


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """A tube along z, 6 mm high, radii 3 and 5 mm, as a file that is not at the origin."""
    surface = surface_of(cylinder(5.0, 6.0) - cylinder(3.0, 6.0))
    return written(surface, tmp_path / "tube.stl")


def written(surface: Surface, path: Path) -> Path:
    mesh = trimesh.Trimesh(surface.vertices + np.array([20.0, -4.0, 7.0]), surface.triangles, process=False)
    path.write_bytes(mesh.export(file_type=path.suffix[1:]))
    return path


def test_cube() -> None:
    result = cut(Manifold.cube([3.0, 2.0, 1.0], True), 0.1)
    np.testing.assert_allclose(result.heights, np.arange(10) * 0.1 + 0.05, atol=1e-12)
    np.testing.assert_allclose(result.areas, 6.0, rtol=1e-7)
    np.testing.assert_array_equal(result.outlines, 1)
    assert result.largest_jump < 1e-6
    assert result.layered_volume == pytest.approx(result.volume, rel=1e-7)
    assert [len(cut(Manifold.cube([3.0, 2.0, 1.0], True), 0.1, d).heights) for d in ("x", "-y")] == [30, 20]


def test_sections_of_a_sphere() -> None:
    radius = 4.0
    result = cut(Manifold.sphere(radius, FINE), 0.25)
    z = result.heights - radius
    np.testing.assert_allclose(result.areas, np.pi * (radius**2 - z**2), rtol=1e-3, atol=1e-3 * radius**2)
    assert result.jump in (0, len(z) - 2)


def test_sections_of_a_torus_have_two_outlines() -> None:
    result = cut(ring(), 0.25)
    half = np.sqrt(4.0 - (result.heights - 2.0) ** 2)
    np.testing.assert_array_equal(result.outlines, 2)
    np.testing.assert_allclose(result.areas, np.pi * ((6.0 + half) ** 2 - (6.0 - half) ** 2), rtol=1e-3)
    outer, hole = sorted((enclosed((outline,)) for outline in result.part.cut(2.0).outlines), reverse=True)
    assert (outer, hole) == (pytest.approx(np.pi * 64.0, rel=1e-3), pytest.approx(-np.pi * 16.0, rel=1e-3))


def test_upright_torus_has_two_outlines_where_its_hole_is() -> None:
    result = cut(ring(), 0.5, "x")
    inside = np.abs(result.heights - 8.0) < 4.0
    np.testing.assert_array_equal(result.outlines, np.where(inside, 2, 1))


def test_tube_jumps_where_it_gets_its_floor() -> None:
    result = cut(cylinder(5.0, 6.0) - cylinder(3.0, 5.0).translate((0.0, 0.0, 1.0)), 0.5)
    assert result.jump == 1
    assert result.largest_jump == pytest.approx(FACETED * np.pi * 9.0, rel=1e-6)
    np.testing.assert_array_equal(result.outlines, [1, 1] + [2] * 10)


@pytest.mark.parametrize("solid", [lambda: Manifold.sphere(4.0, 64), ring])
def test_volume_of_the_layers_converges_at_second_order(solid: Callable[[], Manifold]) -> None:
    results = [cut(solid(), thickness) for thickness in (0.5, 0.125)]
    errors = [abs(result.layered_volume / result.volume - 1.0) for result in results]
    assert errors[0] < 0.03
    assert errors[1] < errors[0] / 7.0


@pytest.mark.parametrize(("direction", "turn"), [("z", 0), ("y", 1), ("x", 2)])
@pytest.mark.parametrize("sign", ["", "-"])
def test_part_and_direction_turned_together_change_nothing(direction: str, turn: int, sign: str) -> None:
    """Axes follow each other in the order x, y, z, x; a part of no symmetry tells a mirror image."""
    solid = Manifold.cube([3.0, 2.0, 4.0]) + Manifold.cube([1.0, 1.0, 1.0]).translate((3.0, 0.5, 0.2))
    reference = cut(solid, 0.3, f"{sign}z")
    surface = surface_of(solid)
    # The part with z where the direction is.
    order = [(column + turn) % 3 for column in range(3)]
    settings = slices.Settings.model_validate({"thickness": 0.3, "direction": f"{sign}{direction}"})
    result = slices.run(surface.vertices[:, order], surface.triangles, settings)
    np.testing.assert_allclose(result.areas, reference.areas, rtol=1e-9)
    for height in (0.5, 3.4):
        one, other = (found.part.cut(height).outlines for found in (reference, result))
        assert {tuple(p) for o in one for p in o.round(5).tolist()} == {
            tuple(p) for o in other for p in o.round(5).tolist()
        }
        assert enclosed(other) == pytest.approx(enclosed(one), rel=1e-9)
        assert enclosed(other) > 0.0


def test_upside_down_reverses_the_layers() -> None:
    solid = cylinder(5.0, 3.0) + Manifold.cube([2.0, 2.0, 4.0])
    np.testing.assert_allclose(cut(solid, 0.25, "-z").areas, cut(solid, 0.25, "z").areas[::-1], rtol=1e-9)


def test_layers_end_where_their_middle_leaves_the_part() -> None:
    for height, count in ((1.0, 10), (1.04, 10), (1.06, 11), (0.04, 0)):
        result = cut(Manifold.cube([1.0, 1.0, height]), 0.1)
        assert len(result.heights) == count
        assert np.all(result.areas > 0.99)


def test_mask_takes_pixels_whose_middle_is_inside() -> None:
    square = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]])
    hole = np.array([[1.0, 1.0], [1.0, 2.0], [2.0, 2.0], [2.0, 1.0]])
    expected = np.array([[1, 0, 1, 0], [1, 1, 1, 0]], dtype=bool)
    np.testing.assert_array_equal(mask((square, hole), np.zeros(2), (2, 4), 1.0), expected)
    assert not mask((), np.zeros(2), (2, 4), 1.0).any()


def test_refusals() -> None:
    cube = surface_of(Manifold.cube([1.0, 1.0, 1.0]))
    with pytest.raises(NotManifold, match="bounds no solid"):
        slices.run(cube.vertices, cube.triangles[1:], slices.Settings())
    with pytest.raises(NotManifold, match="inside out"):
        slices.run(cube.vertices, cube.triangles[:, ::-1], slices.Settings())
    with pytest.raises(EmptySolid, match="no triangles"):
        slices.run(cube.vertices, cube.triangles[:0], slices.Settings())
    with pytest.raises(InvalidField, match="not finite"):
        slices.run(cube.vertices * np.nan, cube.triangles, slices.Settings())
    for wrong in ({"thickness": 0.0}, {"thickness": -0.1}, {"thickness": float("nan")}, {"direction": "up"}):
        with pytest.raises(ValidationError):
            slices.Settings.model_validate(wrong)


@pytest.mark.parametrize("ending", [".stl", ".3mf"])
def test_command_writes_table_and_plot(ending: str, part: Path, poro: Poro) -> None:
    if ending == ".3mf":
        part = written(surface_of(cylinder(5.0, 6.0) - cylinder(3.0, 6.0)), part.with_suffix(".3mf"))
    ended = poro("slice", part, "--layer", 0.5, "--json")
    assert ended.code == 0, ended.err
    found = json.loads(ended.out)
    area = FACETED * np.pi * 16.0
    assert found["layers"] == 12
    assert found["height_mm"] == pytest.approx(6.0)
    assert found["largest_area_mm2"] == pytest.approx(area, rel=1e-5)
    assert found["mean_area_mm2"] == pytest.approx(area, rel=1e-5)
    assert found["volume_by_layers_mm3"] == pytest.approx(found["volume_mm3"], rel=1e-5)
    assert found["most_outlines"] == 2
    table, plot = map(Path, found["files"])
    assert (table.name, plot.name) == ("tube.areas.csv", "tube.areas.png")
    with table.open(encoding="utf-8", newline="") as lines:
        rows = list(csv.DictReader(lines))
    assert [float(row["height_mm"]) for row in rows] == pytest.approx(np.arange(12) * 0.5 + 0.25)
    assert [float(row["area_mm2"]) for row in rows] == pytest.approx([area] * 12, rel=1e-5)
    with Image.open(plot) as picture:
        assert 0.01 < (np.asarray(picture.convert("L")) < 200).mean() < 0.5


def test_command_tells_people_and_draws_vectors(part: Path, poro: Poro) -> None:
    ended = poro("slice", part, "--direction", "-x", "--format", "svg")
    assert ended.code == 0, ended.err
    assert "100 layers of 0.1 mm along -x" in ended.out
    assert re.search(r"^  volume +\d+\.\d+ mm\^3 by layers", ended.out, flags=re.MULTILINE)
    assert "<path" in (part.parent / "details/tube.areas.svg").read_text(encoding="utf-8")


def test_svg_is_the_slice_to_scale(part: Path, poro: Poro) -> None:
    """The tube lies on its side: slices are one rectangle, or two beside its hole."""
    ended = poro("slice", part, "--direction", "x", "--number", 50, "--number", 10, "--height", 9.5, "--json")
    assert ended.code == 0, ended.err
    found = json.loads(ended.out)["slices"]
    assert [entry["outlines"] for entry in found] == [2, 1, 1]
    assert [Path(entry["file"]).name for entry in found] == [
        f"tube.{n}.svg" for n in ("layer-50", "layer-10", "height-9.5")
    ]
    for entry in found:
        root = ElementTree.fromstring(Path(entry["file"]).read_text(encoding="utf-8"))
        assert (root.attrib["width"], root.attrib["height"]) == ("10.000000mm", "6.000000mm")
        x0, y0, width, height = map(float, root.attrib["viewBox"].split())
        assert (width, height) == (10.0, 6.0)
        path = root.find("{http://www.w3.org/2000/svg}path")
        assert path is not None
        assert path.attrib["fill-rule"] == "evenodd"
        pieces = [piece for piece in path.attrib["d"].split("M") if piece.strip()]
        outlines = tuple(
            np.array([[float(x) for x in pair.split(",")] for pair in re.findall(r"-?[\d.]+,-?[\d.]+", piece)])
            for piece in pieces
        )
        corners = np.concatenate(outlines)
        assert np.all((corners >= (x0, y0)) & (corners <= (x0 + width, y0 + height)))
        # SVG's second axis points down, which turns the outlines around.
        assert -enclosed(outlines) == pytest.approx(entry["area_mm2"], rel=1e-6)
        away = entry["height_mm"] - 5.0
        inner = np.sqrt(max(9.0 - away**2, 0.0))
        assert entry["area_mm2"] == pytest.approx(2.0 * 6.0 * (np.sqrt(25.0 - away**2) - inner), rel=2e-3)


@pytest.mark.parametrize("pixel", [0.05, 0.2])
def test_png_is_a_mask_of_the_slice(pixel: float, part: Path, poro: Poro) -> None:
    ended = poro("slice", part, "--number", 7, "--format", "png", "--pixel", pixel, "--json")
    assert ended.code == 0, ended.err
    (entry,) = json.loads(ended.out)["slices"]
    with Image.open(entry["file"]) as picture:
        assert picture.mode == "1"
        assert picture.size == (10.0 / pixel, 10.0 / pixel)
        assert picture.info["dpi"][0] == pytest.approx(25.4 / pixel, rel=1e-3)
        white = np.asarray(picture)
    rim = 2.0 * np.pi * (3.0 + 5.0)
    assert abs(white.sum() * pixel**2 - entry["area_mm2"]) < 0.1 * rim * pixel
    np.testing.assert_array_equal(white, white[::-1, ::-1])


def test_masks_are_the_right_way_up(tmp_path: Path, poro: Poro) -> None:
    """Seen from above: x to the right and y up."""
    solid = Manifold.cube([4.0, 1.0, 1.0]) + Manifold.cube([1.0, 2.0, 1.0])
    path = written(surface_of(solid), tmp_path / "angle.stl")
    assert poro("slice", path, "--height", 0.5, "--format", "png", "--pixel", 1).code == 0
    with Image.open(tmp_path / "details/angle.height-0.5.png") as picture:
        np.testing.assert_array_equal(np.asarray(picture), [[1, 0, 0, 0], [1, 1, 1, 1]])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--number", "0"], "--number 0: the part has layers 1 to 60"),
        (["--number", "5", "--number", "61"], "--number 61: the part has layers 1 to 60"),
        (["--height", "6"], "--height 6: the part is 6 mm high"),
        (["--height", "-0.1"], "--height -0.1: the part is 6 mm high"),
        (["--height", "nan"], "--height nan: the part is 6 mm high"),
        (["--layer", "0"], "--layer: must be greater than or equal to 0.001, not 0"),
        (["--layer", "nan"], "--layer: must be"),
        (["--layer", "20"], "--layer 20: the part is only 6 mm high"),
        (["--number", "5", "--format", "png", "--pixel", "0"], "--pixel 0: must be above 0 mm"),
        (["--number", "5", "--format", "png", "--pixel", "1e-9"], "--pixel 1e-09: must be above 0 mm"),
        (["--direction", "up"], "'up' is not one of"),
        (["--format", "gif"], "'gif' is not one of"),
    ],
)
def test_options_out_of_range_give_one_sentence_and_write_nothing(
    options: list[str], sentence: str, part: Path, poro: Poro
) -> None:
    ended = poro("slice", part, *options)
    assert ended.code == 2
    assert sentence in ended.err
    assert ended.err.count("\n") == 1
    assert ended.out == ""
    assert [path.name for path in part.parent.iterdir()] == ["tube.stl"]


def test_files_that_are_no_solid_give_one_sentence(part: Path, tmp_path: Path, poro: Poro) -> None:
    text = tmp_path / "text.stl"
    text.write_text("this is no solid\n")
    broken = tmp_path / "open.stl"
    broken.write_bytes(part.read_bytes()[:80] + (10).to_bytes(4, "little") + part.read_bytes()[84 : 84 + 500])
    lost = trimesh.load_mesh(part)
    lost.vertices[3] = np.nan
    (tmp_path / "nan.stl").write_bytes(lost.export(file_type="stl"))
    expected = {"absent.stl": 4, "text.stl": 4, "nan.stl": 4, "open.stl": 5, "tube.obj": 2, ".": 2}
    for name, code in expected.items():
        ended = poro("slice", tmp_path / name)
        assert ended.code == code, name
        assert ended.err.count("\n") == 1, name
        assert "Traceback" not in ended.err


def test_absurd_number_of_layers_is_refused_with_it(tmp_path: Path, poro: Poro) -> None:
    trimesh.creation.box((1.0, 1.0, 1.0e4)).export(tmp_path / "tower.stl")
    ended = poro("slice", tmp_path / "tower.stl", "--layer", 0.001)
    assert ended.code == ExitCode.USAGE
    assert ended.err.startswith("poro: --layer 0.001: ")
    assert "1e+07 layers" in ended.err
    assert ended.err.count("\n") == 1
