"""What C_0 may be: each goal's derivatives, alone and through the state of a whole actuator that also twists."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_up_domain import Box
from physics import half_cylinder, halvings, parameters, rates

from actuator.equations.arm import COORDINATES
from actuator.load_case import LoadCase
from actuator.solve.reduced import ReducedObjective
from actuator.terms.goals.bending import PAPER_GOAL
from actuator.terms.goals.force import Force
from actuator.terms.goals.interface import Goal, Sum
from actuator.terms.goals.rotation import Rotation
from actuator.terms.goals.travel import Travel

LOAD = parameters()[1]
MOTION = np.array([0.4, -0.3, -1.7, 0.15, 0.2, -0.1])
LIFTED = MOTION * [1.0, 1.0, -1.0, 1.0, -1.0, 1.0]
GOALS: dict[str, Goal] = {
    "bending": PAPER_GOAL,
    "travel": Travel(None, (0.6, 0.0, -0.8)),
    "travel of a point": Travel(0.1, (0.0, 1.0, 0.0), (5.0, -3.0, 12.0)),
    "extension": Travel(None, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "twist": Rotation(None, "theta1"),
    "angle": Rotation(0.3, "theta3", -1.0),
    "force": Force(None, 2.0),
    "sum": Sum(((2.0, PAPER_GOAL), (0.5, Rotation(0.3, "theta1")))),
}
DOMAIN = Box(length=15.0, width=28.0, height=30.0, along=3, across=2, up=4, growth=1.0, whole=True)
STEPS = halvings(0.04, 3)


@pytest.mark.parametrize("name", GOALS)
@pytest.mark.parametrize("motion", [MOTION, LIFTED])
def test_gradient_and_curvature_of_a_goal(name: str, motion: np.ndarray) -> None:
    goal, h, basis = GOALS[name], 1e-6, np.eye(6)
    slope = [(goal.value(motion + h * e, LOAD) - goal.value(motion - h * e, LOAD)) / (2.0 * h) for e in basis]
    assert goal.gradient(motion, LOAD) == pytest.approx(slope, rel=1e-7, abs=1e-9)
    bent = [(goal.gradient(motion + h * e, LOAD) - goal.gradient(motion - h * e, LOAD)) / (2.0 * h) for e in basis]
    exact = np.array([goal.gradient(motion + 1e-30j * e, LOAD).imag / 1e-30 for e in basis])
    np.testing.assert_allclose(exact, bent, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(exact, exact.T, atol=1e-12)


def test_travel_of_the_arms_end_is_the_springs() -> None:
    """T3 - L_arm sin θ2 where nothing else moves, Eq. (8)."""
    motion = np.array([0.2, 0.0, -2.3, 0.0, 0.2188, 0.0])
    down = Travel(None, (0.0, 0.0, -1.0)).measure(motion, LOAD)
    assert down == pytest.approx((LOAD.arm_length * np.sin(0.2188) + 2.3) / LOAD.arm_length, rel=1e-14)
    force = Force(None, 1.0).measure(motion, LOAD)
    assert force == pytest.approx(LOAD.spring_stiffness * down * LOAD.arm_length, rel=1e-14)


def test_a_target_is_met_where_nothing_is_left_to_gain() -> None:
    goal = Rotation(MOTION[COORDINATES.index("theta1")], "theta1")
    assert goal.value(MOTION, LOAD) == 0.0
    assert not goal.gradient(MOTION, LOAD).any()


@pytest.mark.parametrize("name", ["travel of a point", "twist", "sum"])
def test_reduced_gradient_of_a_goal_of_a_whole_actuator(name: str) -> None:
    material, load, objective = parameters(passive_weight=0.0, area_weight=0.0, slope_weight=0.0, leak_weight=0.0)
    reduced = ReducedObjective(
        DOMAIN,
        material,
        [LoadCase(load, goal=GOALS[name])],
        objective,
        state_tolerance=1e-12,
        adjoint_tolerance=3e-11,
        threads=1,
    )
    X = DOMAIN.points
    chi = DOMAIN.initial_design(X, 3.0) + 1.5 * np.sin(0.2 * X[:, 1] * X[:, 0] / 15.0 + 0.15 * X[:, 2])
    d = np.cos(X @ np.array([0.25, -0.4, 0.3]))
    at = reduced.evaluate(chi)
    moved = dict(zip(COORDINATES, np.abs(at.state.motion), strict=True))
    assert min(moved.values()) > 1e-4, "the actuator moves in all six coordinates"
    slope = float(reduced.gradient(at).total @ d)
    values = [reduced.evaluate(chi + h * d, (at.state.x, at.state.p)).value for h in STEPS]
    left = [abs(value - at.value - h * slope) for value, h in zip(values, STEPS, strict=True)]
    assert min(rates(np.array(left))) > 1.9


def test_force_of_an_end_that_is_held() -> None:
    """With the stiffest spring it is the blocked force, which a spring ten times softer hardly changes."""
    _, load, objective = parameters(passive_weight=0.0, area_weight=0.0, slope_weight=0.0, leak_weight=0.0)
    domain, found = half_cylinder(2, 2, 3), []
    d = np.cos(domain.points @ np.array([0.25, -0.4, 0.3]))
    for ratio in (1e5, 1e6):
        held = replace(load, spring_stiffness=load.spring_stiffness * ratio / 1.6e-2)
        goal = Force(None, held.pressure * 15.0**2)
        reduced = ReducedObjective(
            domain,
            parameters()[0],
            [LoadCase(held, goal=goal)],
            objective,
            state_tolerance=1e-10,  # so stiff a spring's force has no more digits
            adjoint_tolerance=3e-11,
            threads=1,
        )
        at = reduced.evaluate(domain.initial_design(domain.points, 3.0))
        slope = float(reduced.gradient(at).total @ d)
        values = [reduced.evaluate(at.chi + h * d, (at.x, at.p)).value for h in STEPS]
        assert min(rates(np.array(values) - at.value - slope * STEPS)) > 1.9
        found.append(at.terms["C0"])
    assert found[0] < 0.0
    assert found[0] == pytest.approx(found[1], rel=1e-4)
