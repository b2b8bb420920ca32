"""Values of the objective's terms against closed forms, and derivatives of those that depend on χ alone."""

from __future__ import annotations

import numpy as np
import pytest
from exact_product import design_product
from physics import (
    IDENTITY,
    LENGTH,
    RADIUS,
    STRETCH,
    Floats,
    bases,
    coefficients,
    half_cylinder,
    halvings,
    parameters,
    ramp,
    rates,
    remainders,
    strain_energy,
)

from actuator.parameters import Objective
from actuator.solve.reduced import ReducedObjective, spring_elongation
from actuator.terms import total_objective
from actuator.terms.design import DesignObjective, DesignTerms
from actuator.terms.goals.bending import PAPER_GOAL
from actuator.terms.interface import Problem
from actuator.terms.strain_energy import strain_energy_excess
from pipeline.results.paper import REFERENCES

DOMAIN = half_cylinder(2, 2, 3)
WIDTH = 3.0
X = DOMAIN.points
ONES = np.ones(DOMAIN.mesh.nvertices)
#: Solid in the passive core and steep at places: every term of the design is active.
BUSY = DOMAIN.initial_design(X, WIDTH) + 2.0 * np.sin(X @ [0.9, 0.5, 0.7])


@pytest.fixture(scope="module")
def reduced() -> ReducedObjective:
    return ReducedObjective(DOMAIN, *parameters(), threads=1)


def design_objective(reduced: ReducedObjective, **weights: float) -> DesignObjective:
    *_, objective = parameters(**weights)
    problem = Problem(reduced.discretisation, coefficients(), LOAD, objective)
    return total_objective([problem], [1.0], reduced.design.gather).design


def value(terms: DesignTerms, name: str) -> float:
    return terms.terms[name].value


# ------------------------------------------------------------------------------------------------- C_0


LOAD = parameters()[1]


def motion_of(T1: float, T3: float, angle: float) -> np.ndarray:
    return np.array([T1, 0.0, T3, 0.0, angle, 0.0])


@pytest.mark.parametrize(("T1", "T3", "angle"), [(0.0, 0.0, 0.0), (0.3, -2.305, 0.21878), (0.1, 1.7, -0.4)])
def test_main_objective_of_equation_9(T1: float, T3: float, angle: float) -> None:
    lift = T3 / 60.0
    expected = lift - np.sin(angle) + (500.0 * lift**2 if T3 > 0.0 else 0.0)
    assert PAPER_GOAL.value(motion_of(T1, T3, angle), LOAD) == pytest.approx(expected, rel=1e-14)


def test_main_objective_of_the_published_design() -> None:
    """Table 2 gives C0 = -0.255447 for T3 = -2.305 mm and θ2 = 0.21878 rad, printed to four and five digits."""
    found = PAPER_GOAL.value(motion_of(0.0, REFERENCES[0].T3, 0.21878), LOAD)
    assert found == pytest.approx(REFERENCES[0].C0, abs=1e-5)


def test_travel_of_the_spring_is_positive_downwards(reduced: ReducedObjective) -> None:
    evaluation = reduced.evaluate(DOMAIN.initial_design(X, WIDTH))
    T1, T3, angle = evaluation.state.arm
    assert T3 < 0.0 < angle
    assert spring_elongation(reduced.equilibrium.kinematics, evaluation.state) == pytest.approx(
        60.0 * np.sin(angle) - T3, rel=1e-14
    )
    assert evaluation.terms["C0"] == pytest.approx(PAPER_GOAL.value(motion_of(T1, T3, angle), LOAD), rel=1e-14)
    assert evaluation.value == pytest.approx(sum(evaluation.terms.values()), rel=1e-15)


# ------------------------------------------------------------------------------ terms of the design alone


