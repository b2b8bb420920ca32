"""What is wrong with triangles, which bodies and cavities they bound, and which of them overhang."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold
from shapes import block, surface

from actuator.geometry.bodies import shells
from actuator.geometry.flaws import Flaws, flaws
from actuator.geometry.printing.overhangs import Overhangs, overhangs
from actuator.geometry.solid import rounded
from actuator.geometry.zero_set import Surface

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def found(triangles: np.ndarray) -> Flaws:
    return flaws(Surface(np.random.default_rng(0).normal(size=(triangles.max() + 1, 3)), triangles))


def test_a_sound_solid_has_no_flaw() -> None:
    assert flaws(surface(block(1.0, 2.0, 3.0))) == Flaws(0, 0, 0, False, None)


def test_open_turned_and_crowded_edges_are_counted() -> None:
    assert (found(TETRAHEDRON[:3]).open, found(TETRAHEDRON[:2]).open) == (3, 4)
    assert found(np.concatenate([TETRAHEDRON[:3], TETRAHEDRON[3:, ::-1]])).turned == 3
    assert found(np.concatenate([TETRAHEDRON, np.array([0, 1, 4, 5])[TETRAHEDRON]])).crowded == 1
    touching = found(np.concatenate([TETRAHEDRON, np.array([0, 4, 5, 6])[TETRAHEDRON]]))
    assert touching == Flaws(0, 0, 0, True, None)


def test_the_first_flaw_is_where_it_is() -> None:
    cube = surface(block(2.0, 2.0, 2.0))
    first = flaws(Surface(cube.vertices, cube.triangles[1:])).first
    assert first is not None
    ends = cube.vertices[cube.triangles[0]]
    middles = 0.5 * (ends + np.roll(ends, -1, axis=0))
    assert np.abs(middles - first).max(axis=1).min() == pytest.approx(0.0, abs=1e-12)


def test_bodies_and_cavities_are_told_apart_and_placed() -> None:
    solid = block(3.0, 3.0, 3.0) - block(1.0, 1.0, 1.0, 0.5, 0.0, 0.0) + block(2.0, 2.0, 2.0, 10.0, 0.0, 0.0)
    found = shells(rounded(*_arrays(solid)))
    assert [shell.volume for shell in found] == pytest.approx([27.0, 8.0, -1.0])
    assert [shell.centre for shell in found] == [(0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (0.5, 0.0, 0.0)]
    assert found[1].low == (9.0, -1.0, -1.0)


def test_the_arms_of_a_t_overhang() -> None:
    tee = surface(block(4.0, 4.0, 10.0) + block(20.0, 4.0, 2.0, 0.0, 0.0, 6.0))
    upright = overhangs(tee, "z", 19.0)
    assert upright.area == pytest.approx(2.0 * 8.0 * 4.0)
    assert upright.largest == pytest.approx(32.0)
    assert upright.centre is not None
    assert np.abs(upright.centre) == pytest.approx([6.0, 0.0, 5.0])
    assert upright.share == pytest.approx(64.0 / (4 * 4 * 10.0 + 16.0 + 20 * 4 + 64.0 + 2 * 2 * 24.0))
    assert overhangs(tee, "-z", 19.0) == Overhangs(0.0, 0.0, 0.0, None)
    assert overhangs(tee, "x", 19.0).area == pytest.approx(40.0)


@pytest.mark.parametrize("angle", [10.0, 19.0, 45.0])
def test_a_ball_overhangs_up_to_the_angle(angle: float) -> None:
    ball = surface(Manifold.sphere(10.0, 256))
    cap = 2.0 * np.pi * 100.0 * (1.0 - np.cos(np.radians(angle)))
    assert overhangs(ball, "z", angle).area == pytest.approx(cap, rel=0.03)


def _arrays(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    found = surface(solid)
    return found.vertices, found.triangles
