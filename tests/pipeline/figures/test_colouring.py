"""The printed shape in colour, read back by a library that did not write it."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import meshio
import numpy as np
import pytest
from command_line import Poro

from pipeline.results.design import read_design
from pipeline.store import contents


def glb_extent(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Bounding box of a GLB, from the accessor of its positions (glTF 2.0, section 5.1)."""
    data = path.read_bytes()
    length, kind = struct.unpack_from("<I4s", data, 12)
    assert (data[:4], kind) == (b"glTF", b"JSON")
    document = json.loads(data[20 : 20 + length])
    primitive = document["meshes"][0]["primitives"][0]["attributes"]
    assert "COLOR_0" in primitive
    accessor = document["accessors"][primitive["POSITION"]]
    return np.array(accessor["min"]), np.array(accessor["max"])


def test_glb_is_upright_and_in_metres(folder: Path, poro: Poro) -> None:
    assert poro("convert", "tiny.h5", "talk.glb", "--colour", "pressure").code == 0
    low, high = glb_extent(folder / "talk.glb")
    points, _ = contents.surface(folder / "tiny/details/tiny.solid.h5")
    expected = 1e-3 * points[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
    np.testing.assert_allclose(low, expected.min(axis=0), atol=1e-8)
    np.testing.assert_allclose(high, expected.max(axis=0), atol=1e-8)


def test_colours_are_those_of_the_field(folder: Path, poro: Poro) -> None:
    from matplotlib import colormaps

    assert poro("convert", "tiny.h5", "talk.ply", "--colour", "pressure").code == 0
    found = meshio.read(folder / "talk.ply")
    points, _ = contents.surface(folder / "tiny/details/tiny.solid.h5")
    np.testing.assert_allclose(found.points, points, atol=1e-5)
    red = np.asarray(found.point_data["red"])
    # On the symmetry plane's side and on its image alike, and where the surface meets a vertex, its value.
    design = read_design(folder / "tiny/tiny.h5")
    shared = 0
    for p, value in zip(design.domain.points, design.relative_pressure, strict=True):
        for x in {tuple(p), (p[0], -p[1], p[2])}:
            near = np.flatnonzero(np.linalg.norm(points - x, axis=1) < 1e-6)
            for vertex in near:
                wanted = colormaps["viridis"](float(np.clip(value, 0.0, 1.0)), bytes=True)[0]
                assert abs(int(red[vertex]) - int(wanted)) <= 1
                shared += 1
    assert shared > 10


def test_deformed_shape_follows_the_displacement(folder: Path, poro: Poro) -> None:
    assert poro("convert", "tiny.h5", "rest.ply", "--colour", "density").code == 0
    assert poro("convert", "tiny.h5", "bent.ply", "--colour", "density", "--deformed").code == 0
    rest, bent = (meshio.read(folder / name).points for name in ("rest.ply", "bent.ply"))
    moved = np.linalg.norm(bent - rest, axis=1)
    largest = np.linalg.norm(read_design(folder / "tiny/tiny.h5").displacement, axis=1).max()
    fixed = np.abs(rest[:, 0]) < 1e-6
    assert fixed.any()
    assert moved[fixed].max() < 1e-6
    assert 0.0 < moved.max() <= largest * (1.0 + 1e-5)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["tiny.h5", "talk.vtu", "--colour", "pressure"], 2, "only .glb and .ply hold colours"),
        (["tiny.h5", "nowhere/talk.glb", "--colour", "pressure"], 2, "there is no folder nowhere"),
        (["tiny.refined.h5", "talk.glb", "--colour", "pressure"], 4, "give the one of 'optimize'"),
        (["tiny.h5", "talk.vtu", "--deformed"], 2, "goes with --colour"),
        (["tiny.h5", "talk.glb", "--colour", "chi"], 2, "'chi' is not one of"),
    ],
)
def test_refusals(arguments: list[str], code: int, words: str, folder: Path, poro: Poro) -> None:
    ended = poro("convert", *arguments)
    assert ended.code == code
    assert words in ended.err
    assert not list(folder.glob("talk.*"))
