"""Stage export: the bytes of a file, read back by this program and by independent readers."""

from __future__ import annotations

import io
import json
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import Poro, edited
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.failure import EmptySolid, InvalidField, LooseBodies, NotManifold, UnreadableSolid
from actuator.geometry.distance import distance, separation
from actuator.geometry.zero_set import Surface
from pipeline.exit_codes import ExitCode
from stages import export, mirror
from stages.events import Event, Message

DOMAIN = HalfCylinder(15.0, 15.0, 4, 2, 6)
FORMATS: tuple[export.Format, ...] = ("stl", "3mf")


def part(chi: Floats) -> mirror.Result:
    return mirror.run(DOMAIN, chi, mirror.Settings())


def tube() -> mirror.Result:
    r = np.hypot(DOMAIN.points[:, 1], DOMAIN.points[:, 2])
    return part(r - 6.7)


def stl_corners(data: bytes) -> Floats:
    """Triangle corners (n, 3, 3) of a binary STL, read by its published layout."""
    record = np.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("attribute", "<u2")])
    count = int(np.frombuffer(data, "<u4", 1, 80)[0])
    assert len(data) == 84 + 50 * count
    return np.frombuffer(data, record, count, 84)["corner"].astype(float)


@pytest.mark.parametrize("file_format", FORMATS)
def test_scaled_part_reads_back_as_it_was_written(file_format: export.Format) -> None:
    surface = tube()
    result = export.run(surface.vertices, surface.triangles, export.Settings(scale=1.5, format=file_format))
    assert result.passed
    assert result.watertight
    assert all(result.report["checks"].values())
    size = result.bounding_box[1] - result.bounding_box[0]
    np.testing.assert_allclose(size, [22.5, 45.0, 45.0], rtol=1e-3)
    assert np.hypot(result.vertices[:, 1], result.vertices[:, 2]).max() <= 22.5 * (1.0 + 1e-6)
    unscaled = trimesh.Trimesh(surface.vertices, surface.triangles, process=False).volume
    assert result.volume == pytest.approx(1.5**3 * unscaled, rel=1e-5)
    foreign = trimesh.load_mesh(io.BytesIO(result.data), file_type=file_format)
    assert foreign.is_watertight
    assert foreign.volume == pytest.approx(result.volume, rel=1e-6)
    assert foreign.euler_number == 0
    assert json.loads(json.dumps(result.report)) is not None


def test_stl_is_binary_symmetric_and_outward() -> None:
    surface = tube()
    corners = stl_corners(export.run(surface.vertices, surface.triangles, export.Settings(scale=1.5)).data)
    assert len(corners) == len(surface.triangles)
    points = np.unique(corners.reshape(-1, 3) + 0.0, axis=0)
    np.testing.assert_array_equal(points, np.unique(points * (1.0, -1.0, 1.0) + 0.0, axis=0))
    volume = np.linalg.det(corners).sum() / 6.0
    assert volume > 0.0


@pytest.mark.parametrize("name", ["actuator-2", "solid", "µ" * 100, ""])
def test_file_says_what_it_is(name: str) -> None:
    surface = tube()
    stl = export.run(surface.vertices, surface.triangles, export.Settings(scale=1.5), name=name).data
    assert stl[:80].decode("ascii").startswith(f"poro: {name.replace('µ', '?') or 'part'}"[:80])
    assert len(stl_corners(stl)) == len(surface.triangles)
    settings = export.Settings(scale=1.5, format="3mf")
    data = export.run(surface.vertices, surface.triangles, settings, name=name).data
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        model = archive.read("3D/3dmodel.model").decode()
    assert f"{name or 'part'}, scale 1.5, mm" in model


def test_3mf_is_in_millimetres() -> None:
    surface = tube()
    data = export.run(surface.vertices, surface.triangles, export.Settings(format="3mf")).data
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        model = archive.read("3D/3dmodel.model").decode()
    assert 'unit="millimeter"' in model
    assert model.count("<triangle ") == len(surface.triangles)


def test_inspection_respects_the_unit_of_a_3mf() -> None:
    surface = tube()
    data = export.run(surface.vertices, surface.triangles, export.Settings(format="3mf")).data
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    files["3D/3dmodel.model"] = files["3D/3dmodel.model"].replace(b'unit="millimeter"', b'unit="inch"')
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    found = export.inspect(stream.getvalue(), "3mf")
    assert found.bounding_box[1][0] == pytest.approx(15.0 * 25.4, rel=1e-6)


