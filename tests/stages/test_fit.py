"""`poro fit`: laws recovered from synthetic data, Treloar's rubber, the report, and mistakes in the CSV."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from command_line import Poro
from PIL import Image
from treloar import STRESS, STRETCH

from actuator.material.homogeneous import uniaxial_stress
from actuator.material.laws.mooney_rivlin import MooneyRivlin
from actuator.material.laws.neo_hooke import NeoHooke
from actuator.material.laws.ogden import Ogden
from actuator.material.laws.yeoh import Yeoh
from actuator.parameters import Law
from pipeline.case.model import parse_case
from pipeline.exit_codes import ExitCode
from stages import fit
from stages.fit import Settings

POINTS = np.linspace(1.0, 3.0, 25)
SHEAR = 0.4

#: Laws that make synthetic data, each with the settings that should find it again.
KNOWN: dict[str, tuple[Law, Settings]] = {
    "neo-hooke": (NeoHooke(), Settings(law="neo-hooke")),
    "mooney-rivlin": (MooneyRivlin(0.2), Settings(law="mooney-rivlin")),
    "yeoh": (Yeoh(-0.02, 0.002), Settings(law="yeoh")),
    "ogden, one term": (Ogden.of([1.0], [3.3]), Settings(law="ogden", terms=1)),
    "ogden, two terms": (Ogden.of([0.8, 0.2], [1.5, 6.0]), Settings(law="ogden", terms=2, whole=True)),
}


def write(name: str, header: str, columns: list[np.ndarray]) -> Path:
    rows = [",".join(f"{value:.10g}" for value in row) for row in zip(*columns, strict=True)]
    Path(name).write_text("\n".join([header, *rows, ""]))
    return Path(name)


def summary(poro: Poro, *arguments: object) -> dict:
    ended = poro("fit", *arguments, "--json")
    assert ended.code == ExitCode.OK, ended.err
    return json.loads(ended.out)


@pytest.mark.parametrize("name", KNOWN)
def test_synthetic_data_give_back_their_law(name: str) -> None:
    law, settings = KNOWN[name]
    found = fit.run(POINTS, SHEAR * uniaxial_stress(law, POINTS), settings).fits[0]
    assert found.shear == pytest.approx(SHEAR, rel=1e-5)
    assert found.youngs_modulus == pytest.approx(3.0 * SHEAR, rel=1e-5)
    assert list(found.law) == pytest.approx(list(law), rel=1e-3, abs=1e-5)
    assert found.r_squared == pytest.approx(1.0, abs=1e-9)
    assert found.largest_error < 1e-6
    assert found.warnings == []


def test_noisy_synthetic_data_rank_the_law_that_made_them_first() -> None:
    """1 % of noise: AICc pays for parameters, R² does not."""
    law = MooneyRivlin(0.2)
    clean = SHEAR * uniaxial_stress(law, POINTS)
    noisy = clean + 0.01 * clean.max() * np.random.default_rng(3).normal(size=len(POINTS))
    result = fit.run(POINTS, noisy, Settings(whole=True))
    by_name = {found.name: found for found in result.fits}
    assert result.best.name == "mooney-rivlin"
    assert by_name["yeoh"].r_squared > by_name["neo-hooke"].r_squared
    assert by_name["mooney-rivlin"].aicc < by_name["neo-hooke"].aicc
    assert by_name["mooney-rivlin"].root_mean_square == pytest.approx(0.01 * clean.max(), rel=0.4)


def test_quality_is_what_its_definition_says() -> None:
    found = fit.run(STRETCH, STRESS, Settings(law="yeoh", whole=True)).fits[0]
    residual = found.stress(STRETCH) - STRESS
    n, k = len(STRESS), 4
    assert found.root_mean_square == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-12)
    assert found.r_squared == pytest.approx(1.0 - np.mean(residual**2) / np.var(STRESS), rel=1e-12)
    assert found.largest_error == pytest.approx(np.abs(residual).max(), rel=1e-12)
    assert found.aicc == pytest.approx(n * np.log(np.mean(residual**2)) + 2 * k + 2 * k * (k + 1) / (n - k - 1))


def test_yeoh_fit_is_the_least_squares_solution() -> None:
    """NumPy's solution of the same linear problem, which for these data is inside the bound."""
    found = fit.run(STRETCH, STRESS, Settings(law="yeoh", whole=True)).fits[0]
    x = STRETCH**2 + 2.0 / STRETCH - 3.0
    columns = [2.0 * i * (STRETCH - STRETCH**-2) * x ** (i - 1) for i in (1, 2, 3)]
    expected = np.linalg.lstsq(np.array(columns).T, STRESS, rcond=None)[0]
    assert list(found.coefficients.values()) == pytest.approx(expected, rel=1e-8)


