"""Figures of a design by the command line: files that show something, and a sentence where there is nothing to show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import Poro, edited
from matplotlib.contour import ContourSet
from PIL import Image

from pipeline.figures import designs, sheet
from pipeline.figures.arm import arm
from pipeline.figures.initial import initial
from pipeline.figures.offscreen import CannotDraw
from pipeline.figures.section import section
from pipeline.results.design import read_design
from stages import mirror


def drawn(path: Path) -> float:
    """Share of the pixels that are not paper."""
    assert 2_000 < path.stat().st_size < 300_000
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB"))
    return float((pixels < 235).any(axis=2).mean())


def without_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    def ended_badly(*_: object) -> None:
        raise CannotDraw("VTK cannot draw")

    monkeypatch.setattr(sheet, "pictures", ended_badly)


def test_figures_are_drawn(poro: Poro, folder: Path) -> None:
    ended = poro("plot", folder / "tiny/tiny.h5")
    assert ended.code == 0, ended.err
    details = folder / "tiny/details"
    files = [details / f"tiny.{name}.png" for name in ("initial", "views", "arm", "section", "history")]
    assert ended.out.split() == [str(file) for file in (*files[:-1], details / "tiny.history.csv", files[-1])]
    assert [0.01 < drawn(file) < 0.9 for file in files] == [True] * 5


def test_history_is_a_table_with_units(poro: Poro, folder: Path) -> None:
    assert poro("plot", folder / "tiny/tiny.h5", "--only", "history").code == 0
    heading, *rows = (folder / "tiny/details/tiny.history.csv").read_text().splitlines()
    assert heading.startswith("update [1],evaluations [1],C [1],C0 [1],")
    assert heading.endswith("seconds_inner [s],seconds [s]")
    history = dict(read_design(folder / "tiny/tiny.h5").history)
    history["pseudo_time"] = np.cumsum(history["dt"])
    names = [cell.split()[0] for cell in heading.split(",")]
    assert sorted(names) == sorted(history)
    assert names.index("pseudo_time") == names.index("dt") + 1
    for values, name in zip(zip(*(row.split(",") for row in rows), strict=True), names, strict=True):
        np.testing.assert_allclose(np.array(values, dtype=float), history[name], rtol=1e-9)


def test_case_finds_its_artifact_and_svg_is_vectors(poro: Poro, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without_opengl(monkeypatch)
    ended = poro("plot", folder / "tiny.yaml", "--output", folder, "--format", "svg")
    assert ended.code == 0, ended.err
    for kind in ("initial", "history", "section", "arm", "views"):
        vectors = folder / f"tiny/details/tiny.{kind}.svg"
        assert vectors.read_text().count("<path") > 10
        assert vectors.stat().st_size < 400_000  # shaded solids and fields are pixels


def test_same_design_gives_the_same_bytes(folder: Path) -> None:
    design = read_design(folder / "tiny/tiny.h5")
    one, other = (designs.drawn(design, "history", "svg") for _ in range(2))
    assert one == other


def test_section_shows_the_solid_where_it_is_and_where_it_moves(folder: Path) -> None:
    design = read_design(folder / "tiny/tiny.h5")
    figure = section(design)
    before, after = figure.axes[:2]
    radius, length = design.domain.radius, design.domain.length
    low, high = before.dataLim.min, before.dataLim.max
    np.testing.assert_allclose([*low, *high], [0.0, -radius, length, radius], atol=1e-12)
    assert (before.get_xlabel(), after.get_xlabel()) == ("X1 [mm]", "x1 [mm]")
    tip = design.domain.points[:, 0] == length
    moved = (design.domain.points + design.vertex_displacement)[tip & (design.domain.points[:, 1] == 0.0)]
    assert after.dataLim.max[0] >= moved[:, 0].max() - 1e-9


def test_arm_ends_where_the_state_says(folder: Path) -> None:
    design = read_design(folder / "tiny/tiny.h5")
    (axes,) = arm(design).axes
    (joint,) = [line for line in axes.lines if line.get_marker() == "o"]
    t1, _, theta = design.arm
    _, load, _ = design.case.optimize.parameters()
    along = design.domain.length + t1 + load.arm_length * np.cos(theta)
    assert joint.get_xydata().tolist() == [[pytest.approx(along), pytest.approx(-design.summary["spring_elongation"])]]
    assert f"θ2 = {np.degrees(theta):.2f}°" in {text.get_text() for text in axes.texts}


def test_shape_moves_smoothly_up_to_the_wall(folder: Path) -> None:
    """A displacement that is linear in X is linear on the shape, but for the sagitta of the coarse wall."""
    design = read_design(folder / "tiny/tiny.h5")
    rate = np.array([[0.1, 0.0, 0.2], [0.0, -0.1, 0.0], [0.3, 0.0, 0.1]])
    moved = replace(design, displacement=design.domain.points @ rate.T)
    vertices = design.shape.vertices
    _, found = moved.fields_at(vertices)
    wrong = np.linalg.norm(found - vertices @ rate.T, axis=1)
    sagitta = design.domain.radius * (1.0 - np.cos(0.5 * np.pi / (4 * design.domain.core_cells)))
    assert wrong.max() < np.linalg.norm(rate, 2) * sagitta


def test_initial_outline_is_where_the_initial_density_is_one_half(folder: Path) -> None:
    design = read_design(folder / "tiny/tiny.h5")
    across = initial(design).axes[1]
    (outline,) = [each for each in across.collections if isinstance(each, ContourSet) and not each.filled]
    points = np.concatenate([path.vertices for path in outline.get_paths()])
    places = np.column_stack([np.zeros(len(points)), points])
    chi = design.domain.initial_design(places, design.case.objective.interface_width)
    assert len(points) > 100
    assert np.abs(chi).max() < 0.01


def test_simulation_is_drawn_where_there_is_one(poro: Poro, folder: Path, simulation: Path) -> None:
    ended = poro("plot", folder / "tiny/tiny.h5", "--format", "svg", "--only", "pressure")
    assert ended.code == 0, ended.err
    assert ended.out.split() == [str(folder / "tiny/details/tiny.pressure.svg")]
    assert "<path" in (folder / "tiny/details/tiny.pressure.svg").read_text()


def test_design_without_solid_has_a_sentence(poro: Poro, folder: Path) -> None:
    with edited(folder / "tiny/tiny.h5") as file:
        file["vertices/chi"][...] = -1.0
    (folder / "tiny/details/tiny.solid.h5").unlink()
    ended = poro("plot", folder / "tiny/tiny.h5", "--only", "initial", "--only", "arm")
    assert ended.code == 0, ended.err
    assert "tiny.arm.png: not drawn: Nothing is solid" in ended.out
    assert (folder / "tiny/details/tiny.initial.png").exists()


def test_without_opengl_solids_are_drawn_all_the_same(
    poro: Poro, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without_opengl(monkeypatch)
    ended = poro("plot", folder / "tiny/tiny.h5", "--only", "views")
    assert ended.out.split() == [str(folder / "tiny/details/tiny.views.png")]
    assert drawn(folder / "tiny/details/tiny.views.png") > 0.05


@pytest.mark.parametrize("given", ["tiny.yaml", "tiny/details/tiny.refined.h5"])
def test_without_a_design_there_is_a_sentence(poro: Poro, folder: Path, given: str) -> None:
    (folder / "tiny/tiny.h5").unlink()
    ended = poro("plot", folder / given, "--output", folder)
    assert ended.code == 4
    assert "tiny.h5: there is no such file; run the stage that makes it, `poro optimize`" in ended.err


def test_only_what_is_asked_for_is_drawn(poro: Poro, folder: Path) -> None:
    ended = poro("plot", folder / "tiny/tiny.h5", "--only", "history")
    assert ended.out.split() == [str(folder / f"tiny/details/tiny.history.{ending}") for ending in ("csv", "png")]
    drawings = {path.name for path in folder.rglob("tiny.*") if path.suffix in (".csv", ".png")}
    assert drawings == {"tiny.png", "tiny.history.csv", "tiny.history.png"}


def test_unknown_figures_and_missing_simulations_have_a_sentence(poro: Poro, folder: Path) -> None:
    ended = poro("plot", folder / "tiny/tiny.h5", "--only", "histogram")
    assert ended.code == 2
    assert "--only histogram: there is no such figure; choose one of initial, views, arm, section, history" in ended.err
    ended = poro("plot", folder / "tiny/tiny.h5", "--only", "pressure")
    assert "tiny.pressure.png: not drawn: There is no simulation beside the design" in ended.out


def test_shape_is_read_where_it_is_of_this_design(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And computed where it is missing, damaged, of another design or of another version of its stages."""
    computed = []
    run = mirror.run

    def counted(*arguments: Any) -> mirror.Result:
        computed.append(arguments)
        return run(*arguments)

    monkeypatch.setattr(mirror, "run", counted)
    design = read_design(folder / "tiny/tiny.h5")
    assert len(design.shape.vertices)
    assert not computed

    def spoil(name: str, attribute: str, value: object) -> None:
        with edited(folder / name) as file:
            file.attrs[attribute] = value

    spoil("tiny/details/tiny.refined.h5", "upstream_identity", "of another design")
    fresh = read_design(folder / "tiny/tiny.h5").shape
    assert len(computed) == 1
    np.testing.assert_array_equal(fresh.vertices, design.shape.vertices)
    np.testing.assert_array_equal(fresh.triangles, design.shape.triangles)
    spoil("tiny/details/tiny.refined.h5", "upstream_identity", design.identity)
    spoil("tiny/details/tiny.solid.h5", "stage_version", mirror.VERSION + 1)
    assert len(read_design(folder / "tiny/tiny.h5").shape.vertices)
    assert len(computed) == 2
    (folder / "tiny/details/tiny.solid.h5").write_text("text")
    assert len(read_design(folder / "tiny/tiny.h5").shape.vertices)
    assert len(computed) == 3
