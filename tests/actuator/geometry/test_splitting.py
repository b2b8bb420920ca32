"""Triangles split where a field is curved."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from actuator.geometry.splitting import split_where_curved
from actuator.geometry.zero_set import Surface

Floats = np.ndarray


def box() -> Surface:
    mesh = trimesh.creation.box(extents=(4.0, 4.0, 4.0))
    return Surface(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64))


def steep(points: Floats) -> Floats:
    """A step of width 0.5 across X1 = 0.3."""
    return np.tanh((points[:, :1] - 0.3) / 0.5)


def test_field_becomes_linear_and_the_solid_stays() -> None:
    surface, values = split_where_curved(box(), steep, 0.05, 1e-3, rounds=12)
    mesh = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(64.0, rel=1e-12)
    assert mesh.area == pytest.approx(96.0, rel=1e-12)
    np.testing.assert_array_equal(values, steep(surface.vertices))
    ends = surface.vertices[mesh.edges_unique]
    assert np.abs(steep(ends.mean(axis=1)) - steep(ends.reshape(-1, 3)).reshape(-1, 2).mean(1)[:, None]).max() <= 0.05
    # Where the field is flat, nothing is split.
    assert len(surface.triangles) < 3000


def test_linear_field_changes_nothing() -> None:
    surface, values = split_where_curved(box(), lambda points: points @ np.ones((3, 2)), 1e-9, 0.0)
    np.testing.assert_array_equal(surface.triangles, box().triangles)
    assert values.shape == (8, 2)


def test_short_edges_are_left() -> None:
    """Sides are 4 mm long and diagonals 5.7 mm: only these are halved."""
    surface, _ = split_where_curved(box(), lambda points: points**2, 1e-9, 5.0, rounds=1)
    new = surface.vertices[8:]
    assert len(new) == 6
    np.testing.assert_array_equal(np.sort(np.abs(new), axis=1), np.tile([0.0, 0.0, 2.0], (6, 1)))