@pytest.mark.parametrize("chi", [-4.0, 0.0, 0.7, 30.0])
def test_area_of_a_uniform_field(reduced: ReducedObjective, chi: float) -> None:
    """C_A = c_A |Ω|^(1/3) 8/L_i ρ (1 - ρ)."""
    rho, void = 1.0 / (1.0 + np.exp(-chi)), 1.0 / (1.0 + np.exp(chi))
    expected = 2e-3 * reduced.discretisation.volume ** (1.0 / 3.0) * 8.0 / WIDTH * rho * void
    terms = design_objective(reduced, area_weight=2e-3)(chi * ONES)
    assert value(terms, "C_A") == pytest.approx(expected, rel=1e-12, abs=1e-18)


def test_area_of_a_flat_interface_is_that_of_the_section(reduced: ReducedObjective) -> None:
    """Across a well resolved interface of slope s, ∫ρ(1-ρ) is 1/s per area, so that 8/L_i ∫ρ(1-ρ) is the area."""
    fine = ReducedObjective(half_cylinder(1, 1, 160), *parameters(), threads=1)
    slope = 8.0 / WIDTH
    terms = fine.design(slope * (fine.domain.points[:, 0] - LENGTH / 2.0))
    volume = fine.discretisation.volume
    assert value(terms, "C_A") == pytest.approx(1e-3 / volume ** (2.0 / 3.0) * volume / LENGTH, rel=1e-6)


@pytest.mark.parametrize("factor", [0.5, 0.999, 1.2, 3.0])
def test_slope_of_a_linear_field(reduced: ReducedObjective, factor: float) -> None:
    """C_i = c_i/6 |Ω| <‖∇χ‖ - 8/L_i>⁶."""
    limit = 8.0 / WIDTH
    gradient = factor * limit * np.array([2.0, -1.0, 2.0]) / 3.0
    terms = design_objective(reduced, slope_weight=0.7)(X @ gradient)
    expected = 0.7 / 6.0 * reduced.discretisation.volume * max((factor - 1.0) * limit, 0.0) ** 6
    assert value(terms, "C_i") == pytest.approx(expected, rel=1e-10, abs=1e-30)
    assert terms.terms["C_i"].measures["steepest"] == pytest.approx(factor, rel=1e-12)


def printed_limit(r: Floats) -> Floats:
    """The bound inside Eq. (21), with min_LSE of Eq. (20) as printed."""
    smooth = -4.0 / WIDTH * np.log(np.exp(-r * WIDTH / 4.0) + np.exp(r * WIDTH / 4.0))
    return 8.0 / WIDTH * np.minimum(RADIUS - r, -smooth - 0.3 * RADIUS)


def test_passive_bound_of_appendix_b() -> None:
    def at(r: Floats) -> Floats:
        return DOMAIN.passive_bound(np.stack([0.0 * r, 0.6 * r, -0.8 * r], axis=-1), WIDTH)

    r = np.linspace(0.0, RADIUS, 40)
    assert at(r) == pytest.approx(printed_limit(r), rel=1e-12, abs=1e-12)
    far = at(np.array([0.0, 0.31 * RADIUS, 0.6 * RADIUS, RADIUS]))
    assert far[0] < 0.0 < far[1] < far[2]
    assert abs(far[3]) < 1e-14


@pytest.mark.parametrize("field", [BUSY, 3.0 * ONES], ids=["busy", "uniform"])
def test_passive_void_of_a_known_field(reduced: ReducedObjective, field: Floats) -> None:
    linear, _ = bases(DOMAIN)
    _, x2, x3 = np.asarray(linear.global_coordinates())
    over = np.asarray(linear.interpolate(field)) - printed_limit(np.hypot(x2, x3))
    expected = 0.5 * 1e5 * np.sum(linear.dx * np.where(over > 0.0, over, 0.0) ** 2)
    assert expected > 0.0
    assert value(reduced.design(field), "C_chi") == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("field", [np.sin(X @ [0.9, 0.5, 0.7]), 3.0 * ONES], ids=["half", "uniform"])
