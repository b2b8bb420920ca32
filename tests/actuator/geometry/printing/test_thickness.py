"""Walls and gaps of solids with known ones, and edges that are no walls."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold
from shapes import CORNERS, block, rod, surface, tube

from actuator.geometry.printing.rays import first_hits, spread
from actuator.geometry.printing.thickness import Thickness, neighbouring, thickness


def measured(solid: Manifold, kind: str, limit: float = 0.4, count: int = 4000) -> Thickness:
    part = surface(solid)
    assert kind in ("wall", "gap")
    return thickness(part, spread(part, count), "wall" if kind == "wall" else "gap", limit)


def outline(*corners: tuple[float, float]) -> CrossSection:
    return CrossSection([corners])


def test_a_cube_is_as_thick_as_its_edge_is_long() -> None:
    found = measured(block(10.0, 10.0, 10.0), "wall")
    assert found.minimum == pytest.approx(10.0, rel=1e-6)
    assert found.percentile == pytest.approx(10.0, rel=1e-6)
    assert found.share == 0.0
    assert measured(block(10.0, 10.0, 10.0), "gap") == Thickness(None, None, 0.0, None)


def test_a_thin_plate_is_thin_on_both_faces() -> None:
    found = measured(block(10.0, 10.0, 0.3), "wall")
    assert found.minimum == pytest.approx(0.3, rel=1e-6)
    assert found.at is not None
    assert found.at[2] == pytest.approx(0.0, abs=1e-6)
    assert found.share == pytest.approx(200.0 / 212.0, abs=0.02)


def test_a_tube_has_a_wall_and_a_bore() -> None:
    wall, gap = measured(tube(), "wall"), measured(tube(), "gap")
    apothem = np.cos(np.pi / CORNERS)
    assert wall.minimum == pytest.approx(5.0 * apothem, rel=1e-4)
    assert gap.minimum == pytest.approx(10.0 * apothem, rel=1e-4)


def test_a_slot_is_a_gap() -> None:
    found = measured(block(10.0, 10.0, 10.0) - block(0.2, 20.0, 10.0, 0.0, 0.0, 5.0), "gap", 0.5)
    assert found.minimum == pytest.approx(0.2, rel=1e-5)
    assert found.at is not None
    assert found.at[0] == pytest.approx(0.0, abs=1e-5)
    assert found.at[2] > 0.0
    assert found.share == pytest.approx(100.0 / (600.0 + 100.0), abs=0.02)


def test_a_thin_pin_is_thin() -> None:
    found = measured(block(10.0, 10.0, 10.0) + rod(0.15, 20.0).translate([10.0, 0.0, 0.0]), "wall", count=20_000)
    assert found.minimum == pytest.approx(0.3 * np.cos(np.pi / CORNERS), rel=1e-3)


def test_edges_of_60_degrees_are_neither_walls_nor_gaps() -> None:
    prism = Manifold.cylinder(20.0, 10.0, 10.0, 3, True)
    assert measured(prism, "wall").minimum == pytest.approx(20.0, rel=1e-6)
    assert measured(block(40.0, 40.0, 18.0) - prism, "gap").minimum is None


def test_an_edge_of_15_degrees_is_thin() -> None:
    wedge = Manifold.extrude(outline((0.0, 0.0), (10.0, 0.0), (10.0, 10.0 * np.tan(np.radians(15.0)))), 5.0)
    found = measured(wedge, "wall")
    assert found.minimum is not None
    assert found.minimum < 0.1
    assert found.share > 0.05


def test_what_a_notch_leaves_of_a_wall_is_found() -> None:
    """The flat side meets the notch at 45 degrees, so that no two sides are parallel there."""
    plate = block(20.0, 10.0, 2.0)
    notch = Manifold.extrude(outline((0.0, -0.7), (3.0, 2.3), (-3.0, 2.3)), 20.0)
    found = measured(plate - notch.rotate([90.0, 0.0, 0.0]).translate([0.0, 10.0, 0.0]), "wall", count=20_000)
    assert found.minimum == pytest.approx(0.3, abs=0.02)
    assert found.at is not None
    assert found.at[0] == pytest.approx(0.0, abs=0.1)


def test_a_ray_meets_the_first_facet_or_none() -> None:
    part = surface(block(2.0, 2.0, 2.0) + block(2.0, 2.0, 2.0, 5.0, 0.0, 0.0))
    origin = np.array([[1.0, 0.1, 0.2], [-1.0, 0.1, 0.2]])
    distance, facet = first_hits(part, origin, np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]))
    assert distance[0] == pytest.approx(3.0, rel=1e-6)
    assert np.all(part.vertices[part.triangles[facet[0]], 0] == 4.0)
    assert np.isinf(distance[1])
    assert facet[1] == -1


def test_points_are_spread_by_area() -> None:
    part = surface(block(10.0, 1.0, 1.0))
    points = spread(part, 10_000)
    ends = np.abs(points.normal[:, 0]) > 0.5
    assert ends.mean() == pytest.approx(2.0 / 42.0, abs=0.01)
    np.testing.assert_array_equal(points.position, spread(part, 10_000).position)


def test_neighbours_share_the_edge() -> None:
    triangles = surface(tube()).triangles
    for edge, across in enumerate(neighbouring(triangles).T):
        ends = np.stack([triangles[:, edge], triangles[:, (edge + 1) % 3]], axis=1)
        assert np.all((triangles[across][:, :, None] == ends[:, None, :]).any(axis=1))
