"""The Helmholtz filter against eigenfunctions, conservation and a direct solver."""

from __future__ import annotations

import numpy as np
import pytest
from skfem import Basis, BilinearForm, ElementHex1, asm
from skfem.helpers import dot, grad
from skfem.models.poisson import mass
from skfem.utils import solve

from actuator.domains.half_cylinder import HalfCylinder
from actuator.equations.helmholtz import helmholtz_filter

RADIUS, LENGTH = 15.0, 12.0
DOMAIN = HalfCylinder(RADIUS, LENGTH, 3, 1, 6)


@BilinearForm
def filtered_form(u, v, w):
    return u * v + w.r**2 * dot(grad(u), grad(v))


@pytest.mark.parametrize("radius", [0.01, 0.1, 1.0, 30.0, 1000.0])
def test_satisfies_equation_15(radius: float) -> None:
    chi = np.random.default_rng(0).normal(size=DOMAIN.mesh.nvertices)
    basis = Basis(DOMAIN.mesh, ElementHex1(), intorder=3)
    expected = solve(asm(filtered_form, basis, r=radius), asm(mass, basis) @ chi)
    np.testing.assert_allclose(helmholtz_filter(DOMAIN.mesh, chi, radius), expected, atol=1e-9)


def test_radius_is_in_millimetres() -> None:
    """cos(π X1 / L) has no flux through the boundary and is damped by 1 / (1 + (π r / L)²)."""
    radius, errors = 2.0, []
    for factor in (1, 2, 4):
        domain = DOMAIN.refined(factor)
        wave = np.cos(np.pi * domain.points[:, 0] / LENGTH)
        expected = wave / (1.0 + (np.pi * radius / LENGTH) ** 2)
        errors.append(np.abs(helmholtz_filter(domain.mesh, wave, radius) - expected).max())
    assert np.all(np.log2(np.array(errors[:-1]) / errors[1:]) > 1.9)
    assert errors[-1] < 1e-3


def test_keeps_constants_and_the_integral() -> None:
    ones = np.ones(DOMAIN.mesh.nvertices)
    np.testing.assert_allclose(helmholtz_filter(DOMAIN.mesh, 3.5 * ones, 1.0), 3.5, rtol=1e-11)
    chi = np.random.default_rng(1).normal(size=len(ones))
    weights = asm(mass, Basis(DOMAIN.mesh, ElementHex1())) @ ones
    np.testing.assert_allclose(weights @ helmholtz_filter(DOMAIN.mesh, chi, 1.0), weights @ chi, rtol=1e-9)


def test_zero_field_stays_zero() -> None:
    assert not helmholtz_filter(DOMAIN.mesh, np.zeros(DOMAIN.mesh.nvertices), 0.1).any()


def test_radius_zero_returns_the_field_itself() -> None:
    chi = np.ones(DOMAIN.mesh.nvertices)
    assert helmholtz_filter(DOMAIN.mesh, chi, 0.0) is chi