@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    noisy=st.booleans(),
    scale=st.floats(0.1, 20.0),
    file_format=st.sampled_from(FORMATS),
)
def test_round_trip_of_random_parts(seed: int, noisy: bool, scale: float, file_format: export.Format) -> None:
    rng = np.random.default_rng(seed)
    waves = np.cos(DOMAIN.points @ rng.normal(scale=0.2, size=(3, 4)) + rng.uniform(0.0, 6.0, 4)).sum(axis=1)
    chi = rng.normal(size=len(waves)) if noisy else waves
    chi[40] = 1.0
    surface = part(chi)
    anything = export.Settings(format=file_format, most_removed=1.0)
    one = export.run(surface.vertices, surface.triangles, anything)
    scaled = export.run(surface.vertices, surface.triangles, anything.model_copy(update={"scale": scale}))
    assert one.passed
    assert scaled.passed
    assert scaled.volume == pytest.approx(scale**3 * one.volume, rel=1e-4)
    assert len(scaled.report["islands"]) == len(one.report["islands"])


def ball(domain: HalfCylinder, radius: float, *centre: float) -> Floats:
    return radius - np.linalg.norm(domain.points - centre, axis=1)


def balls() -> mirror.Result:
    """A hollow ball on the symmetry plane, and a hollow and a full one on either side of it."""
    domain = DOMAIN.refined(3)
    large = np.minimum(ball(domain, 5.0, 7.5, 0.0, -5.0), -ball(domain, 2.0, 7.5, 0.0, -5.0))
    hollow = np.minimum(ball(domain, 3.0, 7.5, 7.0, 6.0), -ball(domain, 1.5, 7.5, 7.0, 6.0))
    return mirror.run(domain, np.maximum(large, hollow), mirror.Settings())


def test_islands_are_removed_and_listed_and_cavities_kept() -> None:
    surface = balls()
    heard: list[Event] = []
    settings = export.Settings(scale=2.0, most_removed=0.3)
    result = export.run(surface.vertices, surface.triangles, settings, heard.append)
    small, hole, large = (8.0 * 4.0 / 3.0 * np.pi * r**3 for r in (3.0, 2.0, 5.0))
    assert result.passed
    islands = result.report["islands"]
    assert [island["volume"] for island in islands] == pytest.approx([small, small], rel=0.1)
    centres = sorted(island["centre"] for island in islands)
    np.testing.assert_allclose(centres, [[15.0, -14.0, 12.0], [15.0, 14.0, 12.0]], atol=0.2)
    # The islands' own cavities went with them.
    assert result.report["file"]["cavities"] == pytest.approx([hole], rel=0.25)
    assert result.report["file"]["bodies"] == pytest.approx([large], rel=0.1)
    assert result.volume == pytest.approx(large - hole, rel=0.1)
    assert any(isinstance(event, Message) and "2 floating islands removed" in event.text for event in heard)


def test_islands_can_be_refused() -> None:
    surface = balls()
    with pytest.raises(LooseBodies, match=r"2 bodies float .* 1\d\d mm³ at \(7\.5, -?7\.\d, 6\.\d\) mm.*remove"):
        export.run(surface.vertices, surface.triangles, export.Settings(islands="refuse"))
    whole = tube()
    assert export.run(whole.vertices, whole.triangles, export.Settings(islands="refuse")).passed


def test_islands_that_are_much_of_the_part_are_not_removed_unless_allowed(folder: Path, poro: Poro) -> None:
    """A part of three bodies, the largest of which has most of the volume but not nearly all."""
    before = (folder / "tiny/tiny.stl").read_bytes()
    with edited(folder / "tiny/details/tiny.solid.h5") as file:
        points, triangles = file["surface/points"][()], file["surface/connectivity"][()]
        cubes = [
            trimesh.creation.box((5.0, 5.0, 5.0), trimesh.transformations.translation_matrix((7.5, y, -30.0)))
            for y in (-9.0, 9.0)
        ]
        for cube in cubes:
            triangles = np.append(triangles, np.asarray(cube.faces).ravel() + len(points))
            points = np.concatenate([points, cube.vertices])
        for name, values in (("points", points), ("connectivity", triangles)):
            del file[f"surface/{name}"]
            file[f"surface/{name}"] = values
    ended = poro("export", "tiny.solid.h5", "--force")
    assert ended.code == ExitCode.BAD_SOLID
    share = float(re.search(r"2 bodies float beside the part and are (.*?) % of the volume", ended.err)[1])
    assert share == pytest.approx(100.0 * 250.0 / (250.0 + trimesh.load("tiny/tiny.stl").volume), rel=1e-2)
    assert "125 mm³ at (7.5, -9.0, -30.0) mm" in ended.err
    assert (folder / "tiny/tiny.stl").read_bytes() == before
    ended = poro("export", "tiny.solid.h5", "--most-removed", 0.5)
    assert ended.code == ExitCode.OK, ended.err
    assert re.search(r"bodies removed +2, together 250\.00 mm", ended.out)
    assert poro("export", "tiny.solid.h5", "--force").code == ExitCode.BAD_SOLID


