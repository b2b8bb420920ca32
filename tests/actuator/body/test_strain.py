"""Strain of known fields, and walls that are pushed into each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import between_plates, grid, half_tube, layered, whole_tube
from physics import STRETCH

from actuator.arrays import Floats
from actuator.body.mesh import BodyMesh, Tetrahedra
from actuator.body.strain import Strains, strains, touching

#: Edge of the cells, and the gap between two blocks, mm.
EDGE, GAP = 0.5, 0.3


def test_a_uniform_deformation_has_its_stretch_everywhere() -> None:
    mesh = half_tube(4, 2, 1)
    density = np.full((len(mesh.cells), 4), 0.02)
    found = strains(mesh, mesh.nodes @ (STRETCH - np.eye(3)).T, density, 2.5)
    np.testing.assert_allclose(found.stretch, np.linalg.svd(STRETCH)[1][0], rtol=1e-12)
    np.testing.assert_allclose(found.strain, np.sqrt(2.0 * 0.02 / 2.5), rtol=1e-12)
    volume = found.weights.sum()
    assert found.weights.min() > 0.0
    np.testing.assert_allclose(np.einsum("eq,eqi->i", found.weights, found.places)[0] / volume, 5.0, rtol=1e-4)


def ramp() -> Strains:
    """A thousand cells of volumes 1, 2, 3, ... mm³ in a row, the strain growing along it."""
    number = np.arange(1000.0)
    strain = np.repeat(1e-3 * number[:, None], 4, axis=1) + 1e-6 * np.arange(4)
    weights = np.repeat(0.25 * (1.0 + number[:, None]), 4, axis=1)
    places = np.zeros((1000, 4, 3))
    places[..., 0] = number[:, None]
    order = np.random.default_rng(0).permutation(1000)
    return Strains(strain[order], strain[order], weights[order], places[order])


def test_percentile_and_share_are_by_volume() -> None:
    found = ramp()
    # 1 + ... + n of 1 + ... + 1000 is a quarter for n of about 500.
    assert found.percentile(found.strain, 0.25) == pytest.approx(0.5, abs=2e-3)
    assert found.percentile(found.strain, 1.0) == found.strain.max()
    assert found.share_above(0.4995) == pytest.approx(0.75, abs=1e-3)
    assert found.share_above(2.0) == 0.0


def test_spots_are_the_largest_and_apart() -> None:
    found = ramp().spots(100.0)
    assert [place[0] for _, place in found] == [999.0, 898.0, 797.0]
    np.testing.assert_allclose([value for value, _ in found], [0.999003, 0.898003, 0.797003], rtol=1e-12)


def blocks() -> BodyMesh:
    """Two cubes of 4 mm side by side along X3, with a gap between them."""
    line = np.arange(0.0, 4.0 + EDGE, EDGE)
    x, y, triangles = grid(line, line)
    lower = layered(np.array([np.stack([x, y, np.full_like(x, z)], axis=1) for z in line]), triangles)
    points = np.concatenate([lower.points, lower.points + np.array([0.0, 0.0, 4.0 + GAP])])
    corners = np.concatenate([lower.corners, lower.corners + len(lower.points)])
    return between_plates(Tetrahedra(points, corners), 0, 4.0, half=False)


def pushed(mesh: BodyMesh, by: float) -> Floats:
    """The upper block lowered."""
    u = np.zeros(mesh.nodes.shape)
    u[mesh.nodes[:, 2] > 4.0 + 0.5 * GAP] = [0.1, 0.17, -by]  # aside, as it would not move in earnest along edges
    return u


def test_walls_that_pass_into_each_other_are_found() -> None:
    mesh = blocks()
    assert touching(mesh, pushed(mesh, 0.0)) is None
    assert touching(mesh, pushed(mesh, GAP - 0.01)) is None
    place = touching(mesh, pushed(mesh, GAP + 0.1))
    assert place is not None
    assert place[2] in (pytest.approx(4.0), pytest.approx(4.0 + GAP))


def test_a_body_that_is_only_moved_and_stretched_does_not_touch_itself() -> None:
    mesh = whole_tube(6, 3, 2)
    assert touching(mesh, np.zeros(mesh.nodes.shape)) is None
    assert touching(mesh, mesh.nodes @ (STRETCH - np.eye(3)).T) is None


def test_a_half_touches_its_image() -> None:
    """Where it has passed through its plane of symmetry."""
    mesh = blocks()
    u = np.zeros(mesh.nodes.shape)
    u[mesh.nodes[:, 2] > 4.0 + 0.5 * GAP, 1] = -0.5
    assert touching(mesh, u) is None
    place = touching(replace(mesh, half=True), u)
    assert place is not None
    assert place[1] == 0.0
    assert place[2] >= 4.0 + GAP
