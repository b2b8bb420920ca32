"""A term of the objective from outside the product: registered, named in a case, optimised with."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from command_line import TINY, Poro
from exact_product import hessian_product
from made_up_term import AxialDisplacement, Mass
from physics import halvings, rates, remainders
from small_case import small_objective, start_of

from actuator.terms import TERMS
from pipeline.case.model import parse_case
from pipeline.exit_codes import Fault
from stages import optimize

BOTH = {"C_M": {"weight": 2.0}, "C_X": {"weight": 3.0, "reach": 0.5}}


@pytest.fixture(autouse=True)
def made_up() -> Iterator[None]:
    with TERMS.registered("C_M", Mass), TERMS.registered("C_X", AxialDisplacement):
        yield


def with_terms(text: str) -> str:
    return TINY.replace("objective:\n", f"objective:\n  terms: {{{text}}}\n")


def test_gradient_and_curvature_of_the_sum_are_exact() -> None:
    """Value, gradient and Hessian product with both terms, along a line of designs."""
    objective = small_objective(tolerance=1e-11, terms=BOTH)
    chi = start_of(objective.domain) - 1.0
    at = objective.evaluate(chi)
    assert set(at.terms) == {"C0", "C_chi", "C_A", "C_i", "C_p", "C_psi", "C_M", "C_X"}
    assert min(at.terms["C_M"], at.terms["C_X"]) > 0.0
    assert 0.0 < at.measures["solid_share"] < 1.0
    d = np.cos(objective.domain.points @ [0.25, -0.4, 0.3])
    gradient = objective.gradient(at)
    slope, bend = gradient.total @ d, d @ hessian_product(objective, at, gradient, d).hessian

    def value(h: float) -> float:
        there = objective.evaluate(chi + h * d, (at.state.x, at.state.p))
        return there.value - there.terms["C_chi"] + at.terms["C_chi"]  # its second derivative has kinks

    passive = objective.design(chi).gradient - objective.design.smooth(chi).gradient
    steps = halvings(0.05)
    first = remainders(value, lambda h: at.value + h * (slope - passive @ d), steps)
    assert rates(first).min() > 1.9
    assert abs(bend) > 0.0


def test_each_term_changes_gradient_and_product_by_its_own() -> None:
    """Against differences of the terms alone, the state held or not."""
    plain, more = small_objective(tolerance=1e-11), small_objective(tolerance=1e-11, terms={"C_M": {"weight": 2.0}})
    chi = start_of(plain.domain) - 1.0
    at, with_mass = plain.evaluate(chi), more.evaluate(chi)
    d = np.sin(plain.domain.points @ [0.2, 0.5, -0.1])
    term = Mass(more.cases[0].problem, weight=2.0)
    h = 1e-5
    slope = (term.value(chi + h * d) - term.value(chi - h * d)) / (2.0 * h)
    bend = (term.value(chi + 1e-3 * d) - 2.0 * term.value(chi) + term.value(chi - 1e-3 * d)) / 1e-6
    assert (more.gradient(with_mass).total - plain.gradient(at).total) @ d == pytest.approx(slope, rel=1e-6)
    products = [
        hessian_product(objective, there, objective.gradient(there), d).hessian @ d
        for objective, there in ((more, with_mass), (plain, at))
    ]
    assert products[0] - products[1] == pytest.approx(bend, rel=1e-4)


def test_an_optimisation_takes_it_from_the_case_file() -> None:
    plain, light = (
        optimize.run(
            parse_case(text.encode(), "c.yaml", "c").optimize.model_copy(
                update={"optimizer": optimize.OptimizerSettings(max_updates=2)}
            ),
            compute=optimize.Compute(threads=1),
        )
        for text in (TINY, with_terms("C_M: {weight: 50.0}"))
    )
    assert "C_M" not in plain.history
    assert light.history["C"] == pytest.approx(sum(light.history[name] for name in light.summary["terms"]), rel=1e-12)
    assert light.history["C_M"][-1] < light.history["C_M"][0]
    assert np.mean(1.0 / (1.0 + np.exp(-light.chi))) < np.mean(1.0 / (1.0 + np.exp(-plain.chi)))


def test_the_command_line_stores_it(poro: Poro, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("term")
    (folder / "case.yaml").write_text(with_terms("C_M: {weight: 5.0}"))
    ended = poro("optimize", str(folder / "case.yaml"), "--output", str(folder))
    assert ended.code == 0, ended.err
    assert poro("status", str(folder / "case.yaml"), "--output", str(folder)).out.startswith("optimize  up to date")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("C_Q: {weight: 1.0}", "no further term 'C_Q'; there are C_M, C_X"),
        ("C_p: {weight: 1.0}", "no further term 'C_p'"),
        ("C_M: {wait: 1.0}", "'C_M' does not take these parameters"),
        ("C_M: {}", "it has weight"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(text: str, sentence: str) -> None:
    with pytest.raises(Fault, match=r"^c\.yaml:\d+: objective\.terms: ") as fault:
        parse_case(with_terms(text).encode(), "c.yaml", "c")
    assert sentence in str(fault.value)