def test_share_of_the_solid_in_the_passive_core(reduced: ReducedObjective, field: Floats) -> None:
    linear, _ = bases(DOMAIN)
    _, x2, x3 = np.asarray(linear.global_coordinates())
    solid = linear.dx * (np.asarray(linear.interpolate(field)) > 0.0)
    expected = np.sum(solid * (printed_limit(np.hypot(x2, x3)) < 0.0)) / np.sum(solid)
    assert 0.0 < expected < 1.0
    assert reduced.design.passive.share(field) == pytest.approx(expected, rel=1e-11)


def test_no_solid_no_share(reduced: ReducedObjective) -> None:
    assert reduced.design.passive.share(-ONES) == 0.0


def test_nothing_is_passive_in_a_void(reduced: ReducedObjective) -> None:
    terms = reduced.design(-40.0 * ONES)
    assert value(terms, "C_chi") == 0.0
    assert value(terms, "C_i") == 0.0
    assert terms.terms["C_i"].measures["steepest"] < 1e-12


@pytest.mark.parametrize(
    "active", ["passive_weight", "area_weight", "slope_weight", "all"], ids=["C_chi", "C_A", "C_i", "all"]
)
def test_gradient_and_hessian_of_the_design_terms(reduced: ReducedObjective, active: str) -> None:
    names = ("passive_weight", "area_weight", "slope_weight")
    weights = dict.fromkeys(names, 0.0) | ({} if active == "all" else {active: 1.0})
    objective = design_objective(reduced, **({} if active == "all" else weights))
    d = np.random.default_rng(1).normal(size=ONES.shape)
    at = objective(BUSY)
    upper = objective.gather.matrix(at.hessian)
    product = upper @ d + upper.T @ d - upper.diagonal() * d
    assert at.value > 0.0

    def total(h: float) -> float:
        return objective(BUSY + h * d).value

    # Small enough that no quadrature point enters or leaves the passive limit, whose square has a kink in its slope.
    steps = halvings(2e-3)
    first = remainders(total, lambda h: at.value + h * at.gradient @ d, steps)
    assert rates(first).min() > 1.9
    slopes = remainders(lambda h: objective(BUSY + h * d).gradient, lambda h: at.gradient + h * product, steps)
    if active != "passive_weight":  # C_χ is quadratic here: nothing is left over
        assert rates(slopes).min() > 1.9
    else:
        assert max(slopes) < 1e-9 * np.linalg.norm(at.gradient)


@pytest.mark.parametrize("field", [BUSY, 3.0 * ONES, -40.0 * ONES], ids=["busy", "uniform", "void"])
def test_value_alone_is_the_same_to_the_last_bit(reduced: ReducedObjective, field: Floats) -> None:
    assert reduced.design.value(field) == reduced.design(field).value


def test_terms_without_the_passive_region(reduced: ReducedObjective) -> None:
    without, alone = reduced.design.smooth(BUSY), design_objective(reduced, passive_weight=0.0)(BUSY)
    assert value(without, "C_chi") == 0.0
    assert value(reduced.design(BUSY), "C_chi") > 0.0
    assert without.value == alone.value
    np.testing.assert_array_equal(without.gradient, alone.gradient)
    np.testing.assert_array_equal(without.hessian, alone.hessian)


def test_passive_term_from_its_points(reduced: ReducedObjective) -> None:
    """C_χ, its gradient and Hessian put together from room, volumes and shape functions."""
    design = reduced.design
    with_passive, without = design(BUSY), design.smooth(BUSY)
    over = np.maximum(-design.passive.room(BUSY), 0.0)
    weight, volumes = design.passive.weight, design.points.volumes
    assert 0.5 * weight * np.sum(volumes * over**2) == pytest.approx(value(with_passive, "C_chi"), rel=1e-12)
    gradient = with_passive.gradient - without.gradient
    assert weight * design.from_points(over) == pytest.approx(gradient, abs=1e-9 * np.abs(gradient).max())
    hessian = with_passive.hessian - without.hessian
    stiffness = weight * design.point_stiffness((over > 0.0).astype(float))
    assert stiffness == pytest.approx(hessian, abs=1e-9 * np.abs(hessian).max())
    assert design.points.at(ONES) == pytest.approx(np.ones_like(volumes), rel=1e-14)


