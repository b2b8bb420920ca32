"""Voxels, the flood that looks for ways out, cups, and pockets behind narrow necks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold
from scipy import ndimage
from shapes import block, cup, rod, surface, tube

from actuator.failure import GridTooLarge
from actuator.geometry.printing.cups import Direction, cups
from actuator.geometry.printing.drains import pockets
from actuator.geometry.printing.flood import flooded
from actuator.geometry.printing.voxels import MOST, Voxels, voxelised


def grid(solid: Manifold, pitch: float = 0.5) -> Voxels:
    return voxelised(surface(solid), pitch)


def test_a_block_fills_its_voxels() -> None:
    found = grid(block(10.0, 5.0, 2.5, 1.0, 2.0, 3.0))
    assert found.solid.shape == (22, 12, 7)
    assert found.solid.sum() == 20 * 10 * 5
    assert found.solid[1:-1, 1:-1, 1:-1].all()
    assert found.position(np.array([10.5, 5.5, 3.0])) == pytest.approx((1.0, 2.0, 3.0))


def test_volumes_by_voxels_are_close() -> None:
    found = grid(Manifold.sphere(10.0, 128))
    assert found.solid.sum() * 0.5**3 == pytest.approx(4000.0 / 3.0 * np.pi, rel=0.01)


def test_a_grid_too_large_names_a_pitch_that_is_not() -> None:
    with pytest.raises(GridTooLarge, match=r"choose a pitch of 0\.36 mm or more"):
        grid(block(100.0, 100.0, 100.0), 0.1)
    assert grid(block(100.0, 100.0, 100.0), 0.36).solid.size <= MOST


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.1, 0.7))
def test_the_flood_finds_the_lowest_way_out(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    level = rng.integers(0, 5, (5, 6, 7)).astype(np.int32)
    level[rng.random(level.shape) < share] = -1
    expected = np.full(level.shape, -1)
    border = np.ones(level.shape, dtype=bool)
    border[1:-1, 1:-1, 1:-1] = False
    for reached in range(5):
        labels, _ = ndimage.label((level >= 0) & (level <= reached))
        out = np.isin(labels, np.unique(labels[border & (labels > 0)])) & (labels > 0)
        expected[out & (expected < 0)] = reached
    height, following = flooded(level)
    np.testing.assert_array_equal(height, expected)
    inside = np.flatnonzero((height.ravel() >= 0) & (following.ravel() >= 0))
    assert np.all(height.flat[following.flat[inside]] <= height.flat[inside])


@pytest.mark.parametrize("direction", ["x", "y", "z", "-x", "-y", "-z"])
def test_only_the_upright_cup_holds_resin(direction: Direction) -> None:
    found = cups(grid(cup()), direction, on_platform=False)
    if direction != "z":
        assert found == []
        return
    (one,) = found
    assert one.volume == pytest.approx(8.0 * 8.0 * 9.0)
    assert one.heights == pytest.approx((1.0, 10.0))
    assert one.centre == pytest.approx((0.0, 0.0, 0.5))


def test_the_platform_closes_a_cup_that_lies_on_it() -> None:
    (one,) = cups(grid(cup()), "-z", on_platform=True)
    assert one.volume == pytest.approx(8.0 * 8.0 * 9.0)
    assert one.heights == pytest.approx((0.0, 9.0))
    assert one.centre == pytest.approx((0.0, 0.0, 0.5))


def test_a_tube_is_a_cup_only_if_it_stands_on_the_platform() -> None:
    voxels = grid(tube())
    assert cups(voxels, "x", on_platform=False) == []
    assert cups(voxels, "z", on_platform=False) == []
    (bore,) = cups(voxels, "x", on_platform=True)
    assert bore.volume == pytest.approx(25.0 * np.pi * 30.0, rel=0.02)


def test_a_hole_empties_a_cup_down_to_its_height() -> None:
    holed = cup() - rod(1.0, 5.0).translate([5.0, 0.0, 0.0])
    (one,) = cups(grid(holed), "z", on_platform=False)
    assert one.heights == pytest.approx((1.0, 4.0))
    assert one.volume == pytest.approx(8.0 * 8.0 * 3.0)


def test_closed_cavities_are_no_cups() -> None:
    hollow = block(10.0, 10.0, 10.0) - block(4.0, 4.0, 4.0)
    assert cups(grid(hollow), "z", on_platform=True) == []
    assert pockets(grid(hollow), 1.0) == []


def test_a_bottle_is_a_pocket_behind_its_neck() -> None:
    bottle = block(10.0, 10.0, 10.0) - block(8.0, 8.0, 8.0) - block(6.0, 2.0, 2.0, 5.0, 0.0, 0.0)
    voxels = grid(bottle, 0.25)
    (one,) = pockets(voxels, 3.5)
    assert one.neck == pytest.approx(2.0, abs=0.25)
    assert one.neck_at == pytest.approx((4.5, 0.0, 0.0), abs=0.75)
    # What balls of 3.5 mm fill of the cube inside: its edges and corners stay empty.
    edge, ball = 8.0 - 3.5, 1.75
    filled = edge**3 + 6.0 * edge**2 * ball + 3.0 * np.pi * edge * ball**2 + 4.0 / 3.0 * np.pi * ball**3
    assert one.volume == pytest.approx(filled, rel=0.03)
    assert one.centre == pytest.approx((0.0, 0.0, 0.0), abs=0.3)
    assert pockets(voxels, 1.5) == []
    assert pockets(grid(tube()), 3.5) == []
