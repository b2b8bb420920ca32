"""Other laws than neo-Hooke's in the element loops, the state and the gradient. Ogden's by default; the others slow."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from exact_product import hessian_product
from physics import (
    IDENTITY,
    Floats,
    assembled,
    boundary_nodes,
    displacement_dofs,
    element_tangents,
    half_cylinder,
    no_source,
    nodal_residuals,
    parameters,
    wavy,
)
from scipy.optimize import brentq

from actuator.assembly import scatter_vector
from actuator.compilation import compile_kernels
from actuator.discretisation import Discretisation
from actuator.initial_design import initial_design
from actuator.kernels import lagrangian_gradient, strain_energy_excess
from actuator.laws.coefficients import NEO_HOOKE, Law, MooneyRivlin, Ogden, Yeoh
from actuator.material import Coefficients
from actuator.reduced import ReducedObjective
from actuator.source import pressure_source

SLOW = pytest.mark.slow
LAWS = [
    pytest.param(Ogden.of([0.7, 0.2, 0.1], [1.3, 5.0, -2.0]), id="ogden"),
    pytest.param(MooneyRivlin(0.13), id="mooney-rivlin", marks=SLOW),
    pytest.param(Yeoh(-0.02, 0.4), id="yeoh", marks=SLOW),
]
#: Members of each family that are neo-Hooke's law.
REDUCED = [
    pytest.param(Ogden.of([1.0], [2.0]), id="ogden"),
    pytest.param(MooneyRivlin(0.0), id="mooney-rivlin", marks=SLOW),
    pytest.param(Yeoh(0.0, 0.0), id="yeoh", marks=SLOW),
]
DOMAIN = half_cylinder(2, 1, 3)
TINY = 1e-40


@pytest.fixture(autouse=True)
def compiled(request: pytest.FixtureRequest) -> None:
    """Kernels of the test's law, compiled as a user's run does."""
    compile_kernels(request.node.callspec.params["law"])


def coefficients(law: Law, **changes: float) -> Coefficients:
    material, load, objective = parameters()
    return Coefficients.of(dataclasses.replace(material, law=law), load, objective)._replace(**changes)


def objective_of(law: Law, tolerance: float = 1e-8, **changes: float) -> ReducedObjective:
    """The small problem with another law."""
    material, load, objective = parameters(**changes)
    return ReducedObjective(
        DOMAIN,
        dataclasses.replace(material, law=law),
        load,
        objective,
        state_tolerance=tolerance,
        adjoint_tolerance=10.0 * tolerance,
        threads=1,
    )


@pytest.fixture(scope="module")
def discretisation() -> Discretisation:
    return Discretisation(DOMAIN)


def fields() -> tuple[Floats, Floats, Floats]:
    rng, n = np.random.default_rng(1), DOMAIN.mesh.nvertices
    return 3.0 * rng.normal(size=n), wavy(DOMAIN.nodes, 0.5, 3), 0.05 * rng.uniform(size=n)


@pytest.mark.parametrize("law", LAWS)
def test_tangent_is_the_derivative_of_the_residual(law: Law, discretisation: Discretisation) -> None:
    geometry, c = discretisation.geometry, coefficients(law)
    chi, u, p = fields()
    source = pressure_source(discretisation.radii, DOMAIN.radius, c.drainage)
    blocks = element_tangents(geometry, source, c, chi, u, p)[0]
    assert np.abs(blocks - blocks.transpose(0, 2, 1)).max() < 1e-13 * np.abs(blocks).max()
    dofs, d = displacement_dofs(geometry), wavy(DOMAIN.nodes, 1.0, 5)
    forces, _ = nodal_residuals(geometry, source, c, chi, u + 1j * TINY * d, p)
    found = assembled(blocks, dofs, dofs, (u.size, u.size)) @ d.ravel()
    assert np.abs(found - forces.imag.ravel() / TINY).max() < 1e-13 * np.abs(found).max()


@pytest.mark.parametrize("law", LAWS)
def test_lagrangian_gradient_and_its_complex_step(law: Law, discretisation: Discretisation) -> None:
    """First derivatives against values of Λ·R + C_Ψ, and second against first."""
    geometry, c = discretisation.geometry, coefficients(law, energy_limit=1e-3, strain_energy_weight=1e-6)
    source = pressure_source(discretisation.radii, DOMAIN.radius, c.drainage)
    chi, u, p = fields()
    adjoint, flow = wavy(DOMAIN.nodes, 1.0, 8), np.random.default_rng(4).normal(size=p.shape)
    d_chi, d_u = np.random.default_rng(5).normal(size=chi.shape), wavy(DOMAIN.nodes, 0.7, 6)

    def value(h: float) -> float:
        forces, flows = nodal_residuals(geometry, source, c, chi + h * d_chi, u + h * d_u, p)
        excess, ratio = strain_energy_excess(geometry, c, chi + h * d_chi, u + h * d_u)
        assert ratio > 1.0
        return float(np.sum(adjoint * forces) + flow @ flows + excess)

    def gradient(h: complex) -> tuple[Floats, Floats]:
        kind = np.result_type(h, float)
        n = len(geometry.cells)
        out = np.empty((n, 8), kind), np.empty((n, 20, 3), kind), np.empty((n, 8), kind)
        at = (chi + h * d_chi, u + h * d_u, p.astype(kind), adjoint.astype(kind), flow.astype(kind))
        lagrangian_gradient(geometry, source, c, *at, 1.0, True, *out)
        return scatter_vector(out[0], geometry.cells, len(chi)), scatter_vector(out[1], geometry.node_cells, len(u))

    h = 1e-5
    of_chi, of_u = gradient(0.0)
    central = (value(h) - value(-h)) / (2.0 * h)
    assert np.sum(of_chi * d_chi) + np.sum(of_u * d_u) == pytest.approx(central, rel=1e-7)
    for exact, ahead, behind in zip(gradient(1j * TINY), gradient(h), gradient(-h), strict=True):
        second = (ahead - behind) / (2.0 * h)
        assert np.abs(exact.imag / TINY - second).max() < 1e-7 * np.abs(second).max()


@pytest.mark.parametrize("law", REDUCED)
def test_state_of_an_actuator_reduces_to_neo_hooke(law: Law) -> None:
    chi = initial_design(DOMAIN.points, 15.0, 3.0)
    found, due = (objective_of(each, 1e-11).evaluate(chi) for each in (law, NEO_HOOKE))
    assert np.abs(due.state.displacement).max() > 0.05
    assert found.state.displacement == pytest.approx(due.state.displacement, rel=1e-9, abs=1e-10)
    assert found.value == pytest.approx(due.value, rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_patch_in_uniaxial_tension(law: Law, discretisation: Discretisation) -> None:
    """A solid, nearly incompressible body under a homogeneous stretch: no force inside, the closed form at its end."""
    material, load, objective = parameters(material={"poisson_ratio": 0.499999})
    c = Coefficients.of(dataclasses.replace(material, law=law), load, objective)._replace(hessian_penalty=0.0)
    geometry, stretch = discretisation.geometry, 1.6
    solid, empty = np.full(DOMAIN.mesh.nvertices, 800.0), np.zeros(DOMAIN.mesh.nvertices)
    inside = ~boundary_nodes(DOMAIN)
    end = DOMAIN.nodes[:, 0] > DOMAIN.nodes[:, 0].max() - 1e-9

    def forces(lateral: float) -> Floats:
        F = np.diag([stretch, lateral, lateral])
        u = DOMAIN.nodes @ (F - IDENTITY)
        return nodal_residuals(geometry, no_source(discretisation), c, solid, u, empty)[0]

    def side(lateral: float) -> float:
        """Lateral stress through the virial of all forces."""
        return float(np.sum(forces(lateral)[:, 2] * DOMAIN.nodes[:, 2]))

    lateral = brentq(side, 0.95 * stretch**-0.5, 1.05 * stretch**-0.5, xtol=1e-15)
    found = forces(lateral)
    area = discretisation.volume / DOMAIN.length
    assert np.abs(found[inside]).max() < 1e-8 * np.abs(found).max()  # rounding of a bulk modulus of 5e5 G
    x = stretch**2 + 2.0 / stretch - 3.0
    slope = stretch - stretch**-2
    if isinstance(law, Ogden):
        closed = sum(2.0 * mu / a * (stretch ** (a - 1.0) - stretch ** (-a / 2.0 - 1.0)) for mu, a in law.terms)
    elif isinstance(law, Yeoh):
        closed = 2.0 * slope * (0.5 + 2.0 * law.c2 * x + 3.0 * law.c3 * x**2)
    else:
        closed = 2.0 * slope * (0.5 - law.c01 + law.c01 / stretch)
    assert found[end, 0].sum() / area == pytest.approx(c.shear * closed, rel=2e-5)


@pytest.mark.parametrize("law", LAWS)
def test_gradient_and_hessian_of_the_converged_objective(law: Law) -> None:
    """Against central differences of states solved anew, with every term of the objective at work."""
    objective = objective_of(law, 1e-12, strain_limit=0.04)
    chi = initial_design(DOMAIN.points, 15.0, 3.0)
    d = np.cos(DOMAIN.points @ [0.25, -0.4, 0.3])
    start = objective.evaluate(chi)
    assert start.energy_ratio > 1.0
    gradient = objective.gradient(start)
    product = hessian_product(objective, start, gradient, d, 1e-11).hessian
    h = 1e-4
    ahead, behind = (objective.evaluate(chi + s * d, (start.state.x, start.state.p)) for s in (h, -h))
    assert (ahead.value - behind.value) / (2.0 * h) == pytest.approx(gradient.total @ d, rel=1e-6)
    change = (objective.gradient(ahead).total - objective.gradient(behind).total) / (2.0 * h)
    # C_χ has kinks in its second derivative where a vertex enters the passive core.
    assert np.abs(change - product).max() < 1e-5 * np.abs(product).max()