def test_design_terms_and_product_fit_together(reduced: ReducedObjective) -> None:
    evaluation = reduced.evaluate(DOMAIN.initial_design(X, WIDTH))
    d = np.random.default_rng(2).normal(size=ONES.shape)
    terms: DesignTerms = evaluation.design
    assert terms.value == pytest.approx(sum(value(terms, name) for name in ("C_chi", "C_A", "C_i")), rel=1e-15)
    h = 1e-5
    difference = reduced.design(evaluation.chi + h * d).gradient - reduced.design(evaluation.chi - h * d).gradient
    product = design_product(reduced, evaluation, d)
    assert difference / (2.0 * h) == pytest.approx(product, rel=1e-5, abs=1e-6 * np.abs(product).max())


# ------------------------------------------------------------------------------- leak and strain energy


def test_leak_of_known_pressures_on_the_wall(reduced: ReducedObjective) -> None:
    """C_p = c_p/2 (p/p_in)² averaged over the wall."""
    p_in, leak = reduced.load.pressure, reduced.total.cases[0].leak
    flat, rising = 0.3 * p_in * ONES, p_in * X[:, 0] / LENGTH
    assert 0.5 * flat @ leak.matrix @ flat == pytest.approx(0.5e6 * 0.09, rel=1e-12)
    assert 0.5 * rising @ leak.matrix @ rising == pytest.approx(0.5e6 / 3.0, rel=1e-12)
    inside = p_in * ONES
    inside[DOMAIN.outside.vertices] = 0.0
    assert abs(inside @ leak.matrix @ inside) < 1e-10


@pytest.mark.parametrize(("limit", "shift"), [(0.02, "4/L_i"), (0.14, "4/L_i"), (0.02, 0.0), (0.02, 2.5)])
def test_strain_energy_term_of_a_homogeneous_deformation(
    reduced: ReducedObjective, limit: float, shift: float | str
) -> None:
    """C_Ψ = c_Ψ/6 |Ω| <Ψ(χ + 4/L_i) / Ψ_lim - 1>⁶, or with another shift."""
    objective: Objective = parameters(strain_limit=limit, strain_energy_shift=shift)[2]
    assert objective.energy_limit == pytest.approx(0.5 * 2.736 * limit**2, rel=1e-14)
    c = coefficients(strain_energy_weight=7.0, energy_limit=objective.energy_limit, energy_shift=objective.energy_shift)
    chi, F = -0.4, IDENTITY + 0.15 * (STRETCH - IDENTITY)
    ratio = (
        strain_energy(F, ramp(chi + (4.0 / WIDTH if shift == "4/L_i" else float(shift)), c), c) / objective.energy_limit
    )
    assert (ratio > 1.0) == (limit < 0.1)
    found, largest = strain_energy_excess(reduced.equilibrium.geometry, c, chi * ONES, DOMAIN.nodes @ (F - IDENTITY).T)
    assert largest == pytest.approx(ratio, rel=1e-11)
    excess = max(ratio - 1.0, 0.0)
    assert found == pytest.approx(7.0 / 6.0 * reduced.discretisation.volume * excess**6, rel=1e-9)


def test_inverted_element_has_unbounded_strain_energy(reduced: ReducedObjective) -> None:
    u = np.zeros_like(DOMAIN.nodes)
    u[:, 0] = -2.0 * DOMAIN.nodes[:, 0]
    found, _ = strain_energy_excess(reduced.equilibrium.geometry, coefficients(), ONES, u)
    assert found == np.inf
