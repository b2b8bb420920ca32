"""Several chambers with pressures of their own: states, the leak between them, and its derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from physics import Floats, half_cylinder, halvings, parameters, rates

from actuator.domains.chambers import Chambered, Channel
from actuator.load_case import LoadCase
from actuator.parameters import Load
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.reduced import ReducedObjective

UPPER, LOWER = Channel("upper", (0.0, 6.5), 2.5), Channel("lower", (0.0, -6.5), 2.5)
MATERIAL, LOAD, LIMITS = parameters(strain_limit=0.055)
DOMAIN = Chambered(half_cylinder(4, 2, 3), [UPPER, LOWER])


def load_of(upper: float, lower: float) -> Load:
    """Shares of the paper's pressure in the two chambers."""
    both = upper * LOAD.pressure, lower * LOAD.pressure
    return replace(LOAD, pressure=max(both), chambers=both)


def first_design() -> Floats:
    return DOMAIN.initial_design(DOMAIN.points, LIMITS.interface_width)


def with_a_hole(chi: Floats) -> Floats:
    """The design with a channel between the chambers, 2 mm wide and 5 mm long, of void as deep as theirs."""
    x1, x2, x3 = DOMAIN.points.T
    opened = np.where((np.abs(x1 - 7.5) <= 5.0) & (x2 <= 2.6) & (np.abs(x3) < 6.5), -8.0, np.inf)
    return np.minimum(chi, opened)


def objective_of(*cases: LoadCase) -> ReducedObjective:
    return ReducedObjective(DOMAIN, MATERIAL, cases, LIMITS, state_tolerance=1e-12, adjoint_tolerance=3e-11, threads=1)


def in_channel(channel: Channel) -> Floats:
    return channel.radii(DOMAIN.points) < 0.6 * channel.radius


def test_initial_design_has_walls_around_every_chamber() -> None:
    chi = first_design()
    for channel in DOMAIN.channels:
        assert (chi[in_channel(channel)] < 0.0).all()
    on_wall, between = DOMAIN.outside.vertices, np.abs(DOMAIN.points[:, 2]) < 1e-9
    assert (chi[on_wall] < 0.0).all()  # the skin of Eq. (22)
    inner = between & (np.hypot(*DOMAIN.points[:, 1:].T) < 10.0)
    assert inner.any()
    assert (chi[inner] > 0.0).all()
    assert (chi <= DOMAIN.passive_bound(DOMAIN.points, LIMITS.interface_width) + 1e-9).mean() > 0.9


def test_depth_is_the_distance_from_the_round_wall() -> None:
    r = np.hypot(*DOMAIN.points[:, 1:].T)
    np.testing.assert_allclose(DOMAIN.depth(DOMAIN.points), 15.0 - r, atol=1e-3)


def test_every_chamber_has_its_pressure() -> None:
    for shares in ((1.0, 0.0), (0.0, 1.0), (1.0, 0.4)):
        load = load_of(*shares)
        state = Equilibrium(DOMAIN, MATERIAL, load, LIMITS, threads=1).solve(first_design())
        for channel, own in zip(DOMAIN.channels, load.chambers, strict=True):
            assert state.p[in_channel(channel)] == pytest.approx(own, abs=0.01 * load.pressure)


def test_equal_pressures_are_one_pressure() -> None:
    chi = first_design()
    together = Equilibrium(DOMAIN, MATERIAL, LOAD, LIMITS, threads=1).solve(chi)
    apart = Equilibrium(DOMAIN, MATERIAL, load_of(1.0, 1.0), LIMITS, threads=1).solve(chi)
    np.testing.assert_allclose(apart.x, together.x, rtol=0.0, atol=1e-12 * np.abs(together.x).max())


def test_pressure_above_bends_down_and_below_up() -> None:
    """The lower chamber is the upper one upside down."""
    angles = [
        Equilibrium(DOMAIN, MATERIAL, load_of(*shares), LIMITS, threads=1).solve(first_design()).arm[2]
        for shares in ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0))
    ]
    assert angles[0] > 1e-3
    assert angles[0] == pytest.approx(-angles[1], rel=1e-6)
    assert abs(angles[2]) < 1e-6 * abs(angles[0])


def test_a_hole_between_chambers_is_a_leak_and_a_wall_is_none() -> None:
    objective = objective_of(LoadCase(load_of(1.0, 0.0)))
    tight = objective.evaluate(first_design())
    assert tight.measures["chamber_leak"] < 1e-3
    holed = objective.evaluate(with_a_hole(first_design()))
    assert holed.measures["chamber_leak"] > 0.05
    assert holed.terms["C_p"] > 1e4 * tight.terms["C_p"]
    # Between chambers of the same pressure nothing flows.
    even = LoadCase(load_of(1.0, 1.0), 1.0, "even")
    alone = objective_of(even).evaluate(with_a_hole(first_design()))
    assert "chamber_leak" not in alone.measures
    assert alone.terms["C_p"] < 10.0 * tight.terms["C_p"]
    both = objective_of(even, LoadCase(load_of(1.0, 0.0), 1.0, "one")).evaluate(with_a_hole(first_design()))
    assert both.measures["chamber_leak"] == pytest.approx(holed.measures["chamber_leak"], rel=1e-6)


@pytest.mark.parametrize("shares", [(1.0, 0.0), (0.5, 1.0)])
def test_taylor_rates_with_a_hole(shares: tuple[float, float]) -> None:
    objective = objective_of(LoadCase(load_of(*shares), 0.7, "one"), LoadCase(load_of(*shares[::-1]), 0.4, "other"))
    d = np.cos(DOMAIN.points @ np.array([0.25, -0.4, 0.3]))
    at = objective.evaluate(0.5 * with_a_hole(first_design()))
    assert at.terms["C_p"] > 1.0
    slope, steps = objective.gradient(at).total @ d, halvings(0.01, 3)
    values = np.array([objective.evaluate(at.chi + h * d, (at.x, at.p)).value for h in steps])
    assert rates(values - at.value - slope * steps).min() > 1.9
