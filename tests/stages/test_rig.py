"""The rig's sheet: the paper's test rig, the rules of scaling, and the file that the command line writes."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from command_line import Poro
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from pipeline.runs.keys import stage_settings
from stages import inflation, rig
from stages.domains import HalfCylinderSettings
from stages.settings import LoadSettings, MaterialSettings, ProblemSettings

PAPER = ProblemSettings()


def test_the_papers_rig() -> None:
    """Section 4: R̄ = 22.5 mm, Ē = 1 N/mm², an arm of 90 mm, and a spring of 0.045 N/mm and 120.8 mm."""
    sheet = rig.run(PAPER, 1.5, 1.0, rig.Settings(), elongation=15.327)
    assert (sheet.lengths, sheet.arm_length) == ({"radius": 22.5, "length": 22.5}, 90.0)
    assert sheet.pressure == pytest.approx(20.0)
    assert sheet.spring_stiffness == pytest.approx(0.045)
    assert sheet.spring_length == pytest.approx(120.8, abs=0.05)
    assert sheet.spring_travel == pytest.approx(22.99, abs=0.01)
    # Appendix E: 100 g on 0.045 N/mm.
    assert list(sheet.calibration) == [10, 20, 50, 70, 100]
    assert sheet.calibration[100] == pytest.approx(21.79, abs=0.01)


@given(
    scale=st.floats(0.1, 10.0),
    modulus=st.floats(0.1, 10.0),
    size=st.floats(0.2, 5.0),
    stiffness=st.floats(0.2, 5.0),
)
def test_a_sheet_does_not_depend_on_the_size_and_stiffness_that_were_computed(
    scale: float, modulus: float, size: float, stiffness: float
) -> None:
    """Dimensional analysis: the same ratios on another domain and with another E are the same actuator."""
    other = ProblemSettings(
        domain=HalfCylinderSettings(radius=15.0 * size, length=15.0 * size),
        material=MaterialSettings(youngs_modulus=2.736 * stiffness),
    )
    one = rig.run(PAPER, scale, modulus, rig.Settings(), 10.0)
    two = rig.run(other, scale / size, modulus, rig.Settings(), 10.0 * size)
    assert one.lengths == pytest.approx(two.lengths, rel=1e-12)
    for name in ("arm_length", "pressure", "spring_stiffness", "spring_length", "spring_travel"):
        assert getattr(one, name) == pytest.approx(getattr(two, name), rel=1e-12), name


def test_without_a_spring_there_is_no_length() -> None:
    sheet = rig.run(ProblemSettings(load=LoadSettings(spring_ratio=0.0)), 1.5, 1.0, rig.Settings())
    assert (sheet.spring_stiffness, sheet.spring_length, sheet.spring_travel) == (0.0, math.inf, None)


def test_settings_are_checked() -> None:
    for key in rig.Settings.model_fields:
        with pytest.raises(ValidationError):
            rig.Settings.model_validate({key: 0.0})


def test_export_writes_the_sheet(folder: Path, poro: Poro) -> None:
    part = folder / "tiny/tiny.stl"
    before = part.read_bytes()
    ended = poro("export", "tiny.h5", "--youngs", "1.0", "--json")
    assert ended.code == 0, ended.err
    assert part.read_bytes() == before  # nothing is computed again for it
    found = json.loads(ended.out)
    assert found["rig"]["pressure"] == pytest.approx(20.0)
    assert found["rig"]["spring_travel"] == pytest.approx(found["spring_elongation"] * found["rig"]["scale"])
    assert str(folder / "tiny/tiny.rig.md") in [str(Path(file).resolve()) for file in found["files"]]
    sheet = (folder / "tiny/tiny.rig.md").read_text(encoding="utf-8")
    assert "| pressure p_in | 20 kPa |" in sheet
    assert "0.5 mm thick, 12.7 mm wide" in sheet
    assert found["part"] == {
        "scale": 1.0,
        "youngs_modulus": 1.0,
        "pressure_kPa": pytest.approx(20.0),
        "travel_mm": found["rig"]["spring_travel"],
        "as_printed": False,
    }
    assert "kPa, arm 60 mm" in poro("export", "tiny.h5", "--youngs", "1.0").out
    # What the sheet was told is known to the next command.
    again = poro("export", "tiny.h5").out
    assert "part                scale 1, Young's modulus 1 N/mm²: p_in 20 kPa\n" in again
    assert "rig                 p_in 20 kPa" in again
    (folder / "tiny/tiny.rig.md").unlink()
    assert "N/mm²: p_in 54.7 kPa\n" in poro("export", "tiny.h5").out


@pytest.mark.usefixtures("undrawn")
def test_sheet_says_the_scale_and_what_is_not_known(folder: Path, poro: Poro) -> None:
    (folder / "tiny/tiny.h5").rename(folder / "elsewhere.h5")
    ended = poro("export", "tiny.refined.h5", "--scale", "1.5", "--youngs", "1")
    assert ended.code == 0, ended.err
    sheet = (folder / "tiny/tiny.scale-1.5.rig.md").read_text(encoding="utf-8")
    assert "| radius R | 22.5 mm |" in sheet
    assert "at p_in | not known |" in sheet


def test_no_sheet_unless_asked_for(folder: Path, poro: Poro) -> None:
    assert poro("export", "tiny.h5").code == 0
    assert not list(folder.rglob("*.rig.md"))
    ended = poro("export", "tiny.h5", "--youngs", "-1")
    assert ended.code == 2
    assert "--youngs: must be greater than 0, not -1" in ended.err


def test_curves_scale_as_the_sheet_does() -> None:
    _, load, _ = PAPER.parameters()
    pressure, travel = rig.scaled(
        np.array([0.0, 0.5, 1.0]) * load.pressure, np.array([0.0, 7.0, 15.327]), PAPER, 1.5, 1.0
    )
    sheet = rig.run(PAPER, 1.5, 1.0, rig.Settings(), elongation=15.327)
    np.testing.assert_allclose(pressure, [0.0, 10.0, 20.0], rtol=1e-12)
    np.testing.assert_allclose(travel, [0.0, 10.5, 22.9905], rtol=1e-12)
    assert (pressure[-1], travel[-1]) == (pytest.approx(sheet.pressure), pytest.approx(sheet.spring_travel))


#: What `inflate` says of a part at p_in.
INFLATED = {
    "at_target": {
        "elongation": -10.0,
        "T3": -2.0,
        "theta2": math.radians(12.0),
        "share_above": 0.01,
        "strain_p99": 0.13,
    },
    "pressure_in": 0.05472,
    "optimised": None,
    "strain_limit": 0.14,
    "full_over_half": None,
    "limit_points": [],
    "touching": {"load_factor": 1.2, "at": (1.0, 2.0, 3.0)},
    "blocked_force": 0.1,
}


def test_the_verdict_has_the_numbers_of_the_part_and_those_of_the_case() -> None:
    units = rig.RigUnits(PAPER, 1.5, 1.0)
    said = [text for _, text in inflation.verdict(INFLATED, units)]
    assert said[1:3] == [
        "travel 15.000 mm, T3 -3.0000 mm, theta2 12.000 degrees, at 20 kPa",
        "in size and modulus of the case travel 10.000 mm, T3 -2.0000 mm, at 54.7 kPa",
    ]
    touching, blocked = (text for _, text in inflation.lines(INFLATED, units))
    assert "at (1.5, 3.0, 4.5) mm" in touching
    assert blocked.endswith(f" {0.1 * 1.5**2 / 2.736:.4g} N")
    same = [text for _, text in inflation.verdict(INFLATED, rig.RigUnits(PAPER, 1.0, 2.736))]
    assert same[1] == "travel 10.000 mm, T3 -2.0000 mm, theta2 12.000 degrees, at 54.7 kPa"
    assert len(same) == len(said) - 1


def test_figures_of_a_part_like_its_case_have_one_unit() -> None:
    units = rig.RigUnits(PAPER, 1.0, 2.736)
    assert (units.both_lengths(9.8271, 3), units.both_pressures(0.05472)) == ("9.827 mm", "54.7 kPa")
    other = rig.RigUnits(PAPER, 1.5, 1.0)
    assert other.both_lengths(9.8271, 3) == "9.827 mm, of the part 14.741 mm"
    assert other.both_pressures(0.05472) == "54.7 kPa, of the part 20 kPa"


def test_the_modulus_of_the_print_alone_makes_no_inflation_stale() -> None:
    plain = {"rig": {"youngs_modulus": None}, "inflate": {"pressure": None}}
    printed = {"rig": {"youngs_modulus": 1.0}, "inflate": {"pressure": None}}
    assert stage_settings(plain, "inflate") == stage_settings(printed, "inflate")
    pressed = {"rig": {"youngs_modulus": 1.0}, "inflate": {"pressure": 20.0}}
    assert stage_settings(pressed, "inflate")["rig"] == {"youngs_modulus": 1.0}
