"""Manufactured solutions: exact errors of displacements and pressure over meshes, with their orders and seconds.

    python -m benchmarks.manufactured     # half a minute; with --levels 4, to 6,144 cells, many minutes

A displacement and a pressure are prescribed, the body force and the source they need follow from Eqs. (5) and (6) by
complex step, and the equations are solved on ever finer meshes: u for given χ and p, p for given χ and u. Stress and
flow are NumPy's, the fields scikit-fem's (``tests/helpers/physics.py``); only the solution comes from the program's
element loops. ``tests/actuator/equations/test_convergence.py`` asserts the orders. Writes a table to
``benchmarks/results``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from time import process_time

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import Basis, ElementHex1, ElementHexS2

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.equations.discretisation import Discretisation
from actuator.equations.scheme import DEFAULT, Scheme
from actuator.linear import make_solver
from benchmarks.tables import Row, markdown, start_log, write_csv, write_markdown
from tests.helpers.physics import (
    IDENTITY,
    assembled,
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

logger = start_log("benchmarks.manufactured")

C = coefficients(hessian_penalty=0.0)

# --------------------------------------------------------------------------- exact fields, real or complex X

WAVES = np.array([[0.11, 0.07, -0.05], [-0.06, 0.12, 0.08], [0.05, -0.09, 0.10]])
PHASES = np.array([0.3, -0.8, 1.1])
AMPLITUDES = np.array([0.9, 0.7, -0.8])


def displacement(X: Floats) -> Floats:
    """u at points (..., 3), mm."""
    return AMPLITUDES * np.sin(X @ WAVES.T + PHASES)


def displacement_gradient(X: Floats) -> Floats:
    """∇u at points, (..., 3, 3)."""
    return (AMPLITUDES * np.cos(X @ WAVES.T + PHASES))[..., None] * WAVES


def pressure(X: Floats) -> Floats:
    """p at points (..., 3), N/mm²."""
    return 0.05 * (1.0 + 0.5 * np.sin(X @ [0.12, -0.08, 0.10] + 0.4))


def pressure_gradient(X: Floats) -> Floats:
    """∇p at points, (..., 3), N/mm³."""
    wave = np.array([0.12, -0.08, 0.10])
    return 0.025 * np.cos(X @ wave + 0.4)[..., None] * wave


def linear_field(X: Floats, middle: float) -> Floats:
    """χ, and p of the mechanical problem: fields that the trilinear element holds exactly."""
    return middle + X @ np.array([0.06, -0.05, 0.04]) * abs(middle)


def divergence(flux: Callable[[Floats], Floats], X: Floats) -> Floats:
    """Σ_j ∂flux_..j/∂X_j by complex step."""
    return sum((flux(X + 1e-40j * IDENTITY[j])[..., j].imag / 1e-40 for j in range(3)), start=np.zeros(()))


# ------------------------------------------------------------------------------------------------ solvers


def solve_symmetric(matrix: sp.csr_array, rhs: Floats, free: NDArray[np.bool_]) -> Floats:
    """Solve for the unknowns marked free; the others stay zero."""
    upper = sp.csr_array(sp.triu(matrix[free][:, free], format="csr"))
    upper.sort_indices()
    x = np.zeros(len(rhs))
    with make_solver(upper.indptr, upper.indices, symmetric=True, threads=1) as solver:
        solver.factorise(upper.data)
        x[free] = solver.solve(rhs[free])
    return x


def _basis(domain: Domain, scheme: Scheme, discretisation: Discretisation) -> tuple[Basis, Floats]:
    """Basis of the displacements with the rule of the model, and its points (n_cells, n_q, 3)."""
    element = ElementHexS2() if scheme.element == "hex20" else ElementHex1()
    basis = Basis(domain.mesh, element, quadrature=discretisation.rule)
    return basis, np.asarray(basis.global_coordinates()).transpose(1, 2, 0)


def solve_mechanics(domain: Domain, scheme: Scheme = DEFAULT) -> Floats:
    """u_h for a body force -Div P(u) and the exact u on the boundary, by Newton's method.

    Returns:
        u at the nodes of the element, (n, 3), mm: all nodes, or the vertices for the 8-node element.
    """
    discretisation = Discretisation(domain, scheme)
    chi, p = linear_field(domain.points, 1.0), linear_field(domain.points, 0.05)

    def stress(X: Floats) -> Floats:
        F = IDENTITY + displacement_gradient(X)
        return first_piola(F, ramp(linear_field(X, 1.0), C), linear_field(X, 0.05), C)

    basis, X = _basis(domain, scheme, discretisation)
    body = -divergence(stress, X) * basis.dx[..., None]
    load = np.zeros((len(domain.nodes), 3))
    for a, shape in enumerate(basis.basis):
        np.add.at(load, basis.element_dofs[a], np.einsum("cq,cqi->ci", np.asarray(shape[0]), body))

    inside = boundary_nodes(domain)[:, None] == np.zeros(3, dtype=bool)
    inside[basis.N :] = False
    u = np.where(inside, 0.98, 1.0) * displacement(domain.nodes)
    g, source, dofs = discretisation.geometry, no_source(discretisation), displacement_dofs(discretisation.geometry)
    for _ in range(8):
        forces, _ = nodal_residuals(g, source, C, chi, u, p)
        unbalanced = np.where(inside, forces - load, 0.0)
        if np.abs(unbalanced).max() < 1e-12 * np.abs(forces).max():
            return u[: basis.N]
        matrix = assembled(element_tangents(g, source, C, chi, u, p)[0], dofs, dofs, (u.size, u.size))
        u = u - solve_symmetric(matrix, unbalanced.ravel(), inside.ravel()).reshape(-1, 3)
    raise AssertionError("Newton's method did not converge")


def solve_darcy(domain: Domain, scheme: Scheme = DEFAULT) -> Floats:
    """p_h (n_vertices, 1) for the exact p on the boundary, on a deformed mesh with source and drainage."""
    discretisation = Discretisation(domain, scheme)
    source = np.full_like(discretisation.geometry.volume, 40.0)
    chi, u = linear_field(domain.points, -8.0), displacement(domain.nodes)

    def flow(X: Floats) -> Floats:
        F = IDENTITY + displacement_gradient(X)
        spread = np.linalg.inv(F) @ np.swapaxes(np.linalg.inv(F), -1, -2) * np.linalg.det(F)[..., None, None]
        return permeability(linear_field(X, -8.0), C)[..., None] * np.einsum("...ij,...j", spread, pressure_gradient(X))

    basis, X = _basis(domain, Scheme("hex8"), discretisation)
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
    return (p - solve_symmetric(matrix, np.where(inside, residual - load, 0.0), inside))[:, None]


# ------------------------------------------------------------------------------------------------- errors


def errors(
    domain: Domain, field: Floats, exact: Callable[[Floats], Floats], slope: Callable[[Floats], Floats]
) -> Floats:
    """Relative errors (L2, H1 seminorm) of a field at the vertices or at all nodes, (n, components), (2,)."""
    element = ElementHex1() if len(field) == domain.mesh.nvertices else ElementHexS2()
    basis = Basis(domain.mesh, element, intorder=5)
    X = np.asarray(basis.global_coordinates()).transpose(1, 2, 0)
    parts = [basis.interpolate(column) for column in field.T]
    value = np.stack([np.asarray(part) for part in parts], axis=-1)
    gradient = np.stack([part.grad for part in parts]).transpose(2, 3, 0, 1)

    def norm(values: Floats) -> float:
        return float(np.sqrt(np.sum(basis.dx * np.sum(values.reshape(*basis.dx.shape, -1) ** 2, axis=-1))))

    return np.array([norm(value - exact(X)) / norm(exact(X)), norm(gradient - slope(X)) / norm(slope(X))])


def displacement_errors(domain: Domain, u: Floats) -> Floats:
    """Relative errors (L2, H1) of u at the vertices or at all nodes, (2,)."""
    return errors(domain, u, displacement, displacement_gradient)


def pressure_errors(domain: Domain, p: Floats) -> Floats:
    """Relative errors (L2, H1) of p (n_vertices, 1), (2,)."""
    return errors(domain, p, lambda X: pressure(X)[..., None], lambda X: pressure_gradient(X)[..., None, :])


def meshes(levels: int) -> list[Domain]:
    """Each with half the size of the one before; the first has 12 cells."""
    return [half_cylinder(2**k, 2**k, 2 ** (k + 1)) for k in range(levels)]


def orders(found: Floats) -> Floats:
    """Observed orders in L2 and H1 between the two finest meshes of errors (n_meshes, 2)."""
    return np.log2(found[-2] / found[-1])


def main() -> None:
    """Solve on all meshes and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--levels", type=int, default=3, help="meshes, each with eight times the cells")
    options = parser.parse_args()
    rows: list[Row] = []
    schemes = [Scheme(element, points) for element in ("hex20", "hex8") for points in (8, 14, 27)]
    for scheme in schemes:
        before: Floats | None = None
        for domain in meshes(options.levels):
            began = process_time()
            u = solve_mechanics(domain, scheme)
            seconds = process_time() - began
            p = solve_darcy(domain, scheme)
            found = np.concatenate([displacement_errors(domain, u), pressure_errors(domain, p)])
            row: dict[str, object] = {
                "u": scheme.element,
                "points": scheme.quadrature,
                "cells": domain.mesh.nelements,
                "unknowns": u.size,
                "seconds for u": seconds,
            }
            for k, name in enumerate(("u L2", "u H1", "p L2", "p H1")):
                row[name] = float(found[k])
                row[f"order {name}"] = None if before is None else round(float(np.log2(before[k] / found[k])), 2)
            before = found
            rows.append(row)
            logger.info(" ".join(f"{key}={value}" for key, value in row.items()))
    write_csv("manufactured", rows)
    write_markdown(
        "manufactured",
        "Manufactured solutions: relative errors and orders",
        [
            "Orders are those between a mesh and the one before, whose cells are twice as large. Seconds are those of "
            "the processor, one thread, SciPy's assembly included; p is trilinear throughout, and u in it is the "
            "exact one at the nodes of u's element.",
            markdown(rows),
        ],
    )


if __name__ == "__main__":
    main()
