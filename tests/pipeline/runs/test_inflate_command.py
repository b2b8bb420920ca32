"""`poro inflate`, and what a run says of its part: solids of any origin, verdicts, exit codes, what is left behind."""

from __future__ import annotations

import base64
import csv
import json
from pathlib import Path

import lxml.html
import numpy as np
import pytest
import trimesh
from command_line import COARSE, TINY, TO_PART, Poro
from manifold3d import Manifold
from PIL import Image
from shapes import rod

import poro as door
from pipeline.exit_codes import ExitCode
from pipeline.results.inflation import Inflation, read_states
from pipeline.runs.progress import Reporter
from pipeline.store import artifact, contents
from stages.events import Event, LoadStep


def write(solid: Manifold, path: Path) -> Path:
    """A solid as a file."""
    mesh = solid.to_mesh64()
    path.write_bytes(
        trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts, process=False).export(file_type="stl")
    )
    return path


def tube(hole: float = 0.0) -> Manifold:
    """A tube along x with a bore off its axis, so that it bends, and perhaps a hole in its wall."""
    found = rod(6.0, 12.0) - rod(2.5, 14.0).translate([0.0, 0.0, 1.0])
    return found - Manifold.cylinder(10.0, hole, hole, 16) if hole else found


@pytest.fixture
def here(poro: Poro, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder with the tube, a case for it, and no pictures of what is inflated."""
    write(tube(), Path("tube (1).stl"))
    Path("soft.yaml").write_text(COARSE + "rig: {youngs_modulus: 1.5}\n")
    monkeypatch.setattr("pipeline.figures.inflated.inflated", _pixel)
    return Path()


def _pixel(*arguments: object) -> Image.Image:
    return Image.new("RGB", (2, 2))


def names(folder: Path) -> set[str]:
    """Files in a folder that are not hidden."""
    return {path.name for path in folder.iterdir() if not path.name.startswith(".")}


def test_foreign_solid_is_inflated_with_a_case_and_nothing_is_left_beside_it(here: Path, poro: Poro) -> None:
    before = names(here)
    ended = poro("inflate", "tube (1).stl", "--case", "soft.yaml", "--output", "results")
    assert ended.code == ExitCode.OK, ended.err
    assert ended.out.splitlines()[1].split() == ["holds", "air", "yes"]
    assert "  as printed          travel " in ended.out
    assert "mm, as printed" in ended.out  # the rig sheet
    assert names(here) == before | {"results"}
    made = {f"tube (1).{end}" for end in ("inflation.h5", "inflation.vtkhdf", "inflation.csv", "inflation.png")}
    results = here / "results/tube-1-"
    assert names(results) == {"tube (1).rig.md", "details"}
    assert names(results / "details") == made | {"tube (1).inflated.png", "tube-1-.log"}
    header = artifact.read_header(results / "details/tube (1).inflation.h5")
    assert header.case_text == Path("soft.yaml").read_text()

    with (results / "details/tube (1).inflation.csv").open() as file:
        rows = list(csv.DictReader(file))
    at = next(row for row in rows if float(row["load_factor [1]"]) == 1.0)
    assert float(at["rig_pressure [kPa]"]) == pytest.approx(0.02 * 1500.0)
    scale = 12.0 / 15.0
    assert float(at["rig_elongation [mm]"]) == pytest.approx(scale * float(at["elongation [mm]"]))
    sheet = (results / "tube (1).rig.md").read_text()
    travel = scale * abs(float(at["elongation [mm]"]))
    assert f"| predicted travel of the arm's end at p_in | {travel:.2f} mm, as printed |" in sheet

    again = poro("inflate", "tube (1).stl", "--case", "soft.yaml", "--output", "results", "--json")
    assert "inflate: up to date" in again.err
    found = json.loads(again.out)
    assert found["inflate"]["at_target"]["elongation"] == pytest.approx(float(at["elongation [mm]"]))
    assert found["rig"]["as_printed"]
    status = poro("status", "tube (1).stl", "--output", "results")
    assert [line.split()[0] for line in status.out.splitlines()] == ["export", "inflate"]
    write(tube().scale([1.0, 1.0, 1.1]), here / "tube (1).stl")
    assert poro("inflate", "tube (1).stl", "--case", "soft.yaml", "--output", "results").err.count("another one") == 1


def test_interrupted_path_is_kept_and_computed_again(here: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch) -> None:
    observe = Reporter.observe

    def interrupted(reporter: Reporter, event: Event) -> None:
        observe(reporter, event)
        if isinstance(event, LoadStep):
            raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Reporter, "observe", interrupted)
        ended = poro("inflate", "tube (1).stl", "--case", "soft.yaml")
    assert ended.code == ExitCode.INTERRUPTED
    assert "Interrupted; the curve so far is in details/tube (1).inflation.h5" in ended.err
    assert poro("status", "tube (1).stl").code == ExitCode.OK
    ended = poro("inflate", "tube (1).stl", "--case", "soft.yaml")
    assert ended.code == ExitCode.OK
    assert "inflate: interrupted before its end" in ended.err


def test_leaking_solid_is_refused_with_the_place(here: Path, poro: Poro) -> None:
    write(tube(hole=0.8), Path("leak.stl"))
    ended = poro("inflate", "leak.stl", "--output", "results")
    assert ended.code == ExitCode.BAD_SOLID
    assert "leak.stl: The solid does not hold air: with plates glued on both ends, no chamber is closed;" in ended.err
    assert "air gets out through 1." in ended.err
    assert names(Path("results/leak/details")) == {"leak.log"}
    with pytest.raises(door.Failure, match="air gets out through"):
        door.inflate(door.read_case("soft.yaml"), "leak.stl")


@pytest.mark.parametrize(
    ("arguments", "code", "sentence"),
    [
        (("tube (1).stl", "--size", 20), ExitCode.BAD_SOLID, "choose a smaller size"),
        (("tube (1).stl", "--axis", "y"), ExitCode.BAD_SOLID, "no flat face at its lower end along y"),
        (("tube (1).stl", "--size", 0), ExitCode.USAGE, "--size: must be greater than 0"),
        (("tube (1).stl", "--pressure", "20 kPa"), ExitCode.USAGE, "needs the Young's modulus of the print"),
        (("tube (1).stl", "--pressure", "20 mPa"), ExitCode.USAGE, "must be a pressure, "),
        (("soft.yaml", "--case", "soft.yaml"), ExitCode.USAGE, "goes with a solid, and soft.yaml is none"),
        (("rubbish.stl",), ExitCode.ARTIFACT, "rubbish.stl: The bytes are no stl: 7 of them are fewer"),
        (("missing.stl",), ExitCode.ARTIFACT, "missing.stl: cannot be read"),
        (("part.obj",), ExitCode.USAGE, "part.obj: the ending must be .stl or .3mf"),
    ],
)
def test_bad_input_gives_one_sentence(
    arguments: tuple[object, ...], code: ExitCode, sentence: str, here: Path, poro: Poro
) -> None:
    Path("rubbish.stl").write_bytes(b"rubbish")
    ended = poro("inflate", *arguments, "--output", "results")
    assert ended.code == code
    assert sentence in ended.err
    assert ended.err.count("poro: ") == 1
    assert not list(Path("results").rglob("*.h5"))


def test_exported_part_is_known_by_its_record_and_a_changed_one_keeps_the_case(folder: Path, poro: Poro) -> None:
    ended = poro("inflate", "tiny.stl", "--size", 20)
    assert ended.code == ExitCode.BAD_SOLID
    assert "export: given (tiny/details/tiny.stl.h5)" in ended.err
    assert ended.out.splitlines()[1].split() == ["holds", "air", "yes"]  # as exported
    solid = trimesh.load_mesh("tiny/tiny.stl")
    solid.vertices *= 2.0
    solid.export("tiny/tiny.stl")
    assert "export: given (tiny/tiny.stl)\n" in poro("inflate", "tiny.stl", "--size", 20).err


@pytest.mark.usefixtures("undrawn", "quickly")
def test_run_ends_with_the_verdict_or_with_the_part(folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch) -> None:
    """And the report and the door say the same."""
    monkeypatch.setattr("pipeline.figures.inflated.inflated", _pixel)
    (folder / "tiny.yaml").write_text(
        TINY + COARSE + "mirror: {threshold: -1.0}\nrig: {youngs_modulus: 1.0}\nexport: {scale: 1.5}\n"
    )
    said = poro("run", "tiny.yaml", "--output", ".", "--no-inflate")
    assert said.code == ExitCode.OK
    assert "of the optimised density field" in (folder / "tiny/tiny.rig.md").read_text()
    assert poro("run", "tiny.yaml", "--no-inflate", *TO_PART).code == ExitCode.USAGE
    ended = poro("run", "tiny.yaml", "--output", ".", "--threads", 1)
    assert ended.code == ExitCode.OK, ended.err
    assert [line[2:22].strip() for line in ended.out.splitlines()[1:3]] == ["holds air", "as printed"]
    assert "less than the optimiser found" in ended.out
    for name in ("tiny.stl", "tiny.png", "tiny.inflation.h5", "tiny.inflation.csv", "tiny.inflated.png", "tiny.rig.md"):
        assert name in ended.out
    assert "mm, as printed" in (folder / "tiny/tiny.rig.md").read_text()
    assert {line.split()[1] for line in poro("status", "tiny.yaml", "--output", ".").out.splitlines()} == {"up"}
    assert poro("run", "tiny.yaml", "--output", ".", "--dry-run").out.splitlines()[-1].split()[:2] == ["inflate", "up"]
    check_report(folder, poro)
    check_door(folder)
    # Another scale is another part, with an inflation of its own.
    assert poro("export", "tiny.h5", "--scale", 2.0).code == ExitCode.OK
    assert "tiny.scale-2.inflation.h5" in poro("status", "tiny.scale-2.stl", "--json").out


def check_report(folder: Path, poro: Poro) -> None:
    """The report of an inflated part: verdict first, a section, and the part bent and coloured by strain."""
    assert poro("report", "tiny.h5", "--no-check").code == ExitCode.OK
    page = lxml.html.document_fromstring((folder / "tiny/tiny.report.html").read_bytes())
    found = contents.summary(folder / "tiny/details/tiny.inflation.h5", "inflate")
    travel = f"travel {abs(found['at_target']['elongation']):.3f} mm"
    assert page.get_element_by_id("verdict").text_content().startswith(f"As printed: holds air; {travel}")
    (section,) = page.xpath("//section[@aria-labelledby='printed']")
    assert "against the optimiser" in section.text_content()
    assert len(section.xpath(".//table[@id='worst']/tbody/tr")) == len(found["worst"]) > 0
    assert len(section.xpath(".//figure//img[starts-with(@src, 'data:image/svg+xml')]")) == 1
    model = json.loads(page.xpath("//script[@id='model']/text()")[0])
    values = np.frombuffer(base64.b64decode(model["values"]), dtype="u1") / 255.0
    state = read_states(folder / "tiny/details/tiny.inflation.h5")
    assert state
    assert values.max() == pytest.approx(state.strain[state.boundary[:, :3]].max() / (2.0 * state.limit), abs=0.01)
    low, high = np.array(model["low"]), np.array(model["high"])
    points = state.points[np.unique(state.boundary[:, :3])]
    assert low[1] == pytest.approx(-high[1], rel=1e-6)  # both halves
    assert high[1] == pytest.approx(points[:, 1].max(), rel=0.05)
    moved = low + np.frombuffer(base64.b64decode(model["moved"]), dtype="<u2").reshape(-1, 3) / 65535.0 * (high - low)
    rest = low + np.frombuffer(base64.b64decode(model["rest"]), dtype="<u2").reshape(-1, 3) / 65535.0 * (high - low)
    largest = np.abs(state.displacement[np.unique(state.boundary[:, :3])]).max()
    assert np.abs(moved - rest).max() == pytest.approx(largest, rel=0.02)


def check_door(folder: Path) -> None:
    """From Python the numbers are the same."""
    case, design = door.read_case(folder / "tiny.yaml"), door.load(folder / "tiny/tiny.h5")
    assert isinstance(design, door.OptimisedDesign)
    result = door.inflate(case, folder / "tiny/tiny.stl", design, threads=1)
    found = door.load(folder / "tiny/details/tiny.inflation.h5")
    assert isinstance(found, Inflation)
    for name, values in result.curves.items():
        np.testing.assert_array_equal(values, found.curves[name])
    assert result.summary["optimised"] == found.summary["optimised"]
    sheet = door.rig(case, design, result)
    assert sheet.as_printed
    assert sheet.spring_travel == pytest.approx(1.5 * abs(found.summary["at_target"]["elongation"]))
    assert not door.rig(case, design).as_printed
    assert len(door.figures.inflation(found, rig=found.rig).axes) == 3


@pytest.mark.usefixtures("undrawn")
def test_run_of_a_part_that_leaks_says_so_first_and_keeps_it(folder: Path, poro: Poro) -> None:
    # A threshold this high leaves no wall at the side.
    (folder / "tiny.yaml").write_text(TINY + COARSE + "mirror: {threshold: 1.0}\n")
    ended = poro("run", "tiny.yaml", "--output", ".")
    assert ended.code == ExitCode.BAD_SOLID, ended.out
    assert ended.out.splitlines()[1].split() == ["holds", "air", "no"]
    assert "tiny.stl: The solid does not hold air" in ended.err
    assert (folder / "tiny/tiny.stl").is_file()
    assert (folder / "tiny/tiny.png").is_file()
    assert not (folder / "tiny/details/tiny.inflation.h5").exists()
    exported = poro("export", "tiny.yaml", "--output", ".", "--json")
    assert exported.code == ExitCode.OK
    assert not json.loads(exported.out)["export"]["holds_air"]


def test_figures_show_the_part_bent_and_the_curve(poro: Poro) -> None:
    """Drawn as they are: by VTK in blue, as the strain is small, whole and cut open."""
    write(tube(), Path("tube.stl"))
    Path("soft.yaml").write_text(COARSE)
    assert poro("inflate", "tube.stl", "--case", "soft.yaml").code == ExitCode.OK
    with Image.open("details/tube.inflated.png") as drawn:
        shown = np.asarray(drawn.convert("RGB")).astype(int)
    blue = (shown[..., 2] > shown[..., 0] + 40).mean(axis=0)
    assert [half.mean() > 0.05 for half in np.array_split(blue, 2)] == [True, True]
    with Image.open("details/tube.inflation.png") as drawn:
        assert drawn.size[0] > 1000
    # In the size of the part, 12 mm long, not in that of the case.
    state = read_states(Path("details/tube.inflation.h5"))
    assert state
    scale = contents.summary(Path("details/tube.inflation.h5"), "inflate")["scale"]
    assert np.ptp(state.scaled(scale).points[:, 0]) == pytest.approx(12.0, rel=1e-3)
