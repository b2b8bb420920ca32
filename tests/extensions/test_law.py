"""A material law that the product does not know: registered from outside, in a case, a fit and an optimisation."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import made_up_law
import numpy as np
import pytest
from command_line import TINY, Poro, environment
from made_up_law import EXAMPLE, Gent, GentSettings, SilentSettings
from physics import STRETCH, Floats, parameters

import stages.optimize
from actuator.material import pointwise
from actuator.material.constants import constants_of
from actuator.material.elasticity import energy_density, kirchhoff_stress
from actuator.material.homogeneous import stability
from pipeline.case.model import case_schema, parse_case
from pipeline.cli.reference import reference
from pipeline.exit_codes import ExitCode, Fault
from pipeline.figures.fit import style_of
from stages.laws import LAWS

SYMMETRIC = np.random.default_rng(7).normal(size=(4, 3, 3))
SYMMETRIC = SYMMETRIC + SYMMETRIC.transpose(0, 2, 1)
B = np.linalg.det(STRETCH) ** (-2.0 / 3.0) * STRETCH @ STRETCH.T
SHIPPED = ["neo-hooke", "mooney-rivlin", "yeoh", "ogden"]
STEP, SMALL = 1e-5, 1e-40


@pytest.fixture
def gent() -> Iterator[None]:
    """The law, known for one test."""
    with LAWS.registered("gent", GentSettings):
        yield
    assert list(LAWS) == SHIPPED


# --------------------------------------------------------------------------------------------------- case file


def test_case_takes_the_law_while_it_is_registered(gent: None) -> None:
    case = parse_case(b"material: {law: {name: gent, limit: 80.0}}", "case.yaml", "case")
    assert case.parameters()[0].law == Gent(80.0)
    kinds = json.loads(case_schema())["$defs"]["MaterialSettings"]["properties"]["law"]["anyOf"][1]
    assert set(kinds["discriminator"]["mapping"]) == {*SHIPPED, "gent"}


def test_mistakes_have_the_sentences_of_shipped_laws(gent: None) -> None:
    for law, sentence in {
        "gent": "material.law.limit: is missing; write it",
        "{name: gent, limit: -1.0}": "material.law.limit: must be greater than 0, not -1.0",
        "{name: gent, limit: '80'}": "material.law.limit: must be a number, not the text '80'; write 80",
        "{name: gent, limit: 80.0, c2: 0.1}": "material.law.c2: unknown key; remove it or use one of name, limit",
        "{name: gend, limit: 80.0}": "material.law.name: 'gend' is unknown; write one of 'neo-hooke', "
        "'mooney-rivlin', 'yeoh', 'ogden', 'gent'",
    }.items():
        with pytest.raises(Fault, match=r"case\.yaml:1: ") as refused:
            parse_case(f"material: {{law: {law}}}".encode(), "case.yaml", "case")
        assert sentence in str(refused.value)


def test_nothing_of_it_is_left() -> None:
    with pytest.raises(Fault, match="'gent' is unknown; write one of 'neo-hooke', 'mooney-rivlin', 'yeoh', 'ogden'"):
        parse_case(b"material: {law: {name: gent, limit: 80.0}}", "case.yaml", "case")


# --------------------------------------------------------------------------------------------------- mechanics


def stress(b: Floats) -> Floats:
    S = np.empty_like(b)
    pointwise.stress(EXAMPLE, b, S)
    return S


def test_stress_and_tangent_are_derivatives() -> None:
    dS = np.empty_like(SYMMETRIC)
    pointwise.tangent(EXAMPLE, B, SYMMETRIC, dS)
    for X, found in zip(SYMMETRIC, dS, strict=True):
        slope = pointwise.energy(EXAMPLE, B + 1j * SMALL * X).imag / SMALL
        assert np.sum(np.linalg.solve(B, stress(B)) / 2.0 * X) == pytest.approx(slope, rel=1e-12)
        assert found == pytest.approx(stress(B + 1j * SMALL * X).imag / SMALL, rel=1e-12)
    assert stability(EXAMPLE, "uniaxial tension", np.ones(1))[0] == pytest.approx(2.0, rel=1e-12)


def test_kirchhoff_stress_is_the_derivative_of_the_whole_energy() -> None:
    material, load, objective = parameters()
    c = constants_of(dataclasses.replace(material, law=EXAMPLE), load, objective)

    def energy(F: Floats) -> float:
        b, J = F @ F.T, np.linalg.det(F)
        found: float = energy_density(c, np.log(J), J ** (-2.0 / 3.0), np.trace(b), b)
        return found

    b, J = STRETCH @ STRETCH.T, np.linalg.det(STRETCH)
    kirchhoff_stress(c, 1.0, c.bulk * np.log(J), np.log(J), np.trace(b), b)
    first_piola = b @ np.linalg.inv(STRETCH).T
    for i, j in np.ndindex(3, 3):
        h = STEP * np.outer(np.eye(3)[i], np.eye(3)[j])
        central = (energy(STRETCH + h) - energy(STRETCH - h)) / (2.0 * STEP)
        assert first_piola[i, j] == pytest.approx(central, rel=1e-7, abs=1e-7 * c.bulk)


def test_element_loops_in_plain_python() -> None:
    """Tangent and gradient through the general machinery; what is compiled is the same text."""
    check = (
        "import law_loops, made_up_law; from physics import half_cylinder\n"
        "for check in (law_loops.check_tangent, law_loops.check_lagrangian_gradient):\n"
        "    check(made_up_law.EXAMPLE, half_cylinder(1, 1, 1))"
    )
    plain = environment() | {"NUMBA_DISABLE_JIT": "1"}
    ended = subprocess.run([sys.executable, "-c", check], env=plain, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr


#: Loads neo-Hooke's kernels where nobody knows the other law, though numba's index names its type.
ELSEWHERE = """\
import sys
from importlib.util import find_spec
from actuator.equations.kernels import residual
from actuator.material.constants import constants_of
from stages.settings import ProblemSettings
assert find_spec("made_up_law") is None
settings = ProblemSettings.model_validate({"domain": {"core_cells": 2, "rings": 1, "layers": 3}})
from actuator.solve.reduced import ReducedObjective
domain = settings.domain.build()
objective = ReducedObjective(domain, *settings.parameters(), threads=1)
objective.evaluate(domain.initial_design(domain.points, 3.0))
sys.stdout.write(str(sum(residual.stats.cache_misses.values())))
"""


@pytest.mark.slow
def test_optimisation_with_it_and_a_process_that_does_not_know_it(gent: None) -> None:
    """Two updates, of kernels that were compiled in a process of their own, as for every law; they take minutes."""
    text = TINY.replace("max_updates: 1", "max_updates: 2") + "material: {law: {name: gent, limit: 80.0}}\n"
    case = parse_case(text.encode(), "case.yaml", "case")
    result = stages.optimize.run(case.optimize, compute=stages.optimize.Compute(threads=1))
    assert len(result.history["C"]) == 3
    assert (np.diff(result.history["C"]) < 0.0).all()
    from actuator.equations.kernels import residual

    loaded = [kind for kind in residual.stats.cache_hits if kind[2].instance_class.law is Gent]
    compiled = [kind for kind in residual.stats.cache_misses if kind[2].instance_class.law is Gent]
    assert loaded
    assert not compiled
    helpers = str(Path(made_up_law.__file__).parent)
    path = environment()["PYTHONPATH"].replace(helpers, "")
    ended = subprocess.run(
        [sys.executable, "-c", ELSEWHERE],
        env=environment() | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout == "0"


# --------------------------------------------------------------------------------------------------------- fit

POINTS = np.linspace(1.0, 4.0, 25)
SHEAR, LIMIT = 0.4, 30.0


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """A tension test of the law, from its closed form."""
    measured = SHEAR * (POINTS - POINTS**-2) / (1.0 - (POINTS**2 + 2.0 / POINTS - 3.0) / LIMIT)
    rows = [f"{x:.10g},{s:.10g}" for x, s in zip(POINTS, measured, strict=True)]
    (tmp_path / "gent.csv").write_text("\n".join(["stretch,stress [MPa]", *rows, ""]))
    return tmp_path / "gent.csv"


def test_fit_finds_the_law_and_draws_it(gent: None, table: Path, poro: Poro) -> None:
    ended = poro("fit", table, "--json")
    assert ended.code == ExitCode.OK, ended.err
    found = json.loads(ended.out)
    assert found["best"] == "gent"
    best = next(each for each in found["fits"] if each["name"] == "gent")
    assert best["coefficients"] == pytest.approx({"mu": SHEAR, "J_m": LIMIT}, rel=1e-5)
    assert parse_case(best["case"].encode(), "case.yaml", "case").parameters()[0].law == pytest.approx(
        (LIMIT,), rel=1e-5
    )
    assert table.with_name("gent.fit.png").exists()
    assert len({style_of(name) for name in LAWS}) == len(SHIPPED) + 1
    said = poro("fit", table, "--law", "gent", "--no-plot")
    assert "mu 0.4 N/mm², J_m 30\n" in said.out


def test_help_and_completion_list_it(gent: None, poro: Poro) -> None:
    from pipeline.cli.app import program
    from pipeline.cli.completion import laws

    assert laws("g") == ["gent"]
    assert "--law <all\\|neo-hooke\\|mooney-rivlin\\|yeoh\\|ogden\\|gent>" in reference(program(), "poro")
    assert "|gent>" in poro("fit", "--help").out


def test_law_that_does_not_say_how_it_is_fitted_is_left_out(table: Path, poro: Poro) -> None:
    with LAWS.registered("silent", SilentSettings):
        found = json.loads(poro("fit", table, "--json", "--no-plot", "--whole").out)
        assert [each["name"] for each in found["fits"]] == SHIPPED[:1] + SHIPPED[2:]
        assert found["left_out"]["silent"].startswith("silent does not say how it is fitted")
        alone = poro("fit", table, "--law", "silent")
        assert alone.code == ExitCode.USAGE
        assert "silent does not say how it is fitted" in alone.err
