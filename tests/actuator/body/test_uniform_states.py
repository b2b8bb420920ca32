"""Uniform deformation: forces balance in every node of an irregular mesh, and are those of the stress."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import grid, inflation, layered, material, mirrored, octant, perturbed
from physics import STRETCH, coefficients, first_piola, strain_energy

CONSTANTS = {nu: coefficients(bulk=material(nu).bulk, shear=material(nu).shear) for nu in (0.48, 0.4999)}


def block():
    """A unit cube whose nodes are all free, with inner vertices moved at random."""
    y, z, triangles = grid(np.linspace(0.0, 1.0, 4), np.linspace(0.0, 1.0, 4))
    layers = np.array([np.stack([np.full_like(y, x), y, z], axis=1) for x in np.linspace(0.0, 1.0, 4)])
    return mirrored(perturbed(layered(layers, triangles), 0.08), 0, [])


@pytest.mark.parametrize(("poisson_ratio", "mixed"), [(0.48, False), (0.48, True), (0.4999, True)])
def test_uniform_stress_is_in_equilibrium(poisson_ratio: float, mixed: bool) -> None:
    mesh, stuff, c = block(), material(poisson_ratio), CONSTANTS[poisson_ratio]
    J = 1.0 + 0.03 * (1.0 - 2.0 * poisson_ratio)
    F = STRETCH * np.cbrt(J / np.linalg.det(STRETCH))
    problem = inflation(mesh, stuff, mixed=mixed)
    own = np.unique(mesh.cells[:-1])
    u = np.zeros(mesh.nodes.shape)
    u[own] = mesh.nodes[own] @ (F - np.eye(3)).T
    stress = np.zeros(mesh.vertices)
    stress[own[own < mesh.vertices]] = stuff.bulk * np.log(J)
    z = np.concatenate([u[mesh.free], stress[: problem.stresses], np.zeros(len(problem.arm.names))])
    state, residual = problem.state(z, 0.0), problem.residual(z, 0.0)
    x, forces = mesh.nodes[own], state.nodal[own]
    P = first_piola(F, 1.0, 0.0, c)
    near = {"rtol": 0.0, "atol": 1e-10 * np.abs(P).max()}
    low, high = x < 1e-9, x > 1.0 - 1e-9
    assert (~(low | high)).all(axis=1).sum() > 100
    np.testing.assert_allclose(forces[~(low | high).any(axis=1)], 0.0, **near)
    for axis in range(3):
        # In the plane of a face nodes off its rim carry P N, each its share of the area.
        rest = np.delete(low | high, axis, axis=1).any(axis=1)
        for side, sign in ((low, -1.0), (high, 1.0)):
            face = forces[side[:, axis] & ~rest]
            np.testing.assert_allclose(
                face, np.outer(face @ P[:, axis], P[:, axis]) / (P[:, axis] @ P[:, axis]), **near
            )
            assert sign * float(face.sum(axis=0) @ P[:, axis]) > 0.0
    np.testing.assert_allclose(forces.T @ x, P, **near)
    np.testing.assert_allclose(state.density[:-1], strain_energy(F, 1.0, c), rtol=1e-9)
    if mixed:
        np.testing.assert_allclose(residual[problem.displacements :], 0.0, atol=1e-14)


def test_curved_cells_are_nearly_in_equilibrium() -> None:
    """The rule of four points is not exact for them; what is left falls with more than the square of their size."""
    left = []
    for cells in (2, 4):
        mesh = mirrored(*octant(np.linspace(1.0, 2.0, cells + 1), cells), [], slice(0, 3))
        problem = inflation(mesh, material(0.48), mixed=False)
        own, surface = np.unique(mesh.cells[:-1]), np.unique(mesh.boundary)
        u = np.zeros(mesh.nodes.shape)
        u[own] = mesh.nodes[own] @ (STRETCH - np.eye(3)).T
        forces = problem.state(np.concatenate([u[mesh.free], np.zeros(3)]), 0.0).nodal
        inside = np.setdiff1d(own, surface)
        left.append(np.abs(forces[inside]).max() / np.abs(forces[surface]).max())
    assert left[1] < 1e-3
    assert left[0] / left[1] > 4.0
