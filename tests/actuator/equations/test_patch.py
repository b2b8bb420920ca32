"""Patch tests on curved cells: homogeneous states are reproduced to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from physics import (
    IDENTITY,
    STRETCH,
    Floats,
    boundary_nodes,
    coefficients,
    first_piola,
    half_cylinder,
    no_source,
    nodal_residuals,
    permeability,
    ramp,
    random_rotation,
)

from actuator.equations.discretisation import Discretisation

DOMAIN = half_cylinder(2, 2, 3)
DEFORMATIONS = {
    "stretch and shear": STRETCH,
    "rotated": random_rotation(1) @ STRETCH,
    "compressed": np.diag([0.7, 0.8, 0.9]),
    "at rest": IDENTITY,
}
deformations = pytest.mark.parametrize("F", DEFORMATIONS.values(), ids=DEFORMATIONS.keys())


@pytest.fixture(scope="module")
def discretisation() -> Discretisation:
    return Discretisation(DOMAIN)


@pytest.fixture(scope="module")
def inside() -> Floats:
    nodes = ~boundary_nodes(DOMAIN)
    assert 50 < nodes.sum() < len(nodes)
    return nodes


def fields(F: Floats, chi: float, pressure: float) -> tuple[Floats, Floats, Floats]:
    vertices = np.ones(DOMAIN.mesh.nvertices)
    return chi * vertices, DOMAIN.nodes @ (F - IDENTITY).T, pressure * vertices


@deformations
@pytest.mark.parametrize("chi", [-6.0, 0.3, 9.0])
def test_uniform_stress_is_in_equilibrium(
    discretisation: Discretisation, inside: Floats, F: Floats, chi: float
) -> None:
    c, pressure = coefficients(), 0.055
    forces, _ = nodal_residuals(discretisation.geometry, no_source(discretisation), c, *fields(F, chi, pressure))
    assert np.abs(forces[~inside]).max() > 1e-3
    assert np.abs(forces[inside]).max() < 1e-12 * np.abs(forces).max()


@deformations
def test_tip_force_is_stress_times_area(discretisation: Discretisation, F: Floats) -> None:
    c, chi, pressure = coefficients(), 0.3, 0.055
    forces, _ = nodal_residuals(discretisation.geometry, no_source(discretisation), c, *fields(F, chi, pressure))
    stress = first_piola(F, ramp(np.array(chi), c), np.array(pressure), c)
    area = discretisation.volume / DOMAIN.length
    assert forces[DOMAIN.tip.nodes].sum(axis=0) == pytest.approx(area * stress[:, 0], rel=1e-12, abs=1e-12)
    assert np.abs(forces.sum(axis=0)).max() < 1e-12 * area


@deformations
@pytest.mark.parametrize("chi", [-12.0, 0.3, 9.0])
def test_constant_pressure_is_at_rest_without_sources(discretisation: Discretisation, F: Floats, chi: float) -> None:
    c, source = coefficients(drainage=0.0), no_source(discretisation)
    _, flow = nodal_residuals(discretisation.geometry, source, c, *fields(F, chi, 0.055))
    scale = 0.055 * permeability(chi, c) * DOMAIN.length
    assert np.abs(flow).max() < 1e-12 * scale


@deformations
def test_linear_pressure_flows_evenly(discretisation: Discretisation, inside: Floats, F: Floats) -> None:
    """A uniform flux k J F⁻¹F⁻ᵀ∇p leaves nothing inside, and carries what it should."""
    c, chi = coefficients(drainage=0.0), -12.0
    chi_field, u, _ = fields(F, chi, 0.0)
    slope = np.array([0.004, -0.002, 0.003])
    _, flow = nodal_residuals(
        discretisation.geometry, no_source(discretisation), c, chi_field, u, DOMAIN.points @ slope
    )
    assert np.abs(flow[inside[: len(flow)]]).max() < 1e-12 * np.abs(flow).max()
    flux = permeability(chi, c) * np.linalg.det(F) * np.linalg.inv(F.T @ F) @ slope
    # Tested with X1 / L, which is 1 at the tip and 0 at the fixed end: volume times flux over length.
    weight = DOMAIN.points[:, 0] / DOMAIN.length
    assert flow @ weight == pytest.approx(flux[0] * discretisation.volume / DOMAIN.length, rel=1e-12)
    assert flow.sum() == pytest.approx(0.0, abs=1e-12 * np.abs(flow).max())
