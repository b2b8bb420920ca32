"""Mechanical and flow residuals: state at rest, objectivity, energy, and the regularisation."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from physics import (
    Floats,
    bases,
    coefficients,
    deformation_gradients,
    displacement_gradients,
    first_piola,
    fitted_permeability,
    half_cylinder,
    no_source,
    nodal_residuals,
    parameters,
    permeability,
    ramp,
    random_rotation,
    strain_energy,
    wavy,
)

from actuator.equations.discretisation import Discretisation
from actuator.equations.scheme import PressureElements, Scheme
from actuator.solve.equilibrium import Equilibrium

DOMAIN = half_cylinder()
C = coefficients()


@pytest.fixture(scope="module")
def discretisation() -> Discretisation:
    return Discretisation(DOMAIN)


@pytest.fixture(scope="module")
def source(discretisation: Discretisation) -> Floats:
    return discretisation.source(C.drainage)


CHI = DOMAIN.initial_design(DOMAIN.points, 3.0)
U = wavy(DOMAIN.nodes, 0.5, seed=1)
P = 0.05 * (1.0 + np.sin(0.2 * DOMAIN.points @ [1.0, 0.7, -0.4]))
REST = np.zeros_like(U)


def test_rest_is_free_of_stress_and_flow(discretisation: Discretisation, source: Floats) -> None:
    forces, _ = nodal_residuals(discretisation.geometry, source, C, CHI, REST, 0.0 * P)
    _, flow = nodal_residuals(discretisation.geometry, source, C._replace(pressure=0.0), CHI, REST, 0.0 * P)
    scale = np.abs(nodal_residuals(discretisation.geometry, source, C, CHI, REST, P)[0]).max()
    assert np.abs(forces).max() < 1e-14 * scale
    assert np.all(flow == 0.0)


def test_a_case_without_pressure_stays_at_rest() -> None:
    equilibrium = Equilibrium(DOMAIN, *parameters(load={"pressure_ratio": 0.0}), threads=1)
    state = equilibrium.solve(CHI)
    assert np.all(state.x == 0.0)
    assert np.all(state.p == 0.0)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_forces_turn_with_a_superposed_rotation(discretisation: Discretisation, source: Floats, seed: int) -> None:
    """P(Q F) = Q P(F); the flow, and the regularisation by second derivatives, see no rotation either."""
    Q, g = random_rotation(seed), discretisation.geometry
    turned = (DOMAIN.nodes + U) @ Q.T - DOMAIN.nodes + [3.0, -2.0, 1.0]
    stiff = C._replace(hessian_penalty=1.0)
    forces, flow = nodal_residuals(g, source, stiff, CHI, U, P)
    turned_forces, turned_flow = nodal_residuals(g, source, stiff, CHI, turned, P)
    assert np.abs(turned_forces - forces @ Q.T).max() < 1e-11 * np.abs(forces).max()
    assert np.abs(turned_flow - flow).max() < 1e-11 * np.abs(flow).max()


def test_rigid_motion_makes_no_force(discretisation: Discretisation, source: Floats) -> None:
    turned = DOMAIN.nodes @ (random_rotation(5) - np.eye(3)).T + [1.0, 2.0, 3.0]
    forces, _ = nodal_residuals(discretisation.geometry, source, C, CHI, turned, 0.0 * P)
    scale = np.abs(nodal_residuals(discretisation.geometry, source, C, CHI, U, P)[0]).max()
    assert np.abs(forces).max() < 1e-12 * scale


def total_energy(discretisation: Discretisation, u: Floats) -> float:
    """∫ Ψ + c_r/2 ‖ℍu‖², with F and χ from scikit-fem on the whole mesh."""
    linear, quadratic = bases(DOMAIN)
    factor = ramp(linear.interpolate(CHI), C)
    stored = np.sum(quadratic.dx * strain_energy(deformation_gradients(quadratic, u), factor, C))
    g = discretisation.geometry
    bent = np.einsum("eai,eab,ebi->", u[g.node_cells], g.hessian[g.cell_class], u[g.node_cells])
    return float(stored + 0.5 * C.hessian_penalty * bent)


def test_forces_are_the_gradient_of_the_stored_energy(discretisation: Discretisation, source: Floats) -> None:
    forces, _ = nodal_residuals(discretisation.geometry, source, C, CHI, U, 0.0 * P)
    for seed in range(3):
        d = wavy(DOMAIN.nodes, 1.0, seed=10 + seed) + np.random.default_rng(seed).normal(size=U.shape) * 0.1
        h = 2e-3  # fourth-order differences
        near = total_energy(discretisation, U + h * d) - total_energy(discretisation, U - h * d)
        far = total_energy(discretisation, U + 2 * h * d) - total_energy(discretisation, U - 2 * h * d)
        assert np.sum(forces * d) == pytest.approx((8.0 * near - far) / (12.0 * h), rel=1e-8)


@pytest.mark.parametrize("elements", get_args(PressureElements))
def test_residuals_match_weak_forms_written_with_scikit_fem(elements: PressureElements) -> None:
    """Eqs. (5) and (6) tested with random fields, all integrands from NumPy and scikit-fem."""
    discretisation = Discretisation(DOMAIN, Scheme(pressure=elements))
    source = discretisation.source(C.drainage)
    linear, quadratic = bases(DOMAIN)
    rng = np.random.default_rng(3)
    du, dp = rng.normal(size=U.shape), rng.normal(size=P.shape)
    forces, flow = nodal_residuals(discretisation.geometry, source, C._replace(hessian_penalty=0.0), CHI, U, P)
    chi, p, test = (linear.interpolate(field) for field in (CHI, P, dp))
    F = deformation_gradients(quadratic, U)
    stress = first_piola(F, ramp(chi, C), p, C)
    work = np.einsum("cqij,cqij,cq->", stress, displacement_gradients(quadratic, du), quadratic.dx)
    assert np.sum(forces * du) == pytest.approx(work, rel=1e-11)

    metric = np.linalg.det(F)[..., None, None] * np.linalg.inv(np.swapaxes(F, -1, -2) @ F)
    k = fitted_permeability(chi, C, linear.dx) if elements == "fitted" else permeability(chi, C)
    seepage = k * np.einsum("icq,cqij,jcq->cq", p.grad, metric, test.grad)
    if elements == "plain":
        pressed, drained = (p - C.pressure) * test, p * test
    else:  # summed by rows: products with the test function are interpolated from the vertices
        pressed, drained = linear.interpolate((P - C.pressure) * dp), linear.interpolate(P * dp)
    inflow = np.tile(source, (DOMAIN.layers, 1)) * pressed
    outflow = C.drainage / (1.0 + np.exp(-chi)) * drained
    expected = np.sum(linear.dx * (seepage + inflow + outflow))
    assert flow @ dp == pytest.approx(expected, rel=1e-11)


def test_pressure_does_work_on_the_deformed_volume(discretisation: Discretisation) -> None:
    """A uniform pressure is the gradient of p times the deformed volume."""
    g, flat = discretisation.geometry, np.full_like(P, 0.03)
    _, quadratic = bases(DOMAIN)
    with_pressure, _ = nodal_residuals(g, no_source(discretisation), C, CHI, U, flat)
    without, _ = nodal_residuals(g, no_source(discretisation), C, CHI, U, 0.0 * flat)
    d, h = wavy(DOMAIN.nodes, 1.0, seed=4), 1e-2

    def volume(u: Floats) -> float:
        return float(np.sum(quadratic.dx * np.linalg.det(deformation_gradients(quadratic, u))))

    # A cubic in h: fourth-order differences are exact.
    near, far = volume(U + h * d) - volume(U - h * d), volume(U + 2 * h * d) - volume(U - 2 * h * d)
    expected = -0.03 * (8.0 * near - far) / (12.0 * h)
    assert np.sum((with_pressure - without) * d) == pytest.approx(expected, rel=1e-9)


def test_smallest_jacobian_is_reported(discretisation: Discretisation) -> None:
    equilibrium = Equilibrium(DOMAIN, *parameters(), threads=1)
    _, quadratic = bases(DOMAIN)
    rng = np.random.default_rng(2)
    x = np.concatenate([rng.normal(size=equilibrium.kinematics.size - 3) * 0.2, [0.5, -0.4, 0.1]])
    u = equilibrium.kinematics.displacement(x)
    expected = np.linalg.det(deformation_gradients(quadratic, u)).min()
    assert equilibrium.residual(CHI, x, P)[3] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("kind", [float, complex])
def test_flow_alone_is_that_of_the_whole_residual(kind: type) -> None:
    equilibrium = Equilibrium(DOMAIN, *parameters(), threads=1)
    x = equilibrium.kinematics.reduced(U, np.array([0.5, -0.4, 0.1])).astype(kind)
    if kind is complex:
        x += 1e-3j * np.random.default_rng(4).normal(size=x.shape)
    _, flow, _, _ = equilibrium.residual(CHI, x, P)
    assert equilibrium.flow_residual(CHI, x, P) == pytest.approx(flow, rel=1e-14)
