"""Manufactured solutions: displacements of the 20-node element and pressure on the trilinear one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from physics import (
    IDENTITY,
    Floats,
    assembled,
    bases,
    boundary_nodes,
    coefficients,
    density,
    displacement_dofs,
    element_tangents,
    first_piola,
    half_cylinder,
    no_source,
    nodal_residuals,
    permeability,
    ramp,
)
from skfem import Basis, Element, ElementHex1, ElementHexS2

from actuator.discretisation import Discretisation
from actuator.domain import HalfCylinder
from actuator.linear import make_solver

MESHES = [half_cylinder(n, n, 2 * n) for n in (1, 2, 4)]
C = coefficients(hessian_penalty=0.0)

# --------------------------------------------------------------------------- exact fields, real or complex X

WAVES = np.array([[0.11, 0.07, -0.05], [-0.06, 0.12, 0.08], [0.05, -0.09, 0.10]])
PHASES = np.array([0.3, -0.8, 1.1])
AMPLITUDES = np.array([0.9, 0.7, -0.8])


def displacement(X: Floats) -> Floats:
    return AMPLITUDES * np.sin(X @ WAVES.T + PHASES)


def deformation(X: Floats) -> Floats:
    return IDENTITY + (AMPLITUDES * np.cos(X @ WAVES.T + PHASES))[..., None] * WAVES


def pressure(X: Floats) -> Floats:
    return 0.05 * (1.0 + 0.5 * np.sin(X @ [0.12, -0.08, 0.10] + 0.4))


def pressure_gradient(X: Floats) -> Floats:
    wave = np.array([0.12, -0.08, 0.10])
    return 0.025 * np.cos(X @ wave + 0.4)[..., None] * wave


def linear_field(X: Floats, middle: float) -> Floats:
    """χ, and p of the mechanical problem: fields that the trilinear element holds exactly."""
    return middle + X @ np.array([0.06, -0.05, 0.04]) * abs(middle)


def divergence(flux: Callable[[Floats], Floats], X: Floats) -> Floats:
    """Σ_j ∂flux_..j/∂X_j by complex step."""
    return sum(flux(X + 1e-40j * IDENTITY[j])[..., j].imag / 1e-40 for j in range(3))


# ------------------------------------------------------------------------------------------------ solvers


def solve_symmetric(matrix: sp.csr_array, rhs: Floats, free: Floats) -> Floats:
    """Solve for the unknowns marked free; the others stay zero."""
    upper = sp.csr_array(sp.triu(matrix[free][:, free], format="csr"))
    upper.sort_indices()
    x = np.zeros(len(rhs))
    with make_solver(upper.indptr, upper.indices, symmetric=True, threads=1) as solver:
        solver.factorise(upper.data)
        x[free] = solver.solve(rhs[free])
    return x


def solve_mechanics(domain: HalfCylinder) -> Floats:
    """u_h (n_nodes, 3) for a body force -Div P(u) and the exact u on the boundary, by Newton's method."""
    discretisation = Discretisation(domain)
    chi, p = linear_field(domain.points, 1.0), linear_field(domain.points, 0.05)

    def stress(X: Floats) -> Floats:
        return first_piola(deformation(X), ramp(linear_field(X, 1.0), C), linear_field(X, 0.05), C)

    _, basis = bases(domain)
    X = np.asarray(basis.global_coordinates()).transpose(1, 2, 0)
    body = -divergence(stress, X) * basis.dx[..., None]
    load = np.zeros((basis.N, 3))
    for a, shape in enumerate(basis.basis):
        np.add.at(load, basis.element_dofs[a], np.einsum("cq,cqi->ci", np.asarray(shape[0]), body))

    inside = boundary_nodes(domain)[:, None] == np.zeros(3, dtype=bool)
    u = np.where(inside, 0.98, 1.0) * displacement(domain.nodes)
    g, source, dofs = discretisation.geometry, no_source(discretisation), displacement_dofs(discretisation.geometry)
    for _ in range(8):
        forces, _ = nodal_residuals(g, source, C, chi, u, p)
        unbalanced = np.where(inside, forces - load, 0.0)
        if np.abs(unbalanced).max() < 1e-12 * np.abs(forces).max():
            return u
        matrix = assembled(element_tangents(g, source, C, chi, u, p)[0], dofs, dofs, (u.size, u.size))
        u = u - solve_symmetric(matrix, unbalanced.ravel(), inside.ravel()).reshape(-1, 3)
    raise AssertionError("Newton's method did not converge")


