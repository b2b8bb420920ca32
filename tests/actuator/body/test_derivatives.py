"""Forces, tangent, the chamber and the arm against differences; Newton's method converges quadratically."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from bodies import half_tube, inflated, inflation, material, mirrored, octant, whole_tube
from physics import STRETCH

from actuator.arrays import Floats
from actuator.body import chamber
from actuator.body.arm import Arm
from actuator.equations.arm import COORDINATES, OF_HALF

ARM = Arm(length=10.0, reach=60.0, stiffness=0.3, opening=40.0, names=OF_HALF)
WHOLE_ARM = Arm(length=10.0, reach=60.0, stiffness=0.3, opening=40.0, names=COORDINATES)
MESHES = {"half": half_tube(4, 2, 1), "whole": whole_tube(4, 2, 1)}


def slope(function, at: Floats, step: float = 1e-3) -> Floats:
    """Derivatives of an array by fourth-order differences, along a new last axis."""
    columns = []
    for k in range(len(at)):
        d = step * np.eye(len(at))[k]
        near, far = function(at + d) - function(at - d), function(at + 2 * d) - function(at - 2 * d)
        columns.append((8.0 * near - far) / (12.0 * step))
    return np.stack(columns, axis=-1)


def random_state(problem, size: float, seed: int = 0) -> Floats:
    z = size * np.random.default_rng(seed).normal(size=problem.size)
    for k, name in enumerate(reversed(problem.arm.names), start=1):
        z[-k] *= 0.1 if name.startswith("theta") else 1.0
    return z


# ------------------------------------------------------------------------------------------- chamber and arm


def test_the_chamber_grows_by_the_determinant_of_a_uniform_deformation() -> None:
    mesh = mirrored(*octant(np.array([1.0, 2.0]), 4), [(axis, 0.0) for axis in range(3)])
    F = np.diag([1.3, 0.8, 1.7])  # planes of symmetry stay in place
    at_rest = chamber.volume(mesh.nodes, mesh.walls)
    assert at_rest == pytest.approx(np.pi / 6.0, rel=0.1)
    assert chamber.volume(mesh.nodes @ F, mesh.walls) == pytest.approx(np.linalg.det(F) * at_rest, rel=1e-13)


def test_the_chamber_at_rest_is_the_opening_times_the_length() -> None:
    for mesh in MESHES.values():
        arm = Arm(mesh.length, 60.0, 0.3, OF_HALF, mesh.opening)
        volume = chamber.volume(mesh.nodes, mesh.walls) + arm.chamber(np.zeros(3))[0]
        assert volume == pytest.approx(mesh.opening * mesh.length, rel=1e-12)
    assert 2.0 * MESHES["half"].opening == pytest.approx(MESHES["whole"].opening, rel=1e-12)


def test_gradient_and_hessian_of_the_chamber() -> None:
    """The volume is a cubic, of which the differences are exact."""
    rng = np.random.default_rng(1)
    walls = np.array([[0, 1, 2, 3, 4, 5], [2, 1, 6, 4, 7, 8]])
    x = rng.normal(size=27)

    def of_nodes(x: Floats) -> Floats:
        total = np.zeros((9, 3))
        np.add.at(total, walls, chamber.gradient(x.reshape(9, 3), walls))
        return total.ravel()

    hessian = np.zeros((9, 3, 9, 3))
    for nodes, block in zip(walls, chamber.hessian(x.reshape(9, 3), walls), strict=True):
        np.add.at(hessian, np.ix_(nodes, range(3), nodes, range(3)), block)
    gradient = slope(lambda x: chamber.volume(x.reshape(9, 3), walls), x, 0.1)
    np.testing.assert_allclose(of_nodes(x), gradient, atol=1e-12)
    np.testing.assert_allclose(hessian.reshape(27, 27), slope(of_nodes, x, 0.1), atol=1e-12)
    np.testing.assert_allclose(hessian.reshape(27, 27), hessian.reshape(27, 27).T, atol=1e-14)


def test_tractions_are_the_gradient_of_a_closed_surface() -> None:
    """They differ on rims only."""
    mesh = mirrored(*octant(np.array([1.0, 2.0]), 3), [(axis, 0.0) for axis in range(3)])
    x = mesh.nodes @ STRETCH
    sums = []
    for function in (chamber.gradient, chamber.tractions):
        total = np.zeros_like(x)
        np.add.at(total, mesh.walls, function(x, mesh.walls))
        sums.append(total)
    inner = (mesh.nodes > 1e-9).all(axis=1)
    np.testing.assert_allclose(sums[0][inner], sums[1][inner], atol=1e-14)
    assert np.abs(sums[0] - sums[1]).max() > 1e-3


@pytest.mark.parametrize("arm", [ARM, WHOLE_ARM], ids=["half", "whole"])
def test_derivatives_of_the_arm(arm: Arm) -> None:
    rng = np.random.default_rng(2)
    T = rng.normal(size=len(arm.names)) * 0.4
    points = np.column_stack([np.full(5, arm.length), rng.normal(size=(5, 2)) * 5.0])
    force = rng.normal(size=(5, 3))
    near = {"rtol": 1e-8, "atol": 1e-8}
    np.testing.assert_allclose(arm.directions(T, points), slope(lambda T: arm.displacement(T, points), T), **near)
    work = slope(lambda T: np.einsum("ni,nij->j", force, arm.directions(T, points)), T)
    np.testing.assert_allclose(arm.second_variation(T, points, force), work, **near)
    for function in (arm.spring, arm.chamber):
        _, first, second = function(T)
        np.testing.assert_allclose(first, slope(lambda T, of=function: np.array(of(T)[0]), T), **near)
        np.testing.assert_allclose(second, slope(lambda T, of=function: of(T)[1], T), **near)
    R, _, _ = arm.rotations(T)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) == pytest.approx(1.0)


def test_the_elongation_of_the_spring_is_that_of_equation_8() -> None:
    assert ARM.elongation(np.array([0.7, -0.4, 0.3])) == pytest.approx(-0.4 - 60.0 * np.sin(0.3), rel=1e-14)


# --------------------------------------------------------------------------------------- forces and tangent


@pytest.mark.parametrize("kind", MESHES)
def test_forces_are_the_gradient_of_the_energy(kind: str) -> None:
    problem = inflation(MESHES[kind], mixed=False)
    z, d = random_state(problem, 0.02), random_state(problem, 1.0, 1)

    def energy(t: float) -> float:
        state = problem.state(z + t * d, 0.8)
        return state.stored + state.spring - 0.8 * problem.pressure * state.volume

    work = float(problem.residual(z, 0.8) @ d)
    found = slope(lambda t: np.array(energy(float(t[0]))), np.zeros(1), 2e-4)[0]
    assert found == pytest.approx(work, rel=1e-8)


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("kind", MESHES)
def test_the_tangent_is_the_derivative_of_the_residual(kind: str, mixed: bool) -> None:
    """Solving takes a difference of residuals back to the step, but for a remainder of second order."""
    problem = inflation(MESHES[kind], mixed=mixed)
    z, d = random_state(problem, 0.02), random_state(problem, 1.0, 1)
    problem.linearise(z, 0.8, fresh=True)
    remainders = []
    for step in (1e-3, 5e-4, 2.5e-4):
        change = (problem.residual(z + step * d, 0.8) - problem.residual(z - step * d, 0.8)) / (2.0 * step)
        remainders.append(np.linalg.norm(problem.solve(change, 1e-12) - d))
    rates = [np.log2(one / half) for one, half in pairwise(remainders)]
    np.testing.assert_allclose(rates, 2.0, atol=0.05)


@pytest.mark.parametrize("mixed", [False, True])
def test_the_residual_is_linear_in_the_load(mixed: bool) -> None:
    problem = inflation(MESHES["half"], mixed=mixed)
    z = random_state(problem, 0.02)
    problem.linearise(z, 0.5, fresh=True)
    change = problem.residual(z, 1.5) - problem.residual(z, 0.25)
    np.testing.assert_allclose(1.25 * problem.load_derivative, change, atol=1e-12 * np.abs(change).max())


@pytest.mark.parametrize(("poisson_ratio", "mixed"), [(0.48, False), (0.4999, True)])
def test_newtons_method_converges_quadratically(poisson_ratio: float, mixed: bool) -> None:
    problem = inflation(MESHES["half"], material(poisson_ratio), mixed=mixed)
    z, norms = inflated(problem, 0.9).z, []
    for _ in range(6):
        residual = problem.residual(z, 1.0)
        norms.append(problem.norm(residual))
        if norms[-1] < 1e-9:
            break
        problem.linearise(z, 1.0, fresh=True)
        z = z - problem.solve(residual, 1e-12)
    assert norms[-1] < 1e-9
    orders = [np.log(c / b) / np.log(b / a) for a, b, c in zip(norms, norms[1:], norms[2:], strict=False)]
    assert max(orders) > 1.8
    assert len(norms) <= 6