def test_treloar_rubber() -> None:
    """What the literature finds: Yeoh's and Ogden's laws follow the upturn, neo-Hooke's and Mooney-Rivlin's cannot."""
    result = fit.run(STRETCH, STRESS, Settings(terms=3, whole=True))
    by_name = {found.name: found for found in result.fits}
    assert by_name["neo-hooke"].r_squared < 0.9
    assert by_name["yeoh"].r_squared > 0.995
    assert by_name["ogden"].r_squared > 0.998
    assert 0.3 < by_name["yeoh"].shear < 0.45  # Treloar gives 4 kg/cm², or 0.39 N/mm², for moderate strains
    # The Mooney plot of the whole curve has a negative C1 + C2; of its first third it has not.
    assert "mooney-rivlin" in result.left_out
    moderate = STRETCH < 3.1
    found = fit.run(STRETCH[moderate], STRESS[moderate], Settings(law="mooney-rivlin", whole=True)).fits[0]
    assert found.r_squared > 0.995
    assert found.coefficients["C01"] > 0.0


def test_unstable_law_is_reported_with_its_stretch() -> None:
    """A softening curve, synthetic, followed only to 30 %: the law that fits turns over beyond."""
    stretch = np.linspace(1.0, 1.3, 15)
    stress = SHEAR * uniaxial_stress(Yeoh(-0.2, 0.0), stretch)
    calm, far = (fit.run(stretch, stress, Settings(law="yeoh", strain_limit=limit)).fits[0] for limit in (0.1, 1.5))
    assert calm.warnings == []
    assert any("stress falls beyond" in sentence for sentence in far.warnings)
    assert any("Not stable (Drucker) in uniaxial tension" in sentence for sentence in far.warnings)


# ---------------------------------------------------------------------------- where an actuator works


def to_failure() -> tuple[np.ndarray, np.ndarray]:
    """A test to a stretch of 10 that bends upwards, whose initial modulus is 3 SHEAR."""
    stretch = np.linspace(1.0, 10.0, 361)
    laws = NeoHooke(), Ogden.of([1.0], [2.6])
    return stretch, SHEAR * np.mean([uniaxial_stress(law, stretch) for law in laws], axis=0)


def test_a_test_to_failure_does_not_decide_near_rest() -> None:
    """The whole curve has a fine R² and a wrong E; by default E is right, and the errors of the other are stated."""
    stretch, stress = to_failure()
    near, whole = (fit.run(stretch, stress, Settings(law="yeoh", whole=all_of_it)) for all_of_it in (False, True))
    assert near.best.youngs_modulus == pytest.approx(3.0 * SHEAR, rel=0.03)
    assert near.stretch[near.fitted].max() <= 1.28
    assert near.best.warnings == []
    (wrong,) = whole.fits
    assert wrong.r_squared > 0.995
    assert wrong.modulus_error == pytest.approx(wrong.youngs_modulus / (3.0 * SHEAR) - 1.0, abs=0.02)
    assert abs(wrong.modulus_error) > 0.1
    at_limit = wrong.stress(np.array([1.14]))[0] / np.interp(1.14, stretch, stress)
    assert wrong.limit_error == pytest.approx(at_limit - 1.0, abs=0.01)
    assert f"E is {100 * abs(wrong.modulus_error):.0f} % " in wrong.warnings[0]


@pytest.mark.parametrize(
    ("options", "largest"),
    [
        ([], 1.28),
        (["--whole"], 10.0),
        (["--up-to", "1.5"], 1.5),
        (["--up-to", "50%"], 1.5),
        (["--strain-limit", "0.3"], 1.6),
        (["--case", "case11.yaml"], 1.22),
    ],
)
def test_range_that_is_fitted(poro: Poro, options: list[str], largest: float) -> None:
    path = write("rubber.csv", "stretch,stress", [*to_failure()])
    found = summary(poro, path, "--law", "neo-hooke", "--no-plot", *options)
    assert largest - 0.05 < found["fitted"]["stretch"][1] <= largest + 1e-9
    assert found["near_rest"]["youngs_modulus"] == pytest.approx(3.0 * SHEAR, rel=0.03)