@pytest.mark.parametrize("tolerance", [0.02, 0.2])
def test_decimation_stays_within_its_tolerance(tolerance: float) -> None:
    domain = DOMAIN.refined(2)
    waves = np.cos(domain.points @ np.array([0.4, 0.5, 0.3])) - 0.2
    surface = mirror.run(domain, waves, mirror.Settings())
    whole = export.Settings(most_removed=1.0)
    exact = export.run(surface.vertices, surface.triangles, whole)
    coarse = export.run(surface.vertices, surface.triangles, whole.model_copy(update={"decimation": tolerance}))
    assert coarse.passed
    assert coarse.report["decimated"] == len(exact.triangles) - len(coarse.triangles) > 0
    assert exact.report["decimated"] == 0

    one, other = Surface(exact.vertices, exact.triangles), Surface(coarse.vertices, coarse.triangles)
    rng = np.random.default_rng(0)
    anywhere = rng.dirichlet((1.0, 1.0, 1.0), len(other.triangles))
    inside = np.einsum("ni,nij->nj", anywhere, other.vertices[other.triangles])
    assert distance(inside, one).max() <= 1.05 * tolerance
    assert coarse.report["moved"] == pytest.approx(separation(one, other), rel=1e-3)
    assert 0.0 < coarse.report["moved"] <= tolerance
    assert coarse.volume == pytest.approx(exact.volume, rel=0.02)


def test_inspection_finds_a_hole_and_a_turned_triangle() -> None:
    surface = tube()
    open_mesh = trimesh.Trimesh(surface.vertices, surface.triangles[1:], process=False)
    found = export.inspect(open_mesh.export(file_type="stl"), "stl")
    assert not found.watertight
    turned = surface.triangles.copy()
    turned[0] = turned[0, ::-1]
    turned_mesh = trimesh.Trimesh(surface.vertices, turned, process=False)
    found = export.inspect(turned_mesh.export(file_type="stl"), "stl")
    assert found.watertight
    assert not found.winding_consistent


def test_inspection_reads_ascii_stl() -> None:
    cube = trimesh.creation.box((1.0, 2.0, 3.0))
    found = export.inspect(cube.export(file_type="stl_ascii").encode(), "stl")
    assert found.watertight
    assert found.volume == pytest.approx(6.0)
    assert found.area == pytest.approx(22.0)
    assert (found.vertices, found.triangles, found.euler_number) == (8, 12, 2)


@pytest.mark.parametrize("file_format", FORMATS)
@pytest.mark.parametrize("damage", ["empty", "text", "truncated", "random"])
def test_inspection_refuses_what_it_cannot_read(file_format: export.Format, damage: str) -> None:
    surface = tube()
    data = export.run(surface.vertices, surface.triangles, export.Settings(format=file_format, most_removed=1.0)).data
    damaged = {
        "empty": b"",
        "text": b"this is no solid\n",
        "truncated": data[: len(data) // 2],
        "random": np.random.default_rng(0).bytes(500),
    }[damage]
    with pytest.raises(UnreadableSolid, match=file_format):
        export.inspect(damaged, file_format)


def test_refusals() -> None:
    surface = tube()
    with pytest.raises(NotManifold, match="bound no solid"):
        export.run(surface.vertices, surface.triangles[1:], export.Settings())
    with pytest.raises(EmptySolid, match="no triangles"):
        export.run(surface.vertices, surface.triangles[:0], export.Settings())
    with pytest.raises(InvalidField, match="not finite"):
        export.run(surface.vertices * np.nan, surface.triangles, export.Settings())


@pytest.mark.parametrize(
    "values",
    [
        {"scale": 0.0},
        {"scale": -1.0},
        {"format": "obj"},
        {"size": 1.0},
        {"islands": "keep"},
        {"decimation": -1.0},
        {"most_removed": 1.1},
    ],
)
def test_settings_are_checked(values: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        export.Settings.model_validate(values)
