"""Other elements, rules, precisions and tolerances solve the same problem; the defaults are what they always were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from physics import (
    RADIUS,
    Floats,
    bases,
    coefficients,
    half_cylinder,
    no_source,
    nodal_residuals,
    parameters,
    rates,
    wavy,
)
from small_case import small_domain, start_of

from actuator.domains.half_cylinder import HalfCylinder
from actuator.equations.discretisation import Discretisation
from actuator.equations.kinematics import Kinematics
from actuator.equations.scheme import Scheme
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.reduced import Evaluation, ReducedObjective

DOMAIN = half_cylinder(2, 2, 3)
HEX8 = Scheme("hex8")


def objective(scheme: Scheme, domain: HalfCylinder | None = None, tolerance: float = 1e-10) -> ReducedObjective:
    """The paper's problem with C0 alone."""
    material, load, limits = parameters(area_weight=0.0, slope_weight=0.0, leak_weight=0.0, passive_weight=0.0)
    return ReducedObjective(
        domain or small_domain(),
        material,
        load,
        replace(limits, strain_energy_weight=0.0),
        state_tolerance=tolerance,
        adjoint_tolerance=tolerance,
        threads=1,
        scheme=scheme,
    )


def solved(scheme: Scheme, domain: HalfCylinder | None = None) -> tuple[Evaluation, Floats]:
    """The initial design, and the gradient of C0."""
    model = objective(scheme, domain)
    at = model.evaluate(start_of(model.domain))
    return at, model.gradient(at).total


@pytest.fixture(scope="module")
def default() -> tuple[Evaluation, Floats]:
    return solved(Scheme())


# ---------------------------------------------------------------------------------------------- the defaults


def test_default_geometry_is_that_of_the_20_node_element_with_14_points_bit_by_bit() -> None:
    g = Discretisation(DOMAIN).geometry
    linear, quadratic = bases(DOMAIN)
    section = slice(0, DOMAIN.section_cells)
    assert np.array_equal(g.gradient20, np.stack([b[0].grad for b in quadratic.basis]).transpose(2, 3, 0, 1)[section])
    assert np.array_equal(g.volume, linear.dx[section])
    assert np.all(np.einsum("saa->sa", g.hessian) > 0.0)  # no node is left out


def test_naming_the_defaults_changes_no_bit(default: tuple[Evaluation, Floats]) -> None:
    at, gradient = solved(Scheme(element="hex20", quadrature=14, precision="single", forcing=1e-3))
    assert np.array_equal(at.state.x, default[0].state.x)
    assert np.array_equal(at.state.p, default[0].state.p)
    assert np.array_equal(gradient, default[1])


@pytest.mark.parametrize("forcing", [0.0, 1.0])
def test_schemes_that_make_no_sense_are_refused(forcing: float) -> None:
    with pytest.raises(ValueError, match="forcing must lie between 0 and 1"):
        Scheme(forcing=forcing)
    with pytest.raises(ValueError, match="element must be one of hex20, hex8, not 'tet4'"):
        # What types forbid, too: benchmarks make schemes of names.
        Scheme(element="tet4")  # type: ignore[arg-type]


# ----------------------------------------------------------------------------------------------- one problem


@pytest.mark.parametrize("scheme", [Scheme(precision="double"), Scheme(forcing=1e-6), Scheme(forcing=0.1)])
def test_how_it_is_solved_does_not_show_in_the_result(default: tuple[Evaluation, Floats], scheme: Scheme) -> None:
    at, gradient = solved(scheme)
    assert at.state.arm == pytest.approx(default[0].state.arm, rel=1e-10)
    assert at.terms["C0"] == pytest.approx(default[0].terms["C0"], rel=1e-10)
    assert np.linalg.norm(gradient - default[1]) < 1e-9 * np.linalg.norm(default[1])


@pytest.mark.parametrize(("points", "tolerance"), [(27, 1e-3), (8, 4e-2)])
def test_rules_agree(default: tuple[Evaluation, Floats], points: int, tolerance: float) -> None:
    """On cells as wide as the walls; what is left is the error of integrating across an interface."""
    at, gradient = solved(Scheme(quadrature=points))
    assert at.state.arm == pytest.approx(default[0].state.arm, rel=tolerance)
    assert np.linalg.norm(gradient - default[1]) < 2.0 * tolerance * np.linalg.norm(default[1])
    assert at.state.arm != pytest.approx(default[0].state.arm, rel=1e-5)


# ---------------------------------------------------------------------------------------- the 8-node element


