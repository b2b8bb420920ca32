"""Distance of the extracted surface to the zero set of the trilinear field: exact cases, order, and brute force."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import Poro

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import HEX_OFFSETS
from actuator.geometry.distance import distance
from actuator.geometry.hausdorff import Distance, distance_to_zero_set
from actuator.geometry.trilinear import projected
from actuator.geometry.zero_set import Surface, solid_boundary

RADIUS, LENGTH = 15.0, 12.0
TINY = HalfCylinder(RADIUS, LENGTH, 2, 1, 2)
NO_FACES = np.zeros((0, 3), dtype=np.int64)


def measured(domain: HalfCylinder, chi: Floats, threshold: float = 0.0) -> Distance:
    return distance_to_zero_set(domain, domain.tetrahedra(), chi, threshold)


def sphere(x: Floats) -> Floats:
    return 5.0 - np.linalg.norm(x - (6.3, 0.0, 1.0), axis=1)


def torus(x: Floats) -> Floats:
    return 3.0 - np.hypot(np.hypot(x[:, 1], x[:, 2]) - 9.0, x[:, 0] - 6.3)


def tube(x: Floats) -> Floats:
    r = np.hypot(x[:, 1], x[:, 2])
    return (r - 6.0) * (11.0 - r)


def test_tetrahedra_lie_in_their_cells() -> None:
    domain = HalfCylinder(RADIUS, LENGTH, 3, 2, 4)
    tets, owner = domain.tetrahedra()
    cells = domain.cells[owner]
    assert (tets[:, :, None] == cells[:, None]).any(axis=2).all()


@pytest.mark.parametrize("normal", [(1.0, 0.0, 0.0), (0.3, 0.0, 1.0), (-1.0, 0.7, 0.2)])
def test_linear_fields_are_the_same_in_both(normal: tuple[float, float, float]) -> None:
    """Isoparametric cells, affine or not, and tetrahedra reproduce linear fields."""
    domain = HalfCylinder(RADIUS, LENGTH, 3, 2, 4)
    found = measured(domain, domain.points @ normal - 2.34)
    assert found.maximum < 1e-10


@pytest.mark.parametrize("field", [sphere, torus, tube])
def test_distance_falls_with_the_square_of_the_cell_size(field: Callable[[Floats], Floats]) -> None:
    found = []
    for factor in (3, 6, 12):
        domain = HalfCylinder(RADIUS, LENGTH, 2 * factor, factor, 3 * factor)
        distances = measured(domain, field(domain.points))
        found.append([distances.maximum, distances.rms])
    rates = np.log2(np.array(found[0]) / found[-1]) / 2.0
    assert np.all(rates > 1.7)
    assert found[-1][0] < 0.02


def brute_force(domain: HalfCylinder, chi: Floats, pieces: int) -> Distance:
    """Both surfaces as very many triangles: cells of the field are cut into pieces³, triangles into 64."""
    fine, weights = domain.refined(pieces), domain.prolongation(pieces)
    zero_set = solid_boundary(weights @ domain.points, fine.tetrahedra().corners, NO_FACES, weights @ chi)
    coarse = solid_boundary(domain.points, domain.tetrahedra().corners, NO_FACES, chi)
    vertices, triangles = coarse.vertices, coarse.triangles
    for _ in range(3):
        vertices, triangles = trimesh.remesh.subdivide(vertices, triangles)
    measures = []
    for one, other in ((zero_set, coarse), (Surface(vertices, triangles), zero_set)):
        mesh = trimesh.Trimesh(one.vertices, one.triangles, process=False)
        vertex, centroid = distance(one.vertices, other), distance(mesh.triangles_center, other)
        mean = mesh.area_faces @ centroid**2 / mesh.area
        measures += [max(vertex.max(), centroid.max()), np.sqrt(mean)]
    return Distance(*(float(measure) for measure in measures))


@pytest.mark.parametrize("kind", ["noise", "waves", "sphere", "torus"])
def test_samples_find_what_brute_force_finds(kind: str) -> None:
    domain = HalfCylinder(RADIUS, LENGTH, 4, 2, 4)
    x = domain.points
    chi = {
        "noise": np.random.default_rng(4).normal(size=len(x)),
        "waves": np.cos(x @ (0.31, 0.23, 0.17)) + 0.3 * np.sin(0.4 * x[:, 2]),
        "sphere": sphere(x),
        "torus": torus(x),
    }[kind]
    found, expected = measured(domain, chi), brute_force(domain, chi, 6)
    for name in ("maximum_to_surface", "maximum_to_zero_set"):
        assert 0.93 * getattr(expected, name) < getattr(found, name) < 1.03 * getattr(expected, name), name
    for name in ("rms_to_surface", "rms_to_zero_set"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=0.1), name


def test_projection_finds_the_nearest_of_two_planes() -> None:
    """(x - a) (y - b) vanishes on two planes."""
    a, b = 0.3, 0.6
    cube = HEX_OFFSETS.astype(float)
    corner = np.column_stack([cube, (cube[:, 0] - a) * (cube[:, 1] - b)])
    targets = np.random.default_rng(1).uniform(0.02, 0.98, (300, 3))
    corners = np.broadcast_to(corner, (300, 8, 4))
    found, _ = projected(corners, targets, targets, 3, 1.0)
    np.testing.assert_allclose(found, np.abs(targets[:, :2] - (a, b)).min(axis=1), atol=1e-12)


def test_size_and_level_of_the_field_do_not_matter() -> None:
    chi = sphere(TINY.points)
    reference = measured(TINY, chi)
    for factor in (1e-250, 1e250):
        assert measured(TINY, factor * chi).maximum == pytest.approx(reference.maximum, rel=1e-9)
    assert measured(TINY, chi + 8.0, 8.0).rms == pytest.approx(reference.rms, rel=1e-9)


def test_without_a_surface_inside_there_is_no_distance() -> None:
    for level in (-1.0, 0.0, 1.0):
        assert measured(TINY, np.full(len(TINY.points), level)).maximum == 0.0


@pytest.mark.parametrize("seed", range(5))
def test_any_field_gives_distances_within_a_cell(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=len(TINY.points))
    edges = TINY.points[TINY.cells]
    diameter = np.linalg.norm(edges.max(axis=1) - edges.min(axis=1), axis=1).max()
    for chi in (noise, np.round(noise), np.where(noise > 1.0, 1e-300, -1.0), np.where(noise > 1.0, 1e300, -1e-300)):
        found = measured(TINY, chi)
        assert 0.0 <= found.rms <= found.maximum < diameter


def test_summary_reports_it(folder: Path, poro: Poro) -> None:
    ended = poro("mirror", "tiny.yaml", "--output", ".", "--json", "--force")
    summary = json.loads(ended.out)["mirror"]
    assert 0.0 < summary["rms_distance_mm"] < summary["hausdorff_mm"] < 5.0
    assert "off the field's zero set" in ended.err