def solve_darcy(domain: HalfCylinder) -> Floats:
    """p_h (n_vertices,) for the exact p on the boundary, on a deformed mesh with source and drainage."""
    discretisation = Discretisation(domain)
    source = np.full_like(discretisation.geometry.volume, 40.0)
    chi, u = linear_field(domain.points, -8.0), displacement(domain.nodes)

    def flow(X: Floats) -> Floats:
        F = deformation(X)
        spread = np.linalg.inv(F) @ np.swapaxes(np.linalg.inv(F), -1, -2) * np.linalg.det(F)[..., None, None]
        return permeability(linear_field(X, -8.0), C)[..., None] * np.einsum("...ij,...j", spread, pressure_gradient(X))

    basis, _ = bases(domain)
    X = np.asarray(basis.global_coordinates()).transpose(1, 2, 0)
    sinks = 40.0 * (pressure(X) - C.pressure) + C.drainage * density(linear_field(X, -8.0)) * pressure(X)
    body = (sinks - divergence(flow, X)) * basis.dx
    load = np.zeros(basis.N)
    for a, shape in enumerate(basis.basis):
        np.add.at(load, basis.element_dofs[a], np.sum(np.asarray(shape[0]) * body, axis=1))

    inside = ~boundary_nodes(domain)[: basis.N]
    p = np.where(inside, 0.0, pressure(domain.points))
    g = discretisation.geometry
    _, residual = nodal_residuals(g, source, C, chi, u, p)
    matrix = assembled(element_tangents(g, source, C, chi, u, p)[3], g.cells, g.cells, (basis.N, basis.N))
    return p - solve_symmetric(matrix, np.where(inside, residual - load, 0.0), inside)


# ------------------------------------------------------------------------------------------------- errors


def errors(basis: Basis, field: Floats, exact: Callable[[Floats], Floats], slope: Callable[[Floats], Floats]) -> Floats:
    """Relative errors (L2, H1 seminorm) of a nodal field (n, components) on a basis with plenty of points."""
    X = np.asarray(basis.global_coordinates()).transpose(1, 2, 0)
    parts = [basis.interpolate(column) for column in field.T]
    value = np.stack([np.asarray(part) for part in parts], axis=-1)
    gradient = np.stack([part.grad for part in parts]).transpose(2, 3, 0, 1)

    def norm(values: Floats) -> float:
        return float(np.sqrt(np.sum(basis.dx * np.sum(values.reshape(*basis.dx.shape, -1) ** 2, axis=-1))))

    return np.array([norm(value - exact(X)) / norm(exact(X)), norm(gradient - slope(X)) / norm(slope(X))])


def study(
    element: Element,
    fields: Callable[[HalfCylinder], Floats],
    exact: Callable[[Floats], Floats],
    slope: Callable[[Floats], Floats],
) -> Floats:
    """Errors of a field on each mesh, (n_meshes, 2)."""
    found = [errors(Basis(domain.mesh, element, intorder=5), fields(domain), exact, slope) for domain in MESHES]
    return np.array(found)


def orders(found: Floats) -> Floats:
    """Observed orders in L2 and H1 between the two finest meshes."""
    return np.log2(found[-2] / found[-1])


def test_displacements_converge_with_order_three_in_l2_and_two_in_h1() -> None:
    exact = displacement, lambda X: deformation(X) - IDENTITY
    found = study(ElementHexS2(), solve_mechanics, *exact)
    l2, h1 = orders(found)
    assert l2 > 2.8
    assert h1 > 1.9
    # Galerkin's solution is near the best there is; the bulk modulus, 25 times the shear modulus, costs a little.
    interpolant = study(ElementHexS2(), lambda domain: displacement(domain.nodes), *exact)
    assert np.all(found[-1] < 2.0 * interpolant[-1])
    assert np.all(found[-1] < [2e-4, 4e-3])


def test_pressure_converges_with_order_two_in_l2_and_one_in_h1() -> None:
    exact = lambda X: pressure(X)[..., None], lambda X: pressure_gradient(X)[..., None, :]
    found = study(ElementHex1(), lambda domain: solve_darcy(domain)[:, None], *exact)
    l2, h1 = orders(found)
    assert l2 > 1.9
    assert h1 > 0.95
    interpolant = study(ElementHex1(), lambda domain: pressure(domain.points)[:, None], *exact)
    assert np.all(found[-1] < 2.0 * interpolant[-1])
    assert np.all(found[-1] < [4e-3, 8e-2])
