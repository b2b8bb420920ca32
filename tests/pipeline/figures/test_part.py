"""The figure of the part, with and without OpenGL."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from matplotlib import colormaps
from PIL import Image

from pipeline.figures.part import draw_part
from pipeline.figures.saving import encoded


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """A ring, as a file."""
    path = tmp_path / "ring.stl"
    ring = trimesh.creation.torus(10.0, 4.0)
    path.write_bytes(ring.export(file_type="stl"))
    return path


def _looked_at(figure: Path) -> None:
    assert figure.stat().st_size < 300_000
    with Image.open(figure) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    middle = pixels.shape[1] // 2
    for half in (pixels[:, :middle], pixels[:, middle:]):
        drawn = (half < 235).any(axis=2)
        assert 0.1 < drawn.mean() < 0.9
        assert len(np.unique(half[drawn].sum(axis=1))) > 20  # shaded, not flat
        assert not drawn[[0, -1]].any()  # nothing cut off above and below
    orange = (pixels[..., 0] > 1.3 * pixels[..., 2]) & (pixels[..., 2] < 150)
    assert orange[:, :middle].mean() < 0.002 < 0.01 < orange[:, middle:].mean()  # the cut faces


def test_part_is_drawn_whole_and_cut_open(part: Path) -> None:
    draw_part(part, part.with_suffix(".png"))
    _looked_at(part.with_suffix(".png"))


def test_fewer_colours_keep_white_and_the_ends_of_a_colour_bar() -> None:
    drawn = np.full((200, 300, 3), 255, dtype=np.uint8)
    drawn[20:180, 20:200, 2] = np.arange(160)[:, None]  # a slow gradient
    drawn[20:180, 250:260] = colormaps["viridis"](np.linspace(0.0, 1.0, 160), bytes=True)[:, None, :3]
    with Image.open(io.BytesIO(encoded(Image.fromarray(drawn), "png", "figure"))) as small:
        assert small.mode == "P"
        found = np.asarray(small.convert("RGB")).astype(int)
    white = (drawn == 255).all(axis=2)
    assert (found[white] == 255).all()
    off = np.abs(found - drawn)
    assert off[20:180, 250:260].mean() < 8
    assert off[[20, 179], 250:260].mean() < 16
    assert off.mean() < 4


@pytest.mark.skipif(sys.platform != "linux", reason="hides the libraries in the way of Linux")
def test_part_is_drawn_without_opengl(part: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hidden = part.parent / "libraries"
    hidden.mkdir()
    for name in ("libGL.so.1", "libEGL.so.1", "libGLX.so.0", "libOSMesa.so.8"):
        (hidden / name).write_text("no library")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(hidden))
    draw_part(part, part.with_suffix(".png"))
    _looked_at(part.with_suffix(".png"))
