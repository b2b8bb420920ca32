"""`poro check`: the verdicts on known solids, what does not change them, and the command."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from command_line import Poro
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold
from numpy.typing import NDArray
from pydantic import ValidationError
from shapes import block, cup, polygon_area, rod, surface, tube, turned

from actuator.arrays import Floats
from actuator.failure import EmptySolid, InvalidField
from pipeline.exit_codes import ExitCode
from stages import check
from stages.check.findings import Check, Finding

#: Coarse, for the speed of the tests.
COARSE = {"pitch": 0.5, "points": 2000}
#: Length settings, which a larger part asks to be larger.
LENGTHS = ("wall", "gap", "drain", "glue", "pitch")


def checked(solid: Manifold, **options: Any) -> check.Result:
    part = surface(solid)
    return check.run(part.vertices, part.triangles, check.Settings(**(COARSE | options)))


def verdicts(result: check.Result) -> dict[Check, str]:
    assert [finding.name for finding in result.findings] == list(Check)
    return {finding.name: finding.verdict for finding in result.findings}


def one(result: check.Result, name: Check) -> Finding:
    return next(finding for finding in result.findings if finding.name is name)


def test_a_cube_has_nothing_to_find_but_no_chamber() -> None:
    result = checked(block(10.0, 10.0, 10.0))
    assert set(verdicts(result).values()) == {"pass", "not applicable"}
    assert one(result, Check.CHAMBER).verdict == "not applicable"
    assert one(result, Check.WALLS).measured["minimum"] == pytest.approx(10.0)
    assert one(result, Check.VOLUME).measured["volume"] == pytest.approx(1000.0)
    assert one(result, Check.VOLUME).measured["mass"] == pytest.approx(1.1)
    assert result.passed
    assert result.summary == "10 pass, 0 warn, 0 fail, 1 not applicable"
    assert (result.triangles, result.size) == (12, (10.0, 10.0, 10.0))


def test_a_tube_holds_air() -> None:
    chamber = one(checked(tube()), Check.CHAMBER)
    assert chamber.verdict == "pass"
    assert chamber.measured["chambers"] == pytest.approx([polygon_area(5.0) * 29.9])
    assert "reaches both plates" in chamber.text


def test_a_tube_with_a_side_hole_does_not() -> None:
    result = checked(tube() - block(2.0, 2.0, 20.0, 7.0, 0.0, 10.0))
    assert result.failed == ("air chamber",)
    assert re.search(r"air gets out through \d\.\d\d mm at \(\d\.", one(result, Check.CHAMBER).text)
    coarser = checked(tube() - block(0.2, 0.2, 20.0, 7.0, 0.0, 10.0))
    assert coarser.failed == ("air chamber",)
    assert "narrower than the voxels" in one(coarser, Check.CHAMBER).text


def test_a_tube_slit_from_end_to_end_is_warned_of() -> None:
    chamber = one(checked(tube() - block(40.0, 2.0, 20.0, 0.0, 0.0, 10.0)), Check.CHAMBER)
    assert chamber.verdict == "warn"
    assert "open at its side" in chamber.text


def test_a_bubble_is_only_a_warning() -> None:
    result = checked(Manifold.cube((10.0, 10.0, 10.0), True) - Manifold.cube((0.5, 0.5, 0.5), True))
    found = one(result, Check.CAVITIES)
    assert (found.verdict, result.passed) == ("warn", True)
    assert found.measured["volumes"] == pytest.approx([0.125])


def test_a_hollow_ball_keeps_its_resin() -> None:
    result = checked(Manifold.sphere(5.0, 32) - Manifold.sphere(3.0, 32))
    assert result.failed == ("closed cavities",)
    found = one(result, Check.CAVITIES)
    assert found.measured["volumes"] == pytest.approx([Manifold.sphere(3.0, 32).volume()])
    assert "at (0.00, 0.00, 0.00)" in found.text


def test_a_cup_is_one_in_one_direction() -> None:
    upright = one(checked(cup(), direction="z"), Check.CUPS)
    assert upright.verdict == "warn"
    assert upright.measured["volume"] == pytest.approx(576.0)
    assert "576.0 mm³" in upright.text
    assert "from 1.0 to 10.0 mm above the platform" in upright.text
    assert one(checked(cup(), direction="-z"), Check.CUPS).verdict == "pass"
    assert one(checked(cup(), direction="-z", on_platform=True), Check.CUPS).verdict == "warn"
    assert one(checked(cup(), direction="z", cup=600.0), Check.CUPS).verdict == "pass"


def plate() -> Manifold:
    return block(10.0, 10.0, 0.3)


def slotted() -> Manifold:
    return block(10.0, 10.0, 10.0) - block(0.2, 20.0, 10.0, 0.0, 0.0, 5.0)


def tee() -> Manifold:
    return block(4.0, 4.0, 10.0) + block(20.0, 4.0, 2.0, 0.0, 0.0, 6.0)


def bottle() -> Manifold:
    return block(10.0, 10.0, 10.0) - block(8.0, 8.0, 8.0) - block(6.0, 2.0, 2.0, 5.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("solid", "name", "text"),
    [
        (plate, Check.WALLS, r"0\.30 mm, at \(-?\d\.\d\d, -?\d\.\d\d, -?0\.00\)"),
        (slotted, Check.GAPS, r"0\.20 mm, at \(-?0\.00, "),
        (tee, Check.OVERHANGS, r"64\.0 mm²"),
        (bottle, Check.DRAINS, r"through [12]\.\d\d mm at \([45]\."),
    ],
)
def test_warnings_say_how_much_and_where(solid: Callable[[], Manifold], name: Check, text: str) -> None:
    result = checked(solid())
    assert one(result, name).verdict == "warn"
    assert re.search(text, one(result, name).text)
    assert result.passed


def test_separate_bodies_fail_and_are_listed() -> None:
    solids = [block(3.0, 3.0, 3.0, 5.0 * k, 0.0, 0.0) for k in range(5)]
    result = checked(sum(solids, start=block(4.0, 4.0, 4.0, -20.0, 0.0, 0.0)))
    assert result.failed == ("one body",)
    assert "6 separate bodies" in one(result, Check.BODIES).text
    assert one(result, Check.BODIES).text.endswith("; and 2 more.")


def test_an_open_surface_leaves_nothing_else_to_check() -> None:
    part = surface(block(10.0, 10.0, 10.0))
    opened = check.run(part.vertices, part.triangles[1:], check.Settings())
    assert opened.failed == ("closed surface",)
    assert opened.summary == "0 pass, 0 warn, 1 fail, 10 not applicable"
    assert "3 open edges" in one(opened, Check.CLOSED).text
    inverted = check.run(part.vertices, part.triangles[:, ::-1], check.Settings())
    assert "inside out" in one(inverted, Check.CLOSED).text


def test_a_grid_too_large_costs_only_the_checks_that_need_it() -> None:
    result = checked(block(100.0, 100.0, 100.0), pitch=0.1)
    assert [name for name, verdict in verdicts(result).items() if verdict == "not applicable"] == [
        Check.CUPS,
        Check.DRAINS,
        Check.CHAMBER,
    ]
    assert "choose a pitch" in one(result, Check.CUPS).text


def test_what_is_no_surface_is_refused() -> None:
    part = surface(block(1.0, 1.0, 1.0))
    with pytest.raises(InvalidField, match="not finite"):
        check.run(part.vertices * np.nan, part.triangles, check.Settings())
    with pytest.raises(EmptySolid, match="no triangle"):
        check.run(part.vertices * 0.0, part.triangles, check.Settings())
    with pytest.raises(EmptySolid, match="no triangle"):
        check.run(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64), check.Settings())


@pytest.mark.parametrize(
    "values", [{"wall": 0.0}, {"angle": 90.0}, {"direction": "up"}, {"axis": "-x"}, {"walls": 1.0}]
)
def test_settings_are_checked(values: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        check.Settings.model_validate(values)


# ------------------------------------------------------------------------------------------------ invariance


@cache
def everything() -> tuple[Floats, NDArray[np.int64]]:
    """A part with a cup, a slot, a thin wall, an overhang, a narrow bottle and a chamber along x."""
    solid = block(20.0, 12.0, 12.0) - rod(2.0, 30.0).translate([0.0, 0.0, -2.6])
    solid -= block(3.1, 3.1, 5.0, -6.0, 0.0, 5.0)
    solid -= block(0.3, 20.0, 3.0, 0.0, 0.0, 5.5)
    solid += block(6.0, 6.0, 0.26, 0.0, 8.0, 3.0)
    solid -= block(3.0, 5.4, 3.0, 6.0, 0.2, 3.2) + block(0.9, 0.9, 3.0, 6.0, 0.0, 5.0)
    part = surface(solid)
    return part.vertices, part.triangles


@cache
def reference() -> check.Result:
    return check.run(*everything(), check.Settings(**COARSE, drain=2.0))


def test_the_part_of_these_tests_has_everything() -> None:
    found = verdicts(reference())
    assert {name for name, verdict in found.items() if verdict == "warn"} == {
        Check.CUPS,
        Check.DRAINS,
        Check.WALLS,
        Check.GAPS,
        Check.OVERHANGS,
    }
    assert found[Check.CHAMBER] == "pass"


def assert_same(found: check.Result, scale: float = 1.0) -> None:
    assert verdicts(found) == verdicts(reference())
    for now, before in zip(found.findings, reference().findings, strict=True):
        lengths = {"minimum": 1, "area": 2, "largest": 2, "volume": 3, "mass": 3, "share": 0}
        for key, power in lengths.items():
            if key in before.measured:
                expected = before.measured[key] * scale**power
                assert now.measured[key] == pytest.approx(expected, rel=2e-3, abs=2e-3 * scale**power), key
        for key in ("volumes", "chambers"):
            if key in before.measured:
                assert now.measured[key] == pytest.approx([scale**3 * v for v in before.measured[key]], rel=1e-3)


@settings(max_examples=6, deadline=None)
@given(shift=st.tuples(*3 * [st.floats(-50.0, 50.0)]))
def test_a_shift_changes_nothing(shift: tuple[float, float, float]) -> None:
    vertices, triangles = everything()
    found = check.run(vertices + shift, triangles, check.Settings(**COARSE, drain=2.0))
    assert_same(found)
    now, before = (one(result, Check.CUPS).measured["cups"][0]["centre"] for result in (found, reference()))
    assert now == pytest.approx(np.add(before, shift).tolist(), abs=1e-3)


@settings(max_examples=6, deadline=None)
@given(scale=st.floats(0.2, 5.0))
def test_a_larger_part_with_larger_thresholds_is_the_same_part(scale: float) -> None:
    vertices, triangles = everything()
    base = check.Settings(**COARSE, drain=2.0)
    larger = {name: scale * getattr(base, name) for name in LENGTHS} | {"cup": scale**3 * base.cup}
    assert_same(check.run(scale * vertices, triangles, base.model_copy(update=larger)), scale)


@settings(max_examples=6, deadline=None)
@given(turns=st.lists(st.integers(0, 2), min_size=1, max_size=4))
def test_turning_part_and_directions_together_changes_nothing(turns: list[int]) -> None:
    vertices, triangles = everything()
    upwards, axis = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    for about in turns:
        vertices, upwards, axis = (turned(vectors, about) for vectors in (vertices, upwards, axis))
    sign = "-" if upwards.sum() < 0.0 else ""
    directions = {"direction": f"{sign}{'xyz'[np.abs(upwards).argmax()]}", "axis": "xyz"[np.abs(axis).argmax()]}
    assert_same(check.run(vertices, triangles, check.Settings(**COARSE, **directions, drain=2.0)))


# ------------------------------------------------------------------------------------------------ the command


def written(solid: Manifold, path: Path, form: str = "stl") -> Path:
    part = surface(solid)
    data = trimesh.Trimesh(part.vertices, part.triangles, process=False).export(file_type=form)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


@pytest.mark.parametrize(
    ("name", "form"), [("a.stl", "stl"), ("b.stl", "stl_ascii"), ("c.3mf", "3mf"), ("D.STL", "stl")]
)
def test_every_format_is_read(name: str, form: str, poro: Poro, tmp_path: Path) -> None:
    written(tube(), tmp_path / name, form)
    ended = poro("check", name, "--pitch", "0.5")
    assert (ended.code, ended.err) == (ExitCode.OK, "")
    assert ended.out.startswith(f"{name}: ")
    for line, finding in zip(ended.out.splitlines()[1:], Check, strict=False):
        assert re.match(rf"  (pass|warn|not applicable) +{finding.value}  +[A-Z0-9].*\.$", line), line
    stored = json.loads((tmp_path / f"details/{name}.check.json").read_text(encoding="utf-8"))
    assert stored["passed"]
    assert stored["settings"]["pitch"] == 0.5
    assert stored["findings"][10]["measured"]["chambers"] == pytest.approx([polygon_area(5.0) * 29.9], rel=1e-4)


def test_json_is_what_is_stored(poro: Poro, tmp_path: Path) -> None:
    written(cup(), tmp_path / "cup.stl")
    ended = poro("check", "cup.stl", "--json", "--direction", "-z", "--flat", "--wall", "2")
    assert ended.code == ExitCode.OK
    assert ended.out == (tmp_path / "details/cup.stl.check.json").read_text(encoding="utf-8")
    found = {finding["name"]: finding for finding in json.loads(ended.out)["findings"]}
    assert found["cups"]["verdict"] == "warn"
    assert found["walls"]["verdict"] == "warn"
    assert (found["walls"]["threshold"], found["walls"]["unit"]) == (2.0, "mm")


def test_a_failed_check_ends_with_code_5_after_the_list(poro: Poro, tmp_path: Path) -> None:
    part = surface(block(10.0, 10.0, 10.0))
    open_mesh = trimesh.Trimesh(part.vertices, part.triangles[1:], process=False)
    (tmp_path / "open.stl").write_bytes(open_mesh.export(file_type="stl"))
    ended = poro("check", "open.stl", "--no-save")
    assert ended.code == ExitCode.BAD_SOLID
    assert "  fail            closed surface" in ended.out
    assert "1 fail, 10 not applicable" in ended.out
    assert ended.err == "poro: open.stl fails: closed surface.\n"
    assert [path.name for path in tmp_path.iterdir()] == ["open.stl"]
    assert poro("check", "open.stl").code == ExitCode.BAD_SOLID
    assert (tmp_path / "details/open.stl.check.json").exists()


@pytest.mark.parametrize("name", ["part.stl", "part.3mf"])
@pytest.mark.parametrize(
    "content", [None, b"", b"this is no solid\n", b"\x00\x01garbage" * 40, b"solid x\nendsolid x\n"]
)
def test_what_cannot_be_read_ends_with_code_4(name: str, content: bytes | None, poro: Poro, tmp_path: Path) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    ended = poro("check", name)
    assert ended.code == ExitCode.ARTIFACT
    assert ended.out == ""
    assert ended.err.startswith(f"poro: {name}: ")
    assert ended.err.count("\n") == 1
    assert not (tmp_path / f"details/{name}.check.json").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["part.obj"],
        ["part.stl", "--wall", "-1"],
        ["part.stl", "--gap", "nan"],
        ["part.stl", "--angle", "90"],
        ["part.stl", "--direction", "up"],
        ["part.stl", "--axis", "-x"],
    ],
)
def test_wrong_usage_ends_with_code_2(arguments: list[str], poro: Poro) -> None:
    ended = poro("check", *arguments)
    assert ended.code == ExitCode.USAGE
    assert ended.out == ""
    assert ended.err.startswith("poro: ")
    assert ended.err.count("\n") == 1


def test_help_tells_the_defaults(poro: Poro) -> None:
    words = " ".join(poro("check", "--help").out.replace("|", " ").split())
    for name in ("direction", "axis", "wall", "gap", "angle", "drain", "density", "pitch"):
        default = check.Settings.model_fields[name].default
        said = default if isinstance(default, str) else f"{default:g}"
        assert re.search(rf"--{name} (?:(?!--).)*Default: {re.escape(said)}\.", words), name
