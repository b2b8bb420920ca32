"""Tension tests as machines write them: the same curve whatever columns and units, and several specimens."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Poro

from pipeline.exit_codes import ExitCode, Fault
from pipeline.measured.uniaxial_test import read_uniaxial_test

STRAIN = np.linspace(0.0, 1.0, 21)
#: Neo-Hooke with E = 0.6 N/mm².
STRESS = 0.2 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
GAUGE, AREA = 50.0, 12.0


def rows(*columns: np.ndarray, mark: str = ",") -> str:
    return "\n".join(mark.join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)) + "\n"


MACHINE = GAUGE * STRAIN, AREA * STRESS
WRITTEN = {
    "true columns beside": "Time (s);True Strain;True Stress (MPa);Engineering Strain;Engineering Stress (MPa)\n"
    + rows(STRAIN, np.log1p(STRAIN), STRESS * (1.0 + STRAIN), STRAIN, STRESS, mark=";"),
    "psi in percent": "sep=;\nStrain [%];Stress (psi)\n" + rows(100 * STRAIN, STRESS / 6.894757293168361e-3, mark=";"),
    "units in a row": "Tensile strain (Extension),Tensile stress\n(%),(kPa)\n" + rows(100 * STRAIN, 1e3 * STRESS),
    "Bluehill": '"Label","A1"\n"Length","50.0","mm"\n"Area","12.0","mm^2"\n\n"Extension","Load"\n"(mm)","(N)"\n'
    + rows(*MACHINE),
    "width and thickness": "Length : 50 mm\nWidth (mm),6.0\nThickness (mm),2.0\nExtension (mm),Load (N)\n"
    + rows(*MACHINE),
    "comments": "# Gauge length: 5 cm\n# A0 = 12 mm²\ndisplacement_in,force_lbf\n"
    + rows(MACHINE[0] / 25.4, MACHINE[1] / 4.4482216152605),
    "lost samples": "strain,stress [MPa]\n" + rows(STRAIN, STRESS) + "9.91E37,9.91E37\nnan,0.1\n",
}


@pytest.mark.parametrize("name", WRITTEN)
def test_same_curve_as_machines_write_it(name: str, tmp_path: Path) -> None:
    path = tmp_path / "test.csv"
    path.write_text(WRITTEN[name])
    found = read_uniaxial_test(path)
    np.testing.assert_allclose(found.stretch, 1.0 + STRAIN, rtol=1e-7)
    np.testing.assert_allclose(found.stress, STRESS, atol=1e-8)
    if name == "lost samples":
        assert found.remarks == ["left out: 2 rows without a number in 'strain', first in line 23: '9.91E37'"]


def test_extension_and_load_need_the_specimen(tmp_path: Path, poro: Poro) -> None:
    path = tmp_path / "test.csv"
    path.write_text("extension [mm],load [N]\n" + rows(*MACHINE))
    with pytest.raises(Fault, match="needs the gauge length in mm; give --gauge-length") as caught:
        read_uniaxial_test(path)
    assert caught.value.code == ExitCode.USAGE
    with pytest.raises(Fault, match="needs the initial cross section in mm²; give --area"):
        read_uniaxial_test(path, gauge_length=GAUGE)
    ended = poro("fit", path, "--gauge-length", GAUGE, "--area", AREA, "--no-plot", "--law", "neo-hooke", "--json")
    assert ended.code == ExitCode.OK, ended.err
    found = json.loads(ended.out)
    assert found["fits"][0]["youngs_modulus"] == pytest.approx(0.6, rel=1e-6)
    assert "stress is 'load [N]' over an area of 12 mm²" in found["notes"]


def test_several_specimens_give_mean_and_spread(poro: Poro) -> None:
    for factor in (1.0, 1.1):
        Path(f"{factor}.csv").write_text("strain [-],stress [MPa]\n" + rows(STRAIN, factor * STRESS))
    ended = poro("fit", "1.0.csv", "1.1.csv", "--no-plot", "--law", "neo-hooke")
    assert ended.code == ExitCode.OK, ended.err
    assert "E 0.63 ± 0.042 N/mm² (0.6, 0.66)" in ended.out
    found = json.loads(poro("fit", "1.0.csv", "1.1.csv", "--no-plot", "--law", "neo-hooke", "--json").out)
    assert found["youngs_moduli"]["neo-hooke"]["mean"] == pytest.approx(0.63, rel=1e-6)
    assert found["fits"][0]["youngs_modulus"] == pytest.approx(0.63, rel=1e-6)
    assert len(found["specimens"]) == 2