def test_nothing_is_recommended_below_the_least_r_squared(poro: Poro) -> None:
    stress = SHEAR * uniaxial_stress(NeoHooke(), POINTS)
    noise = np.random.default_rng(5).normal(size=len(POINTS))
    path = write("noise.csv", "stretch,stress", [POINTS, stress + 0.3 * noise])
    ended = poro("fit", path, "--no-plot")
    assert ended.code == ExitCode.USAGE
    assert "no law reaches R² 0.9" in ended.err
    assert "material:" not in ended.out
    assert "neo-hooke" in ended.out
    assert json.loads(poro("fit", path, "--no-plot", "--json").out)["best"] is None


def test_strain_in_percent_is_taken_for_it_or_asked_for(poro: Poro) -> None:
    """Percent to 200 is certain. To 14 it is not, and E tells: one question, which the header answers."""
    for largest, step in ((200.0, 5.0), (14.0, 0.5)):
        strain = np.arange(0.0, largest + step, step)
        columns = [strain, SHEAR * uniaxial_stress(NeoHooke(), 1.0 + strain / 100.0)]
        ended = poro("fit", write("bare.csv", "strain,stress", columns), "--law", "neo-hooke", "--no-plot", "--json")
        if largest > 100.0:
            assert json.loads(ended.out)["fits"][0]["shear"] == pytest.approx(SHEAR, rel=1e-6)
            assert "taken for percent" in json.loads(ended.out)["warnings"][0]
        else:
            assert ended.code == ExitCode.USAGE
            assert "in percent 1.2 N/mm². Write 'strain [%]' or 'strain [-]'" in ended.err
            assert ended.out == ""
        answered = summary(poro, write("said.csv", "strain [%],stress", columns), "--law", "neo-hooke", "--no-plot")
        assert answered["fits"][0]["shear"] == pytest.approx(SHEAR, rel=1e-6)
        assert answered["warnings"] == []


@pytest.mark.parametrize(("shear", "foreign"), [(200.0, True), (10.0, False), (0.01, False), (0.001, True)])
def test_modulus_that_is_no_elastomers(shear: float, foreign: bool) -> None:
    found = fit.run(POINTS, shear * uniaxial_stress(NeoHooke(), POINTS), Settings(law="neo-hooke"))
    assert [sentence for sentence in found.warnings if "is no elastomer's" in sentence] == found.warnings
    assert bool(found.warnings) == foreign


# ------------------------------------------------------------------------------------------------ command line


def test_report_plot_and_section_to_paste(poro: Poro) -> None:
    path = write("rubber.csv", "stretch,stress [MPa]", [STRETCH, STRESS])
    ended = poro("fit", path, "--terms", 3, "--whole")
    assert ended.code == ExitCode.OK, ended.err
    assert all(word in ended.out for word in ("neo-hooke", "yeoh", "ogden", "AICc", "25 rows", "material:"))
    with Image.open("rubber.fit.png") as picture:
        assert min(picture.size) > 400
    for found in summary(poro, path, "--no-plot", "--terms", 3, "--whole")["fits"]:
        case = parse_case(found["case"].encode(), "pasted.yaml", "pasted")
        law = case.material.law.build()
        stress = case.material.youngs_modulus / 3.0 * uniaxial_stress(law, STRETCH)
        error = np.sqrt(np.mean((stress - STRESS) ** 2))
        assert error == pytest.approx(found["root_mean_square"], rel=1e-4)


def test_no_plot_writes_nothing(poro: Poro) -> None:
    path = write("rubber.csv", "stretch,stress", [STRETCH, STRESS])
    found = summary(poro, path, "--no-plot", "--law", "yeoh")
    assert [each["name"] for each in found["fits"]] == ["yeoh"]
    assert found["files"] == []
    assert list(Path().iterdir()) == [path]


