"""Chambers between glued plates, and where they leak."""

from __future__ import annotations

import pytest
from manifold3d import Manifold
from shapes import block, polygon_area, rod, surface, tube

from actuator.geometry.printing.chamber import Axis, Sealing, leak, sealing
from actuator.geometry.printing.voxels import voxelised

GLUE = 0.05


def glued(solid: Manifold, axis: Axis = "x") -> Sealing:
    return sealing(surface(solid), axis, GLUE)


def test_a_tube_becomes_a_chamber() -> None:
    found = glued(tube())
    assert found.chambers == pytest.approx([polygon_area(5.0) * (30.0 - 2.0 * GLUE)])
    assert found.openings == pytest.approx((polygon_area(5.0), polygon_area(5.0)))
    assert found.both_ends
    assert found.others == ()
    assert leak(voxelised(surface(tube()), 0.5), "x") is None


@pytest.mark.parametrize(("axis", "angles"), [("y", (0.0, 0.0, 90.0)), ("z", (0.0, 90.0, 0.0))])
def test_the_axis_is_a_choice(axis: Axis, angles: tuple[float, float, float]) -> None:
    turned = tube().rotate(list(angles)).translate([100.0, -50.0, 20.0])
    assert glued(turned, axis).chambers == pytest.approx([polygon_area(5.0) * (30.0 - 2.0 * GLUE)])
    assert glued(turned, "x").openings == (0.0, 0.0)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_side_hole_leaks_where_it_is(axis: Axis) -> None:
    hole = block(2.0, 2.0, 20.0, 7.0, 0.0, 10.0)
    angles = {"x": (0.0, 0.0, 0.0), "y": (0.0, 0.0, 90.0), "z": (0.0, -90.0, 0.0)}[axis]
    part = surface((tube() - hole).rotate(list(angles)))
    found = sealing(part, axis, GLUE)
    assert found.chambers == ()
    assert min(found.openings) > 70.0
    where = leak(voxelised(part, 0.25), axis)
    assert where is not None
    assert where.width == pytest.approx(2.0, abs=0.25)
    at = dict(zip("xyz", where.at, strict=True))
    # Where the hole's x, y and z went.
    along, across, out = (at[name] for name in {"x": "xyz", "y": "yxz", "z": "zyx"}[axis])
    assert along == pytest.approx(7.0, abs=1.0)
    assert across == pytest.approx(0.0, abs=0.5)
    assert 4.5 < abs(out) < 10.5


def test_a_blind_hole_to_the_middle_is_a_chamber() -> None:
    found = glued(rod(10.0, 30.0) - rod(5.0, 28.0).translate([-5.0, 0.0, 0.0]))
    assert found.chambers == pytest.approx([polygon_area(5.0) * (24.0 - GLUE)])
    assert found.openings == pytest.approx((polygon_area(5.0), 0.0))
    assert not found.both_ends


def test_a_short_blind_hole_is_none() -> None:
    found = glued(rod(10.0, 30.0) - rod(5.0, 10.0).translate([-15.0, 0.0, 0.0]))
    assert found.chambers == ()
    assert found.others == pytest.approx([polygon_area(5.0) * (5.0 - GLUE)])


def test_a_part_without_openings_has_no_chamber() -> None:
    for solid in (block(10.0, 10.0, 10.0), Manifold.sphere(5.0, 32) - Manifold.sphere(3.0, 32)):
        found = glued(solid)
        assert found.openings == (0.0, 0.0)
        assert found.chambers == ()


def test_a_slit_tube_has_a_bore_but_no_closed_opening() -> None:
    found = glued(tube() - block(40.0, 2.0, 20.0, 0.0, 0.0, 10.0))
    assert (found.openings, found.bore, found.chambers) == ((0.0, 0.0), True, ())
    assert glued(tube()).bore
    assert not glued(block(10.0, 10.0, 10.0)).bore


def test_grooves_of_the_outer_wall_are_no_openings() -> None:
    assert glued(block(10.0, 10.0, 10.0) - block(20.0, 2.0, 2.0, 0.0, 0.0, 5.0)).openings == (0.0, 0.0)
