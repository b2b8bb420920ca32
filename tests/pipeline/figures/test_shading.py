"""Surfaces split at sharp edges, and how they are drawn."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from actuator.geometry.zero_set import Surface
from pipeline.figures.shading import AMBIENT, LIGHT, draw_solid, projection, split_at_sharp_edges, vertex_normals


def surface_of(mesh: trimesh.Trimesh) -> Surface:
    return Surface(np.array(mesh.vertices, dtype=float), np.array(mesh.faces, dtype=np.int64))


def test_box_falls_into_its_faces() -> None:
    box = surface_of(trimesh.creation.box())
    origin, triangles = split_at_sharp_edges(box)
    assert len(origin) == 24
    assert (origin[triangles] == box.triangles).all()
    normals = vertex_normals(box.vertices[origin], triangles)
    assert (np.abs(normals).max(axis=1) == 1.0).all()


def test_sphere_stays_whole() -> None:
    sphere = surface_of(trimesh.creation.icosphere(subdivisions=3))
    origin, triangles = split_at_sharp_edges(sphere)
    assert sorted(origin) == list(range(len(sphere.vertices)))
    normals = vertex_normals(sphere.vertices[origin], triangles)
    np.testing.assert_allclose(normals, sphere.vertices[origin], atol=0.02)


@pytest.mark.parametrize(("sharp", "parts"), [(30.0, 2 * 16 + 2 * 16), (95.0, 2 * 16)])
def test_threshold_decides_what_is_sharp(sharp: float, parts: int) -> None:
    """A prism of 16 sides: 22.5 degrees from side to side, 90 from side to end."""
    prism = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=16)
    centres = np.flatnonzero(np.hypot(*prism.vertices[:, :2].T) < 1e-9)
    origin, _ = split_at_sharp_edges(surface_of(prism), sharp)
    assert len(origin) == parts + len(centres)


def test_projection_has_x3_upwards() -> None:
    right, up, eye = projection((0.0, -1.0, 0.0))
    assert right.tolist() == [1.0, 0.0, 0.0]
    assert up.tolist() == [0.0, 0.0, 1.0]
    assert eye.tolist() == [0.0, -1.0, 0.0]


def test_near_hides_far_and_light_falls_by_the_angle() -> None:
    """A wide tilted plate behind a small one that faces the eye."""
    square = np.array([[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]])
    turn = np.radians(-50.0)
    tilted = 3.0 * square @ np.array([[1, 0, 0], [0, np.cos(turn), -np.sin(turn)], [0, np.sin(turn), np.cos(turn)]])
    back = np.array([0.0, 6.0, 0.0])
    near, far = square - back, tilted + back
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    both = Surface(np.concatenate([near, far]), np.concatenate([faces, faces + 4]))
    figure = Figure(figsize=(2.0, 2.0), dpi=100)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    draw_solid(axes, both, (0.0, -1.0, 0.0), "white")
    axes.set(xlim=(-3.0, 3.0), ylim=(-3.0, 3.0))
    canvas.draw()
    seen = np.asarray(canvas.buffer_rgba())[..., 0] / 255.0
    light = LIGHT / np.linalg.norm(LIGHT)
    for place, normal in (((100, 100), (0.0, 0.0, 1.0)), ((100, 30), (0.0, np.sin(-turn), np.cos(turn)))):
        sides = [AMBIENT + (1.0 - AMBIENT) * max(0.0, light @ (normal * np.array([1.0, s, 1.0]))) for s in (1, -1)]
        assert min(abs(seen[place] - side) for side in sides) < 0.02
    assert abs(seen[100, 100] - seen[100, 30]) > 0.05