def test_midpoints_follow_the_ends_of_their_edges() -> None:
    assert np.abs(DOMAIN.nodes[len(DOMAIN.points) :] - DOMAIN.points[DOMAIN.edges].mean(axis=1)).max() < 1e-14
    _, load, _ = parameters()
    kinematics = Kinematics(DOMAIN, load, "hex8")
    free_vertices = 3 * len(DOMAIN.points)
    assert kinematics.size < free_vertices
    rng = np.random.default_rng(1)
    x, dx = rng.normal(size=(2, kinematics.size))
    for u in (kinematics.displacement(x), kinematics.variation(x, dx)):
        assert np.abs(u[len(DOMAIN.points) :] - u[DOMAIN.edges].mean(axis=1)).max() < 1e-13
    # The arm's motion is affine on Γ, so that midpoints of its edges move with it.
    height, angle = DOMAIN.nodes[DOMAIN.tip.nodes, 2], x[-1]
    tip = kinematics.displacement(x)[DOMAIN.tip.nodes]
    assert tip[:, 0] == pytest.approx(x[-3] + height * np.sin(angle), abs=1e-13)


@pytest.mark.parametrize("penalty", [0.0, 5e-3])
def test_8_nodes_are_the_20_with_midpoints_tied_to_their_ends(penalty: float) -> None:
    """Galerkin's method on the trilinear subspace, c_r included: half of each midpoint's force goes to either end."""
    c = coefficients(hessian_penalty=penalty)
    chi, p = start_of(DOMAIN), 0.05 * (1.0 + np.sin(DOMAIN.points[:, 0]))
    u = wavy(DOMAIN.nodes, 0.3, seed=2)
    n = len(DOMAIN.points)
    u[n:] = u[DOMAIN.edges].mean(axis=1)
    full, reduced = (Discretisation(DOMAIN, scheme) for scheme in (Scheme(), HEX8))
    forces, flow = nodal_residuals(full.geometry, no_source(full), c, chi, u, p)
    expected = forces[:n].copy()
    for end in DOMAIN.edges.T:
        np.add.at(expected, end, 0.5 * forces[n:])
    found, found_flow = nodal_residuals(reduced.geometry, no_source(reduced), c, chi, u, p)
    assert np.abs(found[:n] - expected).max() < 1e-12 * np.abs(expected).max()
    assert np.all(found[n:] == 0.0)
    assert np.abs(found_flow - flow).max() < 1e-12 * np.abs(flow).max()


@pytest.mark.parametrize("points", [8, 14])
def test_tangent_of_8_nodes_is_the_derivative_of_its_residual(points: int) -> None:
    equilibrium = Equilibrium(DOMAIN, *parameters(), threads=1, scheme=Scheme("hex8", points))
    rng = np.random.default_rng(5)
    chi, x = start_of(DOMAIN), 0.05 * rng.normal(size=equilibrium.kinematics.size)
    p = 0.05 * rng.uniform(size=len(chi))
    dx, dp = rng.normal(size=len(x)), rng.normal(size=len(p))
    _, _, nodal, lowest = equilibrium.residual(chi, x, p)
    assert lowest > 0.0
    equilibrium.tangent.assemble(equilibrium.source, equilibrium.coefficients, chi, x, p, nodal)
    products = equilibrium.tangent.multiply(dx, dp)
    h = 1e-40
    for product, derivative in zip(products, equilibrium.residual(chi, x + 1j * h * dx, p + 1j * h * dp), strict=False):
        assert np.abs(product - derivative.imag / h).max() < 1e-11 * np.abs(product).max()


def test_gradient_with_8_nodes_and_8_points_is_exact() -> None:
    model = objective(Scheme("hex8", 8), DOMAIN, 1e-12)
    chi = start_of(DOMAIN)
    direction = np.cos(DOMAIN.points @ [0.25, -0.4, 0.3])
    at = model.evaluate(chi)
    slope = model.gradient(at).total @ direction
    steps = 0.04 * 0.5 ** np.arange(3)
    ahead = [model.evaluate(chi + h * direction, (at.state.x, at.state.p)).value for h in steps]
    assert rates(np.array(ahead) - at.value - slope * steps).min() > 1.9


def test_8_nodes_converge_to_20() -> None:
    """With half the size of the cells the difference falls to a quarter, the rate of the trilinear element."""
    differences = []
    for domain in (half_cylinder(2, 1, 3), half_cylinder(4, 2, 6)):
        chi = 2.0 - domain.points[:, 2] / RADIUS  # solid without walls that a coarse mesh cannot hold
        arms = [objective(scheme, domain).evaluate(chi).state.arm[2] for scheme in (HEX8, Scheme())]
        differences.append(abs(arms[0] / arms[1] - 1.0))
    assert 0.01 < differences[1] < 0.3 * differences[0]
