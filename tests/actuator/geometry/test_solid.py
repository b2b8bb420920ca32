"""The proof of a 2-manifold, its repair and its refusals."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from actuator.arrays import Floats, Ints
from actuator.failure import EmptySolid, InvalidField, NotManifold
from actuator.geometry.solid import component_volumes, is_two_manifold, prove_solid, rounded
from actuator.geometry.zero_set import Surface

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def box(size: float = 1.0, centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> tuple[Floats, Ints]:
    mesh = trimesh.creation.box((size, size, size))
    return np.array(mesh.vertices) + centre, np.array(mesh.faces)


def joined(*parts: tuple[Floats, Ints]) -> tuple[Floats, Ints]:
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in parts[:-1]])
    triangles = [t + offset for (_, t), offset in zip(parts, offsets, strict=True)]
    return np.concatenate([v for v, _ in parts]), np.concatenate(triangles)


def test_two_manifold_is_recognised() -> None:
    assert is_two_manifold(TETRAHEDRON)
    assert is_two_manifold(joined(box(), box())[1])


@pytest.mark.parametrize(
    "triangles",
    [
        TETRAHEDRON[:3],  # open
        np.concatenate([TETRAHEDRON[:3], TETRAHEDRON[3:, ::-1]]),  # one triangle turned around
        np.concatenate([TETRAHEDRON, TETRAHEDRON]),  # twice the same
        np.concatenate([TETRAHEDRON, np.array([0, 4, 5, 6])[TETRAHEDRON]]),  # two that share a vertex
        np.concatenate([TETRAHEDRON, np.array([0, 1, 4, 5])[TETRAHEDRON]]),  # two that share an edge
    ],
)
def test_what_is_no_two_manifold_is_recognised(triangles: Ints) -> None:
    assert not is_two_manifold(triangles)


def test_a_sound_solid_is_proved_and_kept() -> None:
    mesh = trimesh.creation.torus(3.0, 1.0)
    proof = prove_solid(np.array(mesh.vertices), np.array(mesh.faces))
    assert (proof.status, proof.repair_tolerance, proof.genus) == ("NoError", 0.0, 1)
    assert (proof.vertices_removed, proof.triangles_removed) == (0, 0)
    assert component_volumes(proof.surface).sum() == pytest.approx(mesh.volume, rel=1e-5)
    np.testing.assert_array_equal(proof.surface.vertices, proof.surface.vertices.astype(np.float32))


def test_an_edge_too_short_for_float32_is_collapsed() -> None:
    """Splitting an edge next to its end gives two vertices that are one in a file."""
    vertices, triangles = CORNERS + 20.0, TETRAHEDRON
    middle = vertices[0] + 1e-9 * (vertices[1] - vertices[0])
    split = np.array([[0, 2, 4], [4, 2, 1], [0, 4, 3], [4, 1, 3], [0, 3, 2], [1, 2, 3]])
    proof = prove_solid(np.concatenate([vertices, [middle]]), split)
    assert is_two_manifold(proof.surface.triangles)
    assert proof.vertices_removed == 1
    assert proof.triangles_removed == 2
    assert component_volumes(proof.surface) == pytest.approx([1.0 / 6.0], rel=1e-5)
    assert len(triangles) == len(proof.surface.triangles)


def test_a_neck_too_thin_for_float32_is_repaired() -> None:
    """A ring of triangles around a neck of 1e-7 mm rounds to a pinched vertex; the repair parts it."""
    angle = np.arange(12) * np.pi / 6.0
    profile = [(20.0, 1.0), (21.0, 1e-8), (22.0, 1.0)]
    rings = [np.stack([np.full(12, x), 20.0 + r * np.cos(angle), 20.0 + r * np.sin(angle)], 1) for x, r in profile]
    vertices = np.concatenate([*rings, [[20.0, 20.0, 20.0], [22.0, 20.0, 20.0]]])
    a, b = np.arange(12), (np.arange(12) + 1) % 12
    sides = [np.stack([i * 12 + a, i * 12 + b, i * 12 + 12 + b], 1) for i in (0, 1)]
    sides += [np.stack([i * 12 + a, i * 12 + 12 + b, i * 12 + 12 + a], 1) for i in (0, 1)]
    caps = [np.stack([np.full(12, 36), b, a], 1), np.stack([np.full(12, 37), 24 + a, 24 + b], 1)]
    triangles = np.concatenate(sides + caps)
    assert is_two_manifold(triangles)
    assert not is_two_manifold(rounded(vertices, triangles).triangles)
    proof = prove_solid(vertices, triangles)
    assert proof.repair_tolerance > 0.0
    assert is_two_manifold(proof.surface.triangles)
    assert component_volumes(proof.surface).sum() == pytest.approx(2.0 * (0.5 * 12 * 0.5) / 3.0, rel=1e-4)


def test_touching_sheets_are_pulled_apart() -> None:
    """A gap of 1e-9 mm between two cubes vanishes in a file, where edges of four triangles would be left."""
    vertices, triangles = joined(box(1.0, (20.0, 0.0, 0.0)), box(1.0, (21.0 + 1e-9, 0.0, 0.0)))
    assert not is_two_manifold(rounded(vertices, triangles).triangles)
    proof = prove_solid(vertices, triangles)
    assert is_two_manifold(proof.surface.triangles)
    np.testing.assert_allclose(component_volumes(proof.surface), [1.0, 1.0], rtol=2.0 * proof.repair_tolerance)


def test_refusals() -> None:
    vertices, triangles = box()
    with pytest.raises(NotManifold, match="bound no solid"):
        prove_solid(vertices, triangles[1:])
    with pytest.raises(NotManifold, match="no positive volume"):
        prove_solid(vertices, triangles[:, ::-1])
    with pytest.raises(EmptySolid, match="no triangles"):
        prove_solid(vertices, triangles[:0])
    with pytest.raises(InvalidField, match="not finite"):
        prove_solid(np.where(vertices > 0, np.nan, vertices), triangles)


def test_rounding_merges_equal_vertices_and_the_two_zeros() -> None:
    soup = CORNERS[TETRAHEDRON].reshape(-1, 3)
    soup[::2] = np.where(soup[::2] == 0.0, -0.0, soup[::2])
    surface = rounded(soup, np.arange(12).reshape(-1, 3))
    assert len(surface.vertices) == 4
    assert is_two_manifold(surface.triangles)


def test_volumes_of_bodies_and_cavities() -> None:
    inner, outer, island = box(1.0), box(3.0), box(2.0, (10.0, 0.0, 0.0))
    surface = Surface(*joined((inner[0], inner[1][:, ::-1]), outer, island))
    np.testing.assert_allclose(component_volumes(surface), [27.0, 8.0, -1.0], rtol=1e-12)
