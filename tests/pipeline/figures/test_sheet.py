"""What every picture has: millimetres, room for its colour bar, the name of the case, no seam; whatever the sizes."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import Poro
from made_up_domain import BoxSettings
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar
from physics import half_cylinder

from actuator.arrays import Floats
from pipeline.case.model import Case, parse_case
from pipeline.figures import sheet
from pipeline.figures.arm import arm
from pipeline.figures.designs import FIGURES
from pipeline.figures.inflation import inflation
from pipeline.figures.offscreen import CannotDraw, Pixels, Shot
from pipeline.figures.part import part
from pipeline.figures.response import response
from pipeline.figures.section import section
from pipeline.figures.states import completed, solid_of, whole
from pipeline.figures.views import PRESSURE, views
from pipeline.results.design import OptimisedDesign, read_design
from pipeline.results.simulation import read_simulation
from stages.domains import DOMAINS

#: Of the paper's shape, longer than three radii, flat, very small, very large.
SHAPES = ((15.0, 15.0), (15.0, 50.0), (15.0, 3.0), (2.0, 2.0), (100.0, 300.0))


@pytest.fixture(autouse=True)
def without_opengl(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing here asks for VTK's pixels, and its process starts for seconds."""

    def ended_badly(shots: Sequence[Shot], extents: Sequence[Floats], pixels_per_mm: float) -> list[Pixels]:
        raise CannotDraw("VTK cannot draw")

    monkeypatch.setattr(sheet, "pictures", ended_badly)


def like(design: OptimisedDesign, radius: float, length: float) -> OptimisedDesign:
    """The tiny design in another size: its state is no longer one, but there is something to draw."""
    across, along = radius / design.domain.radius, length / design.domain.length
    domain = design.case.domain.model_copy(update={"radius": radius, "length": length})
    stretch = np.array([along, across, across])
    return replace(
        design,
        domain=domain.build(),
        displacement=design.displacement * stretch,
        arm=design.arm * (along, across, 1.0),
        case=design.case.model_copy(update={"domain": domain, "name": "other-size"}),
        source=None,
    )


def overlap(figure: Figure) -> list[tuple[int, int]]:
    """Pairs of axes, of panels and of the colour bar, that cover each other, and panels that leave the figure."""
    figure.canvas.draw()
    boxes = [axes.get_position() for axes in figure.axes if axes.axison or axes.images or axes.collections]
    assert all(box.x0 >= 0.0 and box.y0 >= 0.0 and box.x1 <= 1.0 and box.y1 <= 1.0 for box in boxes)
    pairs = [(i, j) for i in range(len(boxes)) for j in range(i)]
    return [
        (i, j)
        for i, j in pairs
        if min(boxes[i].x1, boxes[j].x1) - max(boxes[i].x0, boxes[j].x0) > 1e-9
        and min(boxes[i].y1, boxes[j].y1) - max(boxes[i].y0, boxes[j].y0) > 1e-9
    ]


def inches_per_mm(figure: Figure, number: int) -> tuple[float, float]:
    axes = figure.axes[number]
    box, (width, height) = axes.get_position(), figure.get_size_inches()
    return box.width * width / np.ptp(axes.get_xlim()), box.height * height / np.ptp(axes.get_ylim())


@pytest.mark.parametrize(("radius", "length"), SHAPES)
def test_panels_have_one_scale_and_nothing_before_them(folder: Path, radius: float, length: float) -> None:
    design = like(read_design(folder / "tiny/tiny.h5"), radius, length)
    for draw, panels in ((views, 4), (section, 2), (arm, 1)):
        figure = draw(design)
        assert overlap(figure) == []
        assert figure.get_suptitle() == "other-size"
        scales = np.array([inches_per_mm(figure, number) for number in range(panels)])
        np.testing.assert_allclose(scales, scales[0, 0], rtol=1e-9)
        assert 2.0 < max(figure.get_size_inches()) <= max(sheet.LARGEST) + 1e-9
    # The limits hold what is drawn, whatever its size.
    shape, (axes,) = design.shape.vertices, arm(design).axes
    (low, high), reach = axes.get_xlim(), design.case.optimize.parameters()[1].arm_length
    assert low < shape[:, 0].min() < shape[:, 0].max() < length + reach < high
    assert high - low < 2.5 * (length + reach)
    joint = next(line for line in axes.lines if line.get_marker() == "o").get_xydata()[0]
    assert axes.get_ylim()[0] < joint[1] < axes.get_ylim()[1]


def test_scale_bars_are_of_the_lengths_that_they_name() -> None:
    for size in (0.3, 7.0, 45.0, 260.0):
        box = trimesh.creation.box((size, size, size))
        figure = part(np.array(box.vertices), np.array(box.faces), "box")
        bars = [artist for axes in figure.axes for artist in axes.artists if isinstance(artist, AnchoredSizeBar)]
        lengths = {float(bar.txt_label.get_text().removesuffix(" mm")) for bar in bars}
        widths = {round(bar.size_bar.get_children()[0].get_width(), 9) for bar in bars}
        assert len(bars) == 2
        assert lengths == widths
        assert 0.1 * size < lengths.pop() < size
        assert figure.get_suptitle() == f"box, {size:.3g} × {size:.3g} × {size:.3g} mm"


