"""Designs from elsewhere: linear fields exactly, walls and solids by their distances."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold
from shapes import rod, surface

from actuator.domains.half_cylinder import HalfCylinder
from actuator.geometry.transfer import around_chamber, interpolated, of_solid
from actuator.geometry.zero_set import Surface

DOMAIN = HalfCylinder(15.0, 15.0, 6, 2, 5)
RADII = np.hypot(*DOMAIN.points[:, 1:].T)
#: By how much a chord of the mesh, or of a rod's 64 corners, runs inside of its circle, mm.
CHORD = 0.04


def tube(inner: float, outer: float, length: float) -> Surface:
    return surface(rod(outer, length) - rod(inner, 2.0 * length))


def test_another_mesh_takes_over_linear_fields() -> None:
    fine, slope = HalfCylinder(15.0, 15.0, 8, 3, 7), np.array([0.3, 2.0, -1.0])
    taken = interpolated(DOMAIN, DOMAIN.points @ slope, fine)
    inside = np.hypot(*fine.points[:, 1:].T) < 14.9
    np.testing.assert_allclose(taken[inside], (fine.points @ slope)[inside], atol=1e-12)
    np.testing.assert_allclose(taken, fine.points @ slope, atol=0.15)


def test_the_same_mesh_keeps_its_values() -> None:
    chi = np.sin(DOMAIN.points @ [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(interpolated(DOMAIN, chi, HalfCylinder(15.0, 15.0, 6, 2, 5)), chi)


def test_another_size_is_laid_over_by_its_proportions() -> None:
    large = HalfCylinder(30.0, 60.0, 6, 2, 5)
    taken = interpolated(DOMAIN, DOMAIN.points @ [1.0, 2.0, 3.0], large)
    np.testing.assert_allclose(taken, large.points @ [0.25, 1.0, 1.5], atol=1e-9)


def test_a_wall_follows_the_outside_and_no_other_face() -> None:
    np.testing.assert_allclose(around_chamber(DOMAIN, 3.0), RADII - 12.0, atol=CHORD)


@pytest.mark.parametrize("axis", ["x", "z"])
@pytest.mark.parametrize("scale", [None, 1.5])
def test_a_tube_is_solid_from_plate_to_plate(axis: str, scale: float | None) -> None:
    part = tube(1.5 * 8.0, 1.5 * 14.0, 1.5 * 15.0)
    vertices = part.vertices + np.array([7.0, 0.0, 0.0])  # its end is where it is
    inside = of_solid(Surface(np.roll(vertices, "xyz".index(axis), axis=1), part.triangles), DOMAIN, axis, scale)
    np.testing.assert_allclose(inside, np.minimum(14.0 - RADII, RADII - 8.0), atol=CHORD)


def test_a_part_off_its_axis_is_centred() -> None:
    part = tube(8.0, 14.0, 15.0)
    inside = of_solid(Surface(part.vertices + np.array([0.0, 100.0, -50.0]), part.triangles), DOMAIN, "x", None)
    np.testing.assert_allclose(inside, np.minimum(14.0 - RADII, RADII - 8.0), atol=CHORD)


def test_a_lid_is_solid_too() -> None:
    cup = surface(rod(14.0, 15.0) - rod(8.0, 15.0).translate([-5.0, 0.0, 0.0]))  # closed for the last 5 mm
    inside = of_solid(cup, DOMAIN, "x", None)
    axis = RADII < 1e-9
    np.testing.assert_allclose(inside[axis], np.maximum(DOMAIN.points[axis, 0] - 10.0, -8.0), atol=0.1)


def test_a_hollow_ball_has_void_inside() -> None:
    ball = surface(Manifold.sphere(7.5, 96) - Manifold.sphere(4.0, 96))
    inside = of_solid(ball, DOMAIN, "x", 1.0)
    away = np.linalg.norm(DOMAIN.points - [7.5, 0.0, 0.0], axis=1)
    middle = np.abs(DOMAIN.points[:, 0] - 7.5) < 4.0
    np.testing.assert_allclose(inside[middle], np.minimum(7.5 - away, away - 4.0)[middle], atol=0.1)
