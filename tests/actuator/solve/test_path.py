"""Continuation against a two-bar truss whose path is known in closed form, and the actuator against direct solves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from physics import Floats, parameters
from small_case import small_domain, start_of

from actuator.solve.equilibrium import Equilibrium
from actuator.solve.path import Control, PathLost, Point, begin, follow, snap
from actuator.solve.pressurisation import Pressurisation

FINE = Control(tolerance=1e-12)


class Truss:
    """Two bars from (±1, 0) to (0, h), loaded downwards at the top: von Mises' truss, stiffness 1, exact strains.

    The top goes down by w; with y = h - w and L² = 1 + y² the load is 2 y (1/L - 1/L0) up to the sign.
    """

    def __init__(self, height: float) -> None:
        self.height, self.rest = height, float(np.hypot(1.0, height))
        # In units of the largest load, which dλ/dw = 0 gives: L³ = L0.
        top = np.sqrt(self.rest ** (2.0 / 3.0) - 1.0)
        self.limits = (height - top, height + top)
        self.unit = 1.0
        self.unit = self.load(self.limits[0])
        self.load_derivative: Floats = np.array([-1.0])
        self.stiffness = 0.0

    def load(self, w: float) -> float:
        y = self.height - w
        return 2.0 * y * (1.0 / np.hypot(1.0, y) - 1.0 / self.rest) / self.unit

    def residual(self, z: Floats, load: float) -> Floats:
        return np.array([self.load(z[0]) - load])

    def norm(self, residual: Floats) -> float:
        return float(np.abs(residual).max()) if np.isfinite(residual).all() else np.inf

    def linearise(self, z: Floats, load: float, *, fresh: bool) -> None:
        y = self.height - z[0]
        self.stiffness = -2.0 * (np.hypot(1.0, y) ** -3 - 1.0 / self.rest) / self.unit

    def solve(self, right: Floats, tolerance: float, guess: Floats | None = None) -> Floats:
        return right / self.stiffness

    def inner(self, a: Floats, b: Floats) -> float:
        return float(a @ b) / self.height**2

    def settled(self, z: Floats, load: float) -> Floats:
        return z

    def negative_eigenvalues(self) -> int | None:
        return int(self.stiffness < 0.0)


def path_of(truss: Truss, last: float, control: Control = FINE, stops: tuple[float, ...] = ()) -> list[Point]:
    start = begin(truss, np.zeros(1), 0.0, control)
    return [start, *follow(truss, start, last, control, stops=stops)]


@settings(max_examples=20, deadline=None)
@given(height=st.floats(0.1, 2.0))
def test_truss_is_followed_through_both_limit_points(height: float) -> None:
    truss = Truss(height)
    points = path_of(truss, 1.2, stops=(0.5,))
    assert [point.load for point in points] == pytest.approx([truss.load(point.z[0]) for point in points], abs=1e-11)
    limits = [point for point in points if point.limit]
    assert [point.z[0] for point in limits] == pytest.approx(truss.limits, rel=1e-3)
    assert [point.load for point in limits] == pytest.approx([1.0, -1.0], abs=1e-7)
    assert sum(point.load == 0.5 for point in points) == 3
    assert points[-1].load == 1.2
    # Unstable in between, and nowhere else.
    unstable = [point.negative for point in points if not point.limit]
    low, high = truss.limits
    assert unstable == [int(low < point.z[0] < high) for point in points if not point.limit]


def test_a_prescribed_load_jumps_to_the_far_branch_and_back_to_the_near_one() -> None:
    truss = Truss(0.5)
    control = replace(FINE, largest=0.05)
    points = path_of(truss, 1.2, control)
    way_down = list(follow(truss, points[-1].reversed(), 0.0, control, stops=()))
    assert way_down[-1].load == 0.0
    assert way_down[-1].z[0] == pytest.approx(1.0, abs=1e-9)  # snapped through it rests upside down
    at = next(k for k, point in enumerate(points) if point.limit)
    k, t = snap([point.load for point in points], at) or (0, 0.0)
    landed = (1.0 - t) * points[k].z[0] + t * points[k + 1].z[0]
    assert truss.load(landed) == pytest.approx(points[at].load, abs=1e-3)
    assert landed > truss.limits[1]
    # Unloaded farther, to the lower limit point, it would jump back.
    lower = [points[-1].reversed(), *follow(truss, points[-1].reversed(), -1.2, control)]
    turns = [k for k, point in enumerate(lower) if point.limit]
    k, t = snap([point.load for point in lower], turns[0]) or (0, 0.0)
    assert (1.0 - t) * lower[k].z[0] + t * lower[k + 1].z[0] < truss.limits[0]


def test_without_coming_back_there_is_no_jump() -> None:
    assert snap([0.0, 0.5, 1.0, 0.5, 0.2], 2) is None
    assert snap([0.0, 1.0, 0.5, 1.5], 1) == (2, 0.5)
    assert snap([0.0, -1.0, -0.5, -1.5], 1) == (2, 0.5)


def test_steps_do_not_change_the_path() -> None:
    truss = Truss(0.7)
    coarse, fine = (path_of(truss, 1.1, replace(FINE, largest=size), (0.4, 0.9)) for size in (0.4, 0.02))
    assert len(fine) > 3 * len(coarse)
    for load in (0.4, 0.9):
        one, two = ([point.z[0] for point in way if point.load == load] for way in (coarse, fine))
        assert one == pytest.approx(two, abs=1e-10)


def test_a_path_that_ends_says_where() -> None:
    class Breaking(Truss):
        def residual(self, z: Floats, load: float) -> Floats:
            return super().residual(z, load) if z[0] < 0.1 else np.array([np.inf])

    truss = Breaking(0.5)
    start = begin(truss, np.zeros(1), 0.0, FINE)
    found: list[Point] = []
    with pytest.raises(PathLost, match=r"could not be followed beyond a load factor of 0\.7.*not admissible"):
        found.extend(follow(truss, start, 1.2, FINE))
    assert found[-1].z[0] == pytest.approx(0.1, abs=1e-3)  # and what came before is kept


def test_paths_that_fall_too_low_or_take_too_long_are_given_up() -> None:
    truss = Truss(0.5)
    falling = follow(truss, begin(truss, np.zeros(1), 0.0, FINE), 1.2, FINE, lowest=-0.2)
    with pytest.raises(PathLost, match=r"fell below a load factor of -0\.2"):
        list(falling)
    with pytest.raises(PathLost, match="more than 3 points"):
        path_of(Truss(0.5), 1.2, replace(FINE, most_points=3))


# ------------------------------------------------------------------------------------------------ the actuator

LOADS = (0.3, 0.7, 1.0)


@pytest.fixture(scope="module")
def actuator() -> Pressurisation:
    domain = small_domain()
    return Pressurisation(Equilibrium(domain, *parameters(), tolerance=1e-10, threads=1), start_of(domain))


@pytest.fixture(scope="module")
def way(actuator: Pressurisation) -> list[Point]:
    control = Control(tolerance=1e-10)
    start = begin(actuator, actuator.rest, 0.0, control)
    return [start, *follow(actuator, start, 1.0, control, stops=LOADS)]


def test_the_path_of_an_actuator_is_what_direct_solves_find(actuator: Pressurisation, way: list[Point]) -> None:
    """Each by Newton's method from rest, with a source of that pressure instead of a load factor."""
    material, load, objective = parameters()
    for factor in LOADS:
        weaker = replace(load, pressure=factor * load.pressure)
        direct = Equilibrium(actuator.equilibrium.domain, material, weaker, objective, tolerance=1e-10, threads=1)
        expected = direct.solve(actuator.chi)
        found = next(point for point in way if point.load == factor)
        state = actuator.state(found.z, factor)
        np.testing.assert_allclose(state.arm, expected.arm, rtol=1e-6)
        assert np.linalg.norm(state.displacement - expected.displacement) < 1e-6 * np.linalg.norm(expected.displacement)
        np.testing.assert_allclose(state.p, expected.p, atol=1e-7 * load.pressure)