def test_chamber_has_the_colour_of_its_pressure(folder: Path) -> None:
    """In the middle of the section there is no material, and air at p_in."""
    design = read_design(folder / "tiny/tiny.h5")
    figure = section(design)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[..., :3].astype(int)
    for axes in figure.axes[:2]:
        x, y = axes.transData.transform((0.4 * design.domain.length, 0.05 * design.domain.radius)).astype(int)
        patch = pixels[pixels.shape[0] - y - 3 : pixels.shape[0] - y + 3, x - 3 : x + 3].reshape(-1, 3)
        assert (np.median(patch, axis=0) < (255, 255, 80)).all()  # yellow, not white


def test_halves_are_completed_without_a_seam() -> None:
    """No vertex of the plane X2 = 0 is there twice, so that normals, and with them the light, do not jump there."""
    domain = half_cylinder(3, 2, 3)
    chi = domain.initial_design(domain.points, 3.0)
    fields = {"pressure": domain.points[:, 1], "displacement": 0.01 * domain.points}
    (found,) = whole(solid_of(domain, chi, **fields), True, "pressure", PRESSURE)
    closed = trimesh.Trimesh(found.vertices, found.triangles, process=True, merge_norm=True)
    assert closed.is_watertight
    assert closed.is_winding_consistent
    assert closed.volume > 0.0
    assert closed.bounds[0, 1] == pytest.approx(-closed.bounds[1, 1])
    on_plane = np.abs(found.vertices[:, 1]) < 1e-9
    assert on_plane.any()
    assert np.abs(found.normals[on_plane, 1]).max() < 0.05
    points, triangles = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), np.array([[0, 1, 2]])
    both, twice, (moved,) = completed(points, triangles, points)
    assert (len(both), twice.tolist()) == (4, [[0, 1, 2], [3, 1, 0]])
    np.testing.assert_array_equal(both, moved)


@pytest.mark.parametrize("halved", [True, False])
def test_another_domain_is_drawn_half_or_whole(halved: bool) -> None:
    with DOMAINS.registered("graded-box", BoxSettings):
        design = _at_rest(
            parse_case(f"domain: {{shape: graded-box, whole: {not halved}}}".lower().encode(), "c", "box")
        )
        for name in ("initial", "views", "section", "arm"):
            figure = FIGURES[name].draw(design)
            assert overlap(figure) == []
            assert figure.get_suptitle() == "box"


def _at_rest(case: Case) -> OptimisedDesign:
    """The initial design of a case, which has not moved yet."""
    domain, (_, load, limits) = case.domain.build(), case.optimize.parameters()
    return OptimisedDesign(
        domain=domain,
        chi=domain.initial_design(domain.points, limits.interface_width, limits.length_unit),
        displacement=np.zeros((len(domain.nodes), 3)),
        pressure=np.full(len(domain.points), load.pressure),
        arm=np.zeros(3),
        history={},
        summary={},
        checkpoint={},
        converged=False,
        reason="",
        case=case,
    )


def test_pressure_is_the_first_axis_of_all_curves(folder: Path, simulation: Path) -> None:
    found = read_simulation(simulation)
    up = found.curves["loading"] == 1.0
    part = {name: column[up] for name, column in found.curves.items()}
    curves = replace(found, curves=part, summary=found.summary | {"optimised": None})
    for figure in (response(found, title="tiny"), inflation(curves, title="tiny")):
        assert figure.get_suptitle() == "tiny"
        assert all(axes.get_xlabel().startswith("pressure [") for axes in figure.axes)


def test_pdf_is_a_format_of_all_figures(poro: Poro, folder: Path) -> None:
    ended = poro("plot", "tiny.h5", "--format", "pdf", "--only", "history", "--only", "section", "--json")
    assert ended.code == 0, ended.err
    files = [Path(name) for name in json.loads(ended.out)["files"]]
    assert [path.name for path in files if path.suffix == ".pdf"] == ["tiny.history.pdf", "tiny.section.pdf"]
    for path in files[1:]:
        assert path.read_bytes().startswith(b"%PDF-")
    trimesh.creation.box((9.0, 9.0, 9.0)).export("box.stl")
    assert poro("slice", "box.stl", "--format", "pdf").code == 0
    assert Path("details/box.areas.pdf").read_bytes().startswith(b"%PDF-")
    refused = poro("slice", "box.stl", "--format", "pdf", "--number", 1)
    assert refused.code == 2
    assert "a slice is svg, in mm, or png, a mask" in refused.err
