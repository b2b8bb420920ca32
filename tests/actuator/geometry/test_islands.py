"""Which body stays, with which cavities, and the winding number that decides."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from actuator.arrays import Floats
from actuator.geometry.islands import winding_number, without_islands
from actuator.geometry.solid import component_volumes
from actuator.geometry.zero_set import Surface


def box(size: float, *centre: float, inward: bool = False) -> tuple[Floats, NDArray[np.int64]]:
    mesh = trimesh.creation.box((size, size, size))
    faces = np.array(mesh.faces)
    return np.array(mesh.vertices) + centre, faces[:, ::-1] if inward else faces


def joined(*parts: tuple[Floats, NDArray[np.int64]]) -> Surface:
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in parts[:-1]])
    triangles = [t + offset for (_, t), offset in zip(parts, offsets, strict=True)]
    return Surface(np.concatenate([v for v, _ in parts]), np.concatenate(triangles))


def test_one_body_is_kept_as_it_is() -> None:
    surface = joined(box(3.0, 0.0, 0.0, 0.0), box(1.0, 0.0, 0.0, 0.0, inward=True))
    kept, islands = without_islands(surface)
    assert kept is surface
    assert islands == []


def test_islands_beside_and_inside_go_with_their_cavities() -> None:
    surface = joined(
        box(0.5, 0.0, 0.0, 0.0),  # rattles in the cavity of the largest
        box(2.0, 9.0, 0.0, 0.0),
        box(1.0, 9.0, 0.0, 0.0, inward=True),
        box(4.0, 0.0, 0.0, 0.0),
        box(1.0, 0.0, 0.0, 0.0, inward=True),
    )
    kept, islands = without_islands(surface)
    np.testing.assert_allclose(component_volumes(kept), [64.0, -1.0])
    assert [island.volume for island in islands] == pytest.approx([8.0, 0.125])
    assert islands[0].centre == pytest.approx((9.0, 0.0, 0.0))
    assert len(np.unique(kept.triangles)) == len(kept.vertices)


def test_winding_number_tells_inside_from_outside() -> None:
    torus = trimesh.creation.torus(3.0, 1.0)
    corners = np.array(torus.vertices)[torus.faces]
    points = np.array([[3.0, 0.0, 0.0], [0.0, -3.2, 0.5], [0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [3.0, 0.0, 1.2]])
    np.testing.assert_allclose(winding_number(corners, points), [1.0, 1.0, 0.0, 0.0, 0.0], atol=1e-12)
