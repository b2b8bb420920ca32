"""The derivative of Λ·R + C_Ψ, from which gradient, adjoint and Hessian products are made."""

from __future__ import annotations

from typing import NamedTuple, get_args

import numpy as np
import pytest
from physics import (
    Floats,
    bases,
    coefficients,
    deformation_gradients,
    half_cylinder,
    halvings,
    nodal_residuals,
    ramp,
    rates,
    strain_energy,
    wavy,
)

from actuator.equations.assembly import scatter_vector
from actuator.equations.discretisation import Discretisation
from actuator.equations.scheme import PressureElements, Scheme
from actuator.terms.lagrangian import lagrangian_gradient
from actuator.terms.strain_energy import strain_energy_excess

DOMAIN = half_cylinder()
#: A strict limit, so that C_Ψ is active, and a regularisation that is not lost beside the stress.
C = coefficients(energy_limit=1e-3, strain_energy_weight=1e-6, hessian_penalty=1.0)


class Fields(NamedTuple):
    """χ (n_vertices,), u (n_nodes, 3), p (n_vertices,): a state, a direction or a derivative."""

    chi: Floats
    u: Floats
    p: Floats

    def plus(self, h: complex, d: Fields) -> Fields:
        return Fields(*(a + h * b for a, b in zip(self, d, strict=True)))

    def dot(self, other: Fields) -> complex:
        return sum(np.sum(a * b) for a, b in zip(self, other, strict=True))


def some_fields(seed: int, chi: Floats | float, size: float, pressure: float) -> Fields:
    rng, n = np.random.default_rng(seed), DOMAIN.mesh.nvertices
    return Fields(chi + rng.normal(size=n), wavy(DOMAIN.nodes, size, seed), pressure * rng.uniform(size=n))


AT = some_fields(1, DOMAIN.initial_design(DOMAIN.points, 3.0), 0.4, 0.05)
ADJOINT = some_fields(2, 0.0, 1.0, 1e-3)
DIRECTIONS = {
    "chi": some_fields(3, 0.0, 0.0, 0.0),
    "u": Fields(0.0 * AT.chi, wavy(DOMAIN.nodes, 0.5, 4), 0.0 * AT.p),
    "p": Fields(0.0 * AT.chi, 0.0 * AT.u, np.random.default_rng(5).normal(size=AT.p.shape) * 0.05),
    "all": some_fields(6, 0.0, 0.3, 0.05),
}
direction = pytest.mark.parametrize("d", DIRECTIONS.values(), ids=DIRECTIONS.keys())
with_energy = pytest.mark.parametrize("weight", [0.0, 1.0], ids=["without C_psi", "with C_psi"])


@pytest.fixture(scope="module", params=get_args(PressureElements))
def discretisation(request: pytest.FixtureRequest) -> Discretisation:
    return Discretisation(DOMAIN, Scheme(pressure=request.param))


@pytest.fixture(scope="module")
def source(discretisation: Discretisation) -> Floats:
    return discretisation.source(C.drainage)


def excess(at: Fields) -> complex:
    """C_Ψ of Eq. (14) by scikit-fem and NumPy; real or complex."""
    linear, quadratic = bases(DOMAIN)

    def at_points(field: Floats) -> Floats:
        return np.asarray(linear.interpolate(field.real)) + 1j * np.asarray(linear.interpolate(field.imag))

    F = deformation_gradients(quadratic, at.u)
    over = strain_energy(F, ramp(at_points(at.chi) + C.energy_shift, C), C) / C.energy_limit - 1.0
    return np.sum(quadratic.dx * C.strain_energy_weight / 6.0 * np.where(over.real > 0.0, over, 0.0) ** 6)


def lagrangian(discretisation: Discretisation, source: Floats, at: Fields, weight: float, adjoint: Fields) -> complex:
    forces, flow = nodal_residuals(discretisation.geometry, source, C, *at)
    return np.sum(adjoint.u * forces) + np.sum(adjoint.p * flow) + weight * excess(at)


def gradient(
    discretisation: Discretisation, source: Floats, at: Fields, weight: float, adjoint: Fields = ADJOINT
) -> Fields:
    g, kind = discretisation.geometry, at.chi.dtype
    parts = [np.empty((len(g.cells), *shape), kind) for shape in ((8,), (20, 3), (8,))]
    stressed = bool(np.any(adjoint.u))
    lagrangian_gradient(g, source, C, *at, adjoint.u.astype(kind), adjoint.p.astype(kind), weight, stressed, *parts)
    n = DOMAIN.mesh.nvertices
    return Fields(
        scatter_vector(parts[0], g.cells, n),
        scatter_vector(parts[1], g.node_cells, len(DOMAIN.nodes)),
        scatter_vector(parts[2], g.cells, n),
    )


def test_strain_energy_term_matches_scikit_fem(discretisation: Discretisation) -> None:
    value, _ = strain_energy_excess(discretisation.geometry, C, AT.chi, AT.u)
    assert value > 0.0
    assert value == pytest.approx(excess(AT).real, rel=1e-11)


@direction
@with_energy
def test_derivative_of_the_lagrangian(discretisation: Discretisation, source: Floats, d: Fields, weight: float) -> None:
    step = 1e-40
    for adjoint in (ADJOINT, ADJOINT._replace(u=0.0 * ADJOINT.u)):  # the second leaves out the work of Λ_u
        exact = lagrangian(discretisation, source, AT.plus(1j * step, d), weight, adjoint).imag / step
        ours = gradient(discretisation, source, AT, weight, adjoint).dot(d)
        assert ours == pytest.approx(exact, rel=1e-11, abs=1e-14)


@direction
@with_energy
def test_complex_step_gives_second_derivatives(
    discretisation: Discretisation, source: Floats, d: Fields, weight: float
) -> None:
    at = gradient(discretisation, source, AT, weight)
    moved = gradient(discretisation, source, AT.plus(1e-40j, d), weight)
    steps = halvings(0.02)
    for part in range(3):
        errors = [
            np.linalg.norm(
                gradient(discretisation, source, AT.plus(h, d), weight)[part] - at[part] - h * moved[part].imag / 1e-40
            )
            for h in steps
        ]
        # Where the derivative is linear along d there is nothing left over.
        if errors[0] > 1e-10 * np.linalg.norm(at[part]):
            assert rates(errors).min() > 1.9
        assert errors[-1] < 1e-3 * np.linalg.norm(at[part])
