"""The rigid arm, the supports and the spring."""

from __future__ import annotations

import numpy as np
import pytest
from made_up_domain import Box
from physics import IDENTITY, LENGTH, Floats, half_cylinder, halvings, parameters, rates, remainders

from actuator.equations.kinematics import Kinematics

DOMAIN = half_cylinder()
WHOLE = Box(length=LENGTH, width=20.0, height=30.0, along=2, across=1, up=2, growth=1.0, whole=True)
_, LOAD, _ = parameters()


@pytest.fixture(scope="module")
def kinematics() -> Kinematics:
    return Kinematics(DOMAIN, LOAD)


@pytest.fixture
def x(kinematics: Kinematics) -> Floats:
    """Random displacements, and an arm that is turned by more than half a right angle."""
    return np.concatenate([np.random.default_rng(1).normal(size=kinematics.size - 3), [0.7, -2.1, 0.9]])


def direction(kinematics: Kinematics, seed: int = 2) -> Floats:
    return np.random.default_rng(seed).normal(size=kinematics.size)


def test_supports_and_arm_hold_exactly_the_paper_degrees_of_freedom(kinematics: Kinematics) -> None:
    nodes = DOMAIN.nodes
    bound = (nodes[:, 0] == 0.0) | (nodes[:, 0] == LENGTH)
    free = 3 * np.sum(~bound) - np.sum(~bound & (nodes[:, 1] == 0.0))
    assert kinematics.size == free + 3
    assert np.sum(kinematics.index >= 0) == free
    assert np.array_equal(np.sort(kinematics.index[kinematics.index >= 0]), np.arange(free))


def test_displacement_obeys_supports_and_symmetry(kinematics: Kinematics, x: Floats) -> None:
    u, nodes = kinematics.displacement(x), DOMAIN.nodes
    assert np.all(u[nodes[:, 0] == 0.0] == 0.0)
    assert np.all(u[nodes[:, 1] == 0.0, 1] == 0.0)


def test_tip_follows_the_rotation_matrix_of_the_arm(kinematics: Kinematics, x: Floats) -> None:
    """Eq. (7): u = T + (rotation about X2 - 1) X, relative to the arm's origin (L, 0, 0)."""
    t1, t3, angle = x[-3:]
    sine, cosine = np.sin(angle), np.cos(angle)
    rotation = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    arm = DOMAIN.nodes[DOMAIN.tip.nodes] - [LENGTH, 0.0, 0.0]
    expected = np.array([t1, 0.0, t3]) + arm @ (rotation - IDENTITY).T
    assert kinematics.displacement(x)[DOMAIN.tip.nodes] == pytest.approx(expected, abs=1e-13)


def test_reduced_undoes_displacement(kinematics: Kinematics, x: Floats) -> None:
    assert np.array_equal(kinematics.reduced(kinematics.displacement(x), x[-3:]), x)


@pytest.fixture(params=["half", "whole"])
def posed(request: pytest.FixtureRequest, kinematics: Kinematics, x: Floats) -> tuple[Kinematics, Floats, Floats]:
    """The arm of a half, or of a whole with all six coordinates, somewhere, and the nodes."""
    if request.param == "half":
        return kinematics, x, DOMAIN.nodes
    whole = Kinematics(WHOLE, LOAD)
    turned = np.concatenate([np.random.default_rng(1).normal(size=whole.size - 6), [0.7, 0.2, -2.1, 0.5, 0.9, -0.3]])
    return whole, turned, WHOLE.nodes


def test_variation_is_the_derivative_of_displacement(posed: tuple[Kinematics, Floats, Floats]) -> None:
    kinematics, x, _ = posed
    dx = direction(kinematics)
    derivative = kinematics.displacement(x + 1e-40j * dx).imag / 1e-40
    assert kinematics.variation(x, dx) == pytest.approx(derivative, abs=1e-12)


def test_force_is_the_exact_transpose_of_variation(posed: tuple[Kinematics, Floats, Floats]) -> None:
    kinematics, x, nodes = posed
    dx, nodal = direction(kinematics), np.random.default_rng(3).normal(size=nodes.shape)
    work = np.sum(nodal * kinematics.variation(x, dx))
    assert kinematics.force(x, nodal) @ dx == pytest.approx(work, rel=1e-12)


def test_second_variation_is_the_derivative_of_force(posed: tuple[Kinematics, Floats, Floats]) -> None:
    kinematics, x, nodes = posed
    nodal = np.random.default_rng(3).normal(size=nodes.shape)
    second, arm = kinematics.second_variation(x, nodal), kinematics.of_arm
    for k, number in enumerate(range(kinematics.size)[arm]):
        turn = np.zeros(kinematics.size)
        turn[number] = 1.0
        derivative = kinematics.force(x + 1e-40j * turn, nodal).imag / 1e-40
        assert second[k] == pytest.approx(derivative[arm], rel=1e-12, abs=1e-11)
        assert np.all(derivative[: arm.start] == 0.0)


def test_a_whole_arm_moves_rigidly(posed: tuple[Kinematics, Floats, Floats]) -> None:
    kinematics, x, nodes = posed
    tip = kinematics.tip
    moved = (nodes + kinematics.displacement(x))[tip]
    np.testing.assert_allclose(
        np.linalg.norm(moved - moved[0], axis=1), np.linalg.norm(nodes[tip] - nodes[tip][0], axis=1), atol=1e-12
    )


# ------------------------------------------------------------------------------------------------ spring


def spring_energy(x: Floats) -> float:
    return 0.5 * LOAD.spring_stiffness * (x[-2] - LOAD.arm_length * np.sin(x[-1])) ** 2


def test_elongation_is_the_height_of_the_end_of_the_arm(kinematics: Kinematics, x: Floats) -> None:
    assert kinematics.elongation(x) == pytest.approx(-2.1 - 60.0 * np.sin(0.9), rel=1e-15)


def test_spring_force_and_tangent_are_derivatives_of_its_energy(kinematics: Kinematics, x: Floats) -> None:
    force, tangent = kinematics.spring_force(x), kinematics.spring_tangent(x)
    for k in range(3):
        turned = x.astype(complex)
        turned[k - 3] += 1e-40j
        assert spring_energy(turned).imag / 1e-40 == pytest.approx(force[k], rel=1e-13, abs=1e-13)
        assert kinematics.spring_force(turned).imag / 1e-40 == pytest.approx(tangent[k], rel=1e-13, abs=1e-13)
    assert np.array_equal(tangent, tangent.T)


def test_spring_energy_has_a_third_order_remainder(kinematics: Kinematics, x: Floats) -> None:
    dx = np.zeros(kinematics.size)
    dx[-3:] = 0.3, -0.4, 0.2
    force, tangent = kinematics.spring_force(x), kinematics.spring_tangent(x)

    def model(h: float) -> float:
        return spring_energy(x) + h * force @ dx[-3:] + 0.5 * h * h * dx[-3:] @ tangent @ dx[-3:]

    assert rates(remainders(lambda h: spring_energy(x + h * dx), model, halvings(0.2))).min() > 2.9
