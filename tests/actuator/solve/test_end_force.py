"""A dead force at the arm's end: its derivatives, and states and gradients with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from physics import Floats, half_cylinder, halvings, parameters, rates

from actuator.equations.kinematics import Kinematics
from actuator.load_case import LoadCase
from actuator.parameters import Load
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.loading import loaded
from actuator.solve.reduced import ReducedObjective

DOMAIN = half_cylinder(2, 2, 3)
MATERIAL, LOAD, LIMITS = parameters(strain_limit=0.055)
#: What bends the initial design by some degrees.
FORCE = (0.02, 0.0, -0.03)


def state_of(load: Load, chi: Floats | None = None) -> tuple[Equilibrium, Floats]:
    equilibrium = Equilibrium(DOMAIN, MATERIAL, load, LIMITS, tolerance=1e-9, threads=1)
    return equilibrium, equilibrium.solve(first_design() if chi is None else chi).arm


def first_design() -> Floats:
    r = np.hypot(DOMAIN.points[:, 1], DOMAIN.points[:, 2])
    return DOMAIN.initial_design(DOMAIN.points, LIMITS.interface_width) - 1.2 * (r / 15.0) ** 2


def test_force_is_what_its_work_has_for_a_derivative() -> None:
    load = replace(LOAD, force=FORCE, spring_stiffness=0.0)
    kinematics = Kinematics(DOMAIN, load)
    x = np.zeros(kinematics.size, complex)
    x[kinematics.of_arm] = 0.4, -0.7, 0.3

    def work(x: Floats) -> Floats:
        """F · u of the point of the arm at its end."""
        along = x[kinematics.of_arm][0] + load.arm_length * (np.cos(x[-1]) - 1.0)
        return FORCE[0] * along + FORCE[2] * kinematics.elongation(x)

    for i in range(3):
        ahead = x.copy()
        ahead[len(x) - 3 + i] += 1e-30j
        assert kinematics.spring_force(x)[i].real == pytest.approx(-work(ahead).imag / 1e-30, rel=1e-12)
        column = kinematics.spring_force(ahead).imag / 1e-30
        np.testing.assert_allclose(kinematics.spring_tangent(x)[:, i].real, column, atol=1e-15)


def test_a_force_as_large_as_the_springs_leaves_the_arm_where_it_is() -> None:
    """The spring pulls at the end along X3 with k times its elongation, which a dead force can do as well."""
    equilibrium, with_spring = state_of(LOAD)
    x = np.concatenate([np.zeros(equilibrium.kinematics.size - 3), with_spring])
    pull = -LOAD.spring_stiffness * float(equilibrium.kinematics.elongation(x))
    _, with_force = state_of(replace(LOAD, spring_stiffness=0.0, force=(0.0, 0.0, pull)))
    np.testing.assert_allclose(with_force, with_spring, rtol=1e-6)


def test_a_force_without_pressure_bends_the_actuator() -> None:
    _, small = state_of(replace(LOAD, pressure=0.0, force=(0.0, 0.0, -1e-4)))
    _, twice = state_of(replace(LOAD, pressure=0.0, force=(0.0, 0.0, -2e-4)))
    assert small[2] > 0.0  # down
    assert small[1] < 0.0
    np.testing.assert_allclose(twice, 2.0 * small, rtol=1e-2)
    equilibrium, _ = state_of(replace(LOAD, pressure=0.0))
    assert equilibrium.work.newton == 0  # without any load it rests


def test_pressure_is_raised_under_the_force() -> None:
    equilibrium, directly = state_of(replace(LOAD, force=FORCE))
    reached: list[float] = []
    state = loaded(equilibrium, first_design(), reached.append)
    np.testing.assert_allclose(state.arm, directly, rtol=1e-6)
    assert reached[-1] == 1.0


@pytest.mark.parametrize("pressure", [0.0, LOAD.pressure])
def test_taylor_rates_with_a_force(pressure: float) -> None:
    cases = LoadCase(replace(LOAD, pressure=pressure, force=FORCE), 0.7, "pulled"), LoadCase(LOAD, 0.4, "free")
    objective = ReducedObjective(
        DOMAIN, MATERIAL, cases, LIMITS, state_tolerance=1e-12, adjoint_tolerance=3e-11, threads=1
    )
    d = np.cos(DOMAIN.points @ np.array([0.25, -0.4, 0.3]))
    at = objective.evaluate(first_design())
    slope, steps = objective.gradient(at).total @ d, halvings(0.04, 3)
    values = np.array([objective.evaluate(at.chi + h * d, (at.x, at.p)).value for h in steps])
    assert rates(values - at.value - slope * steps).min() > 1.9