def test_the_path_of_an_actuator_does_not_depend_on_steps(actuator: Pressurisation, way: list[Point]) -> None:
    control = Control(first=0.02, largest=0.07, tolerance=1e-10)
    start = begin(actuator, actuator.rest, 0.0, control)
    tiny = [start, *follow(actuator, start, 1.0, control)]
    assert len(tiny) > 1.5 * len(way)
    np.testing.assert_allclose(tiny[-1].z, way[-1].z, atol=1e-7 * np.abs(way[-1].z).max())


def test_tangents_are_the_slope_of_the_path(actuator: Pressurisation, way: list[Point]) -> None:
    at, control = way[2], Control(tolerance=1e-10)
    h = 1e-3
    one, two = (begin(actuator, at.z, at.load + step, control) for step in (-h, h))
    slope = (two.z - one.z)[: actuator.size] / (2.0 * h)
    expected = at.direction[: actuator.size] / at.slope
    assert np.linalg.norm(slope - expected) < 1e-4 * np.linalg.norm(expected)
    assert actuator.inner(at.direction, at.direction) + at.slope**2 == pytest.approx(1.0, rel=1e-9)


def test_inverted_elements_are_no_state(actuator: Pressurisation) -> None:
    z = actuator.rest
    z[: actuator.size - 3] = np.random.default_rng(1).normal(size=actuator.size - 3) * 5.0
    assert actuator.norm(actuator.residual(z, 1.0)) == np.inf