@pytest.mark.parametrize(
    ("header", "strain", "stress", "options"),
    [
        ("strain,stress [kPa]", 1.0, 1e3, []),
        ("Strain [%],Engineering stress (kPa)", 100.0, 1e3, []),
        ("strain,stress_kPa", 1.0, 1e3, []),
        ("strain,stress", 1.0, 1e3, ["--unit", "kPa"]),
        ("nominal strain [-];stress [N/mm²]", 1.0, 1.0, []),
        ("# a remark\nstrain,stress [Pa]", 1.0, 1e6, []),
        ("strain;stress [MPa]", 1.0, 1.0, []),
    ],
)
def test_units_and_spellings(poro: Poro, header: str, strain: float, stress: float, options: list[str]) -> None:
    clean = SHEAR * uniaxial_stress(NeoHooke(), POINTS)
    path = write("data.csv", header, [strain * (POINTS - 1.0), stress * clean])
    if ";" in header:
        path.write_text(path.read_text().replace(",", ";").replace(".", ","))  # as spreadsheets write in many countries
    found = summary(poro, path, "--no-plot", "--law", "neo-hooke", *options)["fits"][0]
    assert found["shear"] == pytest.approx(SHEAR, rel=1e-8)


ROWS = "1.0,0.0\n1.5,0.4\n2.0,0.6\n"
MISTAKES = {
    "empty": ("", None, "the file is empty"),
    "no stress": ("stretch,force\n" + ROWS, 1, "no column of 'stress'"),
    "no header": (ROWS, 1, "no column of 'stretch' or 'strain'"),
    "both": ("stretch,strain,stress\n1.0,0.0,0.0\n", 1, "more than one column"),
    "true stress": ("stretch,true stress\n" + ROWS, 1, "engineering stress"),
    "unit": ("stretch,stress [furlong]\n" + ROWS, 1, "unit 'furlong'"),
    "word": ("stretch,stress\n1.0,0.0\n1.5,soft\n", 3, "'soft' is no number"),
    "infinite": ("stretch,stress\n1.0,0.0\n\n1.5,inf\n", 4, "finite"),
    "decimal comma": ("stretch,stress\n1,0,0,0\n", 2, "separate the cells by semicolons"),
    "short row": ("stretch,stress\n1.0,0.0\n1.5\n", 3, "1 cells and the header 2"),
    "negative stretch": ("stretch,stress\n1.0,0.0\n-1.5,0.4\n", 3, "above zero"),
    "few": ("stretch,stress\n1.0,0.0\n1.5,0.4\n", 3, "fewer than 3"),
    "same stretch": ("stretch,stress\n1.5,0.0\n1.5,0.4\n1.5,0.5\n", 4, "same stretch"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_give_one_sentence_with_line_and_remedy(poro: Poro, mistake: str) -> None:
    text, line, part = MISTAKES[mistake]
    Path("data.csv").write_text(text)
    ended = poro("fit", "data.csv")
    assert ended.code == ExitCode.ARTIFACT
    assert ended.err.startswith(f"poro: data.csv:{line}: " if line else "poro: data.csv: ")
    assert ended.err.rstrip("\n").count("\n") == 0
    assert part in ended.err
    assert list(Path().iterdir()) == [Path("data.csv")]


def test_other_mistakes(poro: Poro) -> None:
    path = write("data.csv", "stretch,stress [kPa]", [POINTS, -POINTS])
    for arguments, code, part in (
        (["missing.csv"], ExitCode.ARTIFACT, "missing.csv: there is no such file"),
        ([path, "--terms", 7], ExitCode.USAGE, "--terms: must be less than or equal to 3"),
        ([path, "--law", "neo"], ExitCode.USAGE, "--law"),
        ([path, "--unit", "MPa"], ExitCode.USAGE, "the stress is in 'kPa'"),
        ([path, "--law", "neo-hooke"], ExitCode.USAGE, "positive initial shear modulus"),
    ):
        ended = poro("fit", *arguments)
        assert ended.code == code, arguments
        assert part in ended.err, ended.err
    path.write_text("stretch,stress\n1.0,0.0\n1.2,0.1\n1.4,0.2\n")
    ended = poro("fit", path, "--law", "ogden")
    assert "4 numbers to fit" in ended.err
    assert ended.code == ExitCode.USAGE
