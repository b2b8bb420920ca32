"""A symmetric solid, meshed by Mmg as a half and as a whole."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import PRECISE, inflation
from shapes import rod

from actuator.body.mesh import BodyMesh, signed_volumes
from actuator.body.meshing import mesh_of
from actuator.body.plates import glued
from actuator.equations.arm import COORDINATES
from actuator.geometry.solid import surface_of
from actuator.solve.path import begin, follow

ECCENTRIC = surface_of(rod(8.0, 10.0) - rod(5.0, 20.0).translate([0.0, 0.0, 1.0]))


def motion_of(mesh: BodyMesh):
    problem = inflation(mesh, pressure=0.06, stiffness=0.02 if mesh.half else 0.04)
    here = begin(problem, problem.rest, 0.0, PRECISE)
    point = list(follow(problem, here, 1.0, PRECISE))[-1]
    state = problem.state(point.z, 1.0)
    return dict(zip(COORDINATES, problem.arm.full(state.motion).tolist(), strict=True)), state


@pytest.fixture(scope="module")
def meshes() -> tuple[BodyMesh, BodyMesh]:
    solid = glued(ECCENTRIC.vertices, ECCENTRIC.triangles)
    assert solid.symmetric
    return mesh_of(solid, 3.0), mesh_of(solid, 3.0, half=False)


def test_the_half_is_half_of_the_whole(meshes) -> None:
    half, whole = meshes
    assert half.half
    assert not whole.half
    assert len(whole.symmetry) == 0
    for mesh, share in ((half, 0.5), (whole, 1.0)):
        body = signed_volumes(mesh.nodes, mesh.cells[:, :4])
        assert (body > 0.0).all()
        assert body.sum() == pytest.approx(share * np.pi * (64.0 - 25.0) * 10.0, rel=0.01)
        assert mesh.opening == pytest.approx(share * 25.0 * np.pi, rel=0.01)


def test_planes_are_planes(meshes) -> None:
    for mesh in meshes:
        assert (mesh.nodes[mesh.fixed, 0] == 0.0).all()
        assert (mesh.nodes[mesh.tip, 0] == mesh.length).all()
        assert (mesh.nodes[mesh.symmetry, 1] == 0.0).all()
        centre = mesh.nodes[np.unique(mesh.walls)] - [0.0, 0.0, 1.0]
        np.testing.assert_allclose(np.linalg.norm(centre[:, 1:], axis=1), 5.0, atol=0.02)


def test_both_move_alike(meshes) -> None:
    (half, of_half), (whole, of_whole) = map(motion_of, meshes)
    for name in ("T1", "T3", "theta2"):
        assert half[name] == pytest.approx(whole[name], rel=0.02), name
    assert abs(whole["T2"]) < 0.01 * abs(whole["T1"])
    assert abs(whole["theta1"]) < 0.01 * abs(whole["theta2"])
    assert abs(whole["theta3"]) < 0.01 * abs(whole["theta2"])
    assert 2.0 * of_half.volume == pytest.approx(of_whole.volume, rel=0.005)
    assert 2.0 * of_half.stored == pytest.approx(of_whole.stored, rel=0.02)
