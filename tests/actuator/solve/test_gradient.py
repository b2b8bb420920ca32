"""The reduced gradient and Hessian of every term of the objective, by Taylor remainders of converged states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from exact_product import hessian_product
from physics import LENGTH, Floats, half_cylinder, halvings, parameters, rates

from actuator.solve.reduced import Evaluation, ReducedObjective
from actuator.terms import PAPER

STATE, ADJOINT = 1e-12, 3e-11
DOMAIN = half_cylinder(2, 2, 3)

#: The weight that makes a term; C_0 has none and is what is left when all others are zero.
WEIGHTS = {
    "C_chi": "passive_weight",
    "C_A": "area_weight",
    "C_i": "slope_weight",
    "C_p": "leak_weight",
    "C_psi": "strain_energy_weight",
}

#: A strict strain limit makes C_Ψ active at the initial design; on this coarse mesh the walls leak and reach into
#: the passive core, and the field is too steep.
LIMIT = 0.055

STEPS = halvings(0.04, 3)


def reduced_objective(only: str | None) -> ReducedObjective:
    """The objective with every term ("all"), with C_0 alone (None), or with C_0 and one more term."""
    weights = {}
    if only != "all":
        weights = {weight: 0.0 for term, weight in WEIGHTS.items() if term != only}
    return ReducedObjective(
        DOMAIN,
        *parameters(strain_limit=LIMIT, **weights),
        state_tolerance=STATE,
        adjoint_tolerance=ADJOINT,
        threads=1,
    )


@dataclass(frozen=True)
class Path:
    """Designs χ + h d for h = 0 and for halved steps, with their states."""

    direction: Floats
    start: Evaluation
    ahead: list[Evaluation]

    def starts(self) -> tuple[Floats, Floats]:
        return self.start.state.x, self.start.state.p


@pytest.fixture(scope="module")
def path() -> Path:
    """The state does not depend on the weights: one path serves all terms."""
    objective = reduced_objective("all")
    r = np.hypot(DOMAIN.points[:, 1], DOMAIN.points[:, 2])
    chi = DOMAIN.initial_design(DOMAIN.points, 3.0) - 1.2 * (r / 15.0) ** 2  # leaks a little
    d = np.cos(DOMAIN.points @ np.array([0.25, -0.4, 0.3])) + 0.3 * np.sin(DOMAIN.points[:, 0] * np.pi / LENGTH)
    start = objective.evaluate(chi)
    warm = start.state.x, start.state.p
    return Path(d, start, [objective.evaluate(chi + h * d, warm) for h in STEPS])


@dataclass(frozen=True)
class Derivatives:
    """Gradient at the start, gradients along the path, and the Hessian times the direction."""

    gradient: Floats
    ahead: Floats
    product: Floats

    def __sub__(self, other: Derivatives) -> Derivatives:
        return Derivatives(self.gradient - other.gradient, self.ahead - other.ahead, self.product - other.product)


def derivatives(path: Path, only: str | None) -> Derivatives:
    objective = reduced_objective(only)
    start = objective.evaluate(path.start.chi, path.starts())
    gradient = objective.gradient(start)
    product = hessian_product(objective, start, gradient, path.direction, ADJOINT)
    ahead = [objective.gradient(objective.evaluate(at.chi, (at.state.x, at.state.p))).total for at in path.ahead]
    return Derivatives(gradient.total, np.array(ahead), product.hessian)


@pytest.fixture(scope="module")
def main_alone(path: Path) -> Derivatives:
    return derivatives(path, None)


def value(evaluation: Evaluation, term: str) -> float:
    return evaluation.value if term == "all" else evaluation.terms[term]


def taylor(values: list[float], slope: float, bend: float) -> tuple[Floats, Floats]:
    """Rates of the first- and second-order models of a value; ``values`` begins with that at h = 0."""
    change = np.array(values[1:]) - values[0]
    first = change - slope * STEPS
    return rates(first), rates(first - 0.5 * bend * STEPS**2)


def test_every_term_is_active(path: Path) -> None:
    assert set(PAPER) == {"C0", *WEIGHTS}
    assert all(abs(path.start.terms[term]) > 1e-3 for term in PAPER if term != "C_p"), path.start.terms
    assert path.start.terms["C_p"] > 1e-6
    assert path.start.measures["energy_ratio"] > 1.0
    assert path.start.measures["steepest"] > 1.0


@pytest.mark.parametrize("term", [*PAPER, "all"])
def test_taylor_rates_of_each_term(path: Path, main_alone: Derivatives, term: str) -> None:
    found = main_alone if term == "C0" else derivatives(path, term)
    if term not in ("C0", "all"):
        found = found - main_alone
    d, values = path.direction, [value(at, term) for at in (path.start, *path.ahead)]
    first, second = taylor(values, found.gradient @ d, found.product @ d)
    assert first.min() > 1.9
    errors = np.linalg.norm(found.ahead - found.gradient - STEPS[:, None] * found.product, axis=1)
    if term == "C_chi":  # piecewise quadratic: its second-order model leaves nothing but rounding
        assert max(errors) < 1e-11 * np.linalg.norm(found.gradient)
    else:
        assert second.min() > 2.9
        assert rates(errors).min() > 1.9


def test_hessian_is_symmetric(path: Path) -> None:
    objective = reduced_objective("all")
    start = objective.evaluate(path.start.chi, path.starts())
    gradient = objective.gradient(start)
    d, e = path.direction, np.random.default_rng(3).normal(size=path.direction.shape)
    forth = e @ hessian_product(objective, start, gradient, d, 1e-9).hessian
    back = d @ hessian_product(objective, start, gradient, e, 1e-9).hessian
    assert forth == pytest.approx(back, rel=1e-6)


def test_response_of_the_state_is_its_derivative(path: Path) -> None:
    objective = reduced_objective("all")
    start = objective.evaluate(path.start.chi, path.starts())
    product = hessian_product(objective, start, objective.gradient(start), path.direction, ADJOINT)
    for rate, states, at_rest in (
        (product.dx, [at.state.x for at in path.ahead], path.start.state.x),
        (product.dp, [at.state.p for at in path.ahead], path.start.state.p),
    ):
        errors = [np.linalg.norm(s - at_rest - h * rate) for s, h in zip(states, STEPS, strict=True)]
        assert rates(errors).min() > 1.9


@pytest.mark.parametrize(
    ("load", "mirrored", "tilt"),
    [({}, True, 0.0), ({"pressure_ratio": 0.04}, False, 2.0)],
    ids=["arm moves up", "strongly bent"],
)
def test_main_objective_in_other_regimes(load: dict[str, float], mirrored: bool, tilt: float) -> None:
    """The quadratic branch of C_0 for T3 > 0, and elements that are compressed to a tenth of their volume."""
    weights = dict.fromkeys(WEIGHTS.values(), 0.0)
    objective = ReducedObjective(
        DOMAIN, *parameters(load=load, **weights), state_tolerance=STATE, adjoint_tolerance=ADJOINT, threads=1
    )
    points = DOMAIN.points * ([1.0, 1.0, -1.0] if mirrored else 1.0)
    chi = DOMAIN.initial_design(points, 3.0) - tilt * points[:, 2] / 15.0
    d = np.cos(DOMAIN.points @ np.array([0.25, -0.4, 0.3]))
    start = objective.evaluate(chi)
    if mirrored:
        assert start.state.arm[1] > 0.0
    else:
        assert start.state.arm[2] > 0.05
        assert start.state.lowest_jacobian < 0.1
    gradient = objective.gradient(start)
    product = hessian_product(objective, start, gradient, d, ADJOINT)
    ahead = [objective.evaluate(chi + h * d, (start.state.x, start.state.p)) for h in STEPS]
    values = [at.value for at in (start, *ahead)]
    first, second = taylor(values, gradient.total @ d, product.hessian @ d)
    assert first.min() > 1.9
    assert second.min() > 2.9
    errors = [
        np.linalg.norm(objective.gradient(at).total - gradient.total - h * product.hessian)
        for at, h in zip(ahead, STEPS, strict=True)
    ]
    assert rates(errors).min() > 1.9
