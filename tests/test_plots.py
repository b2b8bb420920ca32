"""Figures of a design by the command line: files that show something, and a sentence where there is nothing to show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import Poro
from PIL import Image

from pipeline import plots
from pipeline.design import read_design


def drawn(path: Path) -> float:
    """Share of the pixels that are not paper."""
    assert 2_000 < path.stat().st_size < 300_000
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"))
    return float((pixels < 235).any(axis=2).mean())


def test_figures_are_drawn(poro: Poro, folder: Path) -> None:
    ended = poro("plot", folder / "tiny.h5")
    assert ended.code == 0, ended.err
    files = [folder / f"tiny-{kind}.png" for kind in ("history", "section", "views")]
    assert ended.out.split() == [str(file) for file in files]
    assert [0.01 < drawn(file) < 0.9 for file in files] == [True] * 3


def test_case_finds_its_artifact_and_svg_is_vectors(poro: Poro, folder: Path) -> None:
    ended = poro("plot", folder / "tiny.yaml", "--output", folder, "--format", "svg")
    assert ended.code == 0, ended.err
    for kind in ("history", "section"):
        assert (folder / f"tiny-{kind}.svg").read_text().count("<path") > 10


def test_section_shows_the_solid_where_it_is_and_where_it_moves(folder: Path) -> None:
    design = read_design(folder / "tiny.h5")
    figure = plots.section(design)
    before, after = figure.axes[:2]
    radius, length = design.domain.radius, design.domain.length
    low, high = before.dataLim.min, before.dataLim.max
    np.testing.assert_allclose([*low, *high], [0.0, -radius, length, radius], atol=1e-12)
    tip = design.domain.points[:, 0] == length
    moved = (design.domain.points + design.displacement)[tip & (design.domain.points[:, 1] == 0.0)]
    assert after.dataLim.max[0] >= moved[:, 0].max() - 1e-9


def test_without_opengl_the_rest_is_drawn(poro: Poro, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plots, "drawn_apart", lambda *_: None)
    ended = poro("plot", folder / "tiny.h5")
    assert ended.code == 0
    assert "tiny-views.png: not drawn" in ended.out
    assert not (folder / "tiny-views.png").exists()
    assert (folder / "tiny-section.png").exists()


@pytest.mark.parametrize("given", ["tiny.yaml", "tiny.refined.h5"])
def test_without_a_design_there_is_a_sentence(poro: Poro, folder: Path, given: str) -> None:
    (folder / "tiny.h5").unlink()
    ended = poro("plot", folder / given, "--output", folder)
    assert ended.code == 4
    assert "tiny.h5: there is no such file; run the stage that makes it." in ended.err
