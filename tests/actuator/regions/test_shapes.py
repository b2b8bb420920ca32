"""Signed distances of the shapes of regions, against samples of their surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import KDTree
from shapes import rod, surface

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.geometry.transfer import facets_of
from actuator.regions.shapes import Body, Box, Cylinder, Shape, Skin, Sphere

RNG = np.random.default_rng(3)
POINTS = RNG.uniform(-6.0, 6.0, (400, 3))
START, END = np.array([-1.0, 0.5, -2.0]), np.array([2.0, 1.0, 1.5])


def box_surface(low: Floats, high: Floats) -> Floats:
    points = RNG.uniform(low, high, (60_000, 3))
    axis, end = RNG.integers(0, 3, len(points)), RNG.integers(0, 2, len(points))
    points[np.arange(len(points)), axis] = np.where(end == 0, low[axis], high[axis])
    return points


def cylinder_surface(start: Floats, end: Floats, radius: float) -> Floats:
    axis = (end - start) / np.linalg.norm(end - start)
    across = np.linalg.svd(axis[None])[2][1:]
    angle, along = RNG.uniform(0.0, 2.0 * np.pi, 60_000), RNG.uniform(0.0, 1.0, 60_000)
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) @ across
    side = start + along[:, None] * (end - start) + radius * ring
    flat = np.where(RNG.integers(0, 2, len(ring))[:, None] == 0, start, end) + (
        radius * np.sqrt(RNG.uniform(0.0, 1.0, len(ring)))[:, None] * ring
    )
    return np.concatenate([side, flat])


def sphere_surface(centre: Floats, radius: float) -> Floats:
    rays = RNG.standard_normal((60_000, 3))
    return centre + radius * rays / np.linalg.norm(rays, axis=1, keepdims=True)


def in_cylinder(points: Floats) -> Floats:
    axis = (END - START) / np.linalg.norm(END - START)
    along = (points - START) @ axis
    across = np.linalg.norm(points - START - along[:, None] * axis, axis=1)
    return (along > 0.0) & (along < np.linalg.norm(END - START)) & (across < 2.0)


@pytest.mark.parametrize(
    ("shape", "samples", "inside"),
    [
        (
            Box(np.array([-2.0, -3.0, 0.0]), np.array([1.0, 3.0, 4.0])),
            box_surface(np.array([-2.0, -3.0, 0.0]), np.array([1.0, 3.0, 4.0])),
            ((POINTS > [-2.0, -3.0, 0.0]) & (POINTS < [1.0, 3.0, 4.0])).all(axis=1),
        ),
        (Cylinder(START, END, 2.0), cylinder_surface(START, END, 2.0), in_cylinder(POINTS)),
        (Sphere(START, 3.0), sphere_surface(START, 3.0), np.linalg.norm(POINTS - START, axis=1) < 3.0),
    ],
    ids=["box", "cylinder", "sphere"],
)
def test_depth_is_the_distance_to_the_surface(shape: Shape, samples: Floats, inside: Floats) -> None:
    depth = shape.depth(POINTS)
    np.testing.assert_array_equal(depth > 0.0, inside)
    nearest = KDTree(samples).query(POINTS)[0]
    assert (np.abs(depth) <= nearest + 1e-12).all()
    assert np.abs(np.abs(depth) - nearest).max() < 0.05  # between the samples


def test_depth_in_a_closed_surface() -> None:
    found = Body(surface(rod(4.0, 6.0))).depth(POINTS)
    lower, upper = (
        Cylinder(np.array([-3.0, 0.0, 0.0]), np.array([3.0, 0.0, 0.0]), r).depth(POINTS) for r in (3.98, 4.0)
    )
    assert (found >= lower - 0.01).all()
    assert (found <= upper + 0.01).all()


def test_depth_in_a_skin_on_both_of_its_sides() -> None:
    domain = HalfCylinder(15.0, 15.0, 6, 2, 6)
    skin = Skin(facets_of(domain, domain.tip), 2.0)
    assert skin.depth(np.array([[15.0, 3.0, 3.0], [13.5, 3.0, 3.0], [12.0, 3.0, 3.0], [16.0, 3.0, 3.0]])) == (
        pytest.approx([2.0, 0.5, -1.0, 1.0])
    )
