"""The same mesh, law and follower pressure in FElupe, an independent package: displacements, reactions and arm.

FElupe solves for the displacements with the plates moved as here; it knows nothing of the arm, whose equilibrium its
reactions must hold. Its tetrahedron, rule, isochoric law, change of areas and assembly are its own; written here with
them are the volumetric part K/2 (ln J)² and the faces of tetrahedra, which it lacks: cells with a rule on one face.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bodies import half_tube, imbalance, inflated, inflation, material, pulls, whole_tube
from scipy.sparse.linalg import spsolve

from actuator.arrays import Bools, Floats
from actuator.body.inflation import Inflation
from actuator.body.mesh import FACES, BodyMesh

felupe = pytest.importorskip("felupe")


def faces_as_regions(mesh: BodyMesh) -> list[Any]:
    """FElupe's regions of the cells with a wall at each of their four faces."""
    from felupe import Mesh, QuadraticTetra, Region
    from felupe.quadrature import Scheme

    # Gauss' rule of the square, pressed onto the triangle (Duffy 1982): exact to degree four.
    points, weights = np.polynomial.legendre.leggauss(4)
    s, t = (0.5 * (values.ravel() + 1.0) for values in np.meshgrid(points, points, indexing="ij"))
    weights = 0.25 * np.outer(weights, weights).ravel() * (1.0 - s)
    inside = np.stack([1.0 - s - (1.0 - s) * t, s, (1.0 - s) * t])
    wanted = {tuple(sorted(face)) for face in mesh.walls[:, :3].tolist()}
    found = []
    for face in FACES[:, :3]:
        there = np.array([tuple(sorted(cell)) in wanted for cell in mesh.cells[:, face].tolist()])
        if not there.any():
            continue
        barycentric = np.zeros((4, len(s)))
        barycentric[face] = inside
        region = Region(
            Mesh(mesh.nodes, mesh.cells[there], "tetra10"), QuadraticTetra(), Scheme(barycentric[1:].T, weights)
        )
        first, second = np.eye(4)[face[1:], 1:] - np.eye(4)[face[0], 1:]  # tangents in the cell's own coordinates
        area = np.cross(*(np.einsum("ijqc,j->iqc", region.dXdr, way) for way in (first, second)), axis=0)
        size = np.linalg.norm(area, axis=0)
        region.dV, region.normals = weights[:, None] * size, area / size
        found.append(region)
    return found


class InFelupe:
    """The body in FElupe."""

    def __init__(self, problem: Inflation, bulk: float, shear: float) -> None:
        from felupe import (
            Field,
            FieldContainer,
            Material,
            Mesh,
            NeoHooke,
            RegionQuadraticTetra,
            SolidBody,
            SolidBodyPressure,
        )
        from felupe.math import cdya_il, det, dya, inv, transpose
        from felupe.quadrature import Scheme

        def inverse(x: list[Floats]) -> tuple[Floats, Floats]:
            J = det(x[0])
            return J, transpose(inv(x[0], J))

        def stress(x: list[Floats], bulk: float) -> list[Any]:
            J, F = inverse(x)
            return [bulk * np.log(J) * F, x[-1]]

        def elasticity(x: list[Floats], bulk: float) -> list[Floats]:
            J, F = inverse(x)
            return [bulk * (dya(F, F) - np.log(J) * cdya_il(F, F))]

        mesh = problem.mesh
        # FElupe's rule of four points is this one to seven digits.
        near, far = (5.0 + 3.0 * np.sqrt(5.0)) / 20.0, (5.0 - np.sqrt(5.0)) / 20.0
        rule = Scheme(far + (near - far) * np.eye(4)[:, 1:], np.full(4, 1.0 / 24.0))
        region = RegionQuadraticTetra(Mesh(mesh.nodes, mesh.cells, "tetra10"), quadrature=rule)
        law = NeoHooke(mu=shear) & Material(stress, elasticity, bulk=bulk)
        self.field = FieldContainer([Field(region, dim=3)])
        self.items = [SolidBody(law, self.field)]
        for region in faces_as_regions(mesh):
            self.items.append(SolidBodyPressure(FieldContainer([Field(region, dim=3)]), problem.pressure))

    def solve(self, given: Floats, free: Bools) -> tuple[Floats, Floats]:
        """Displacements and nodal forces (n_nodes, 3) each, for displacements given where they are not free."""
        u, unknown = np.where(free, 0.0, given), np.flatnonzero(free)
        for _ in range(20):
            self.field[0].values = u
            f = sum(i.assemble.vector(self.field) * (i.assemble.multiplier or 1.0) for i in self.items).toarray()
            if np.linalg.norm(f[unknown]) < 1e-12 * np.linalg.norm(f):
                return u, f.reshape(u.shape)
            K = sum(i.assemble.matrix() * (i.assemble.multiplier or 1.0) for i in self.items)
            step = np.zeros(u.size)
            step[unknown] = spsolve(K.tocsc()[unknown][:, unknown], -f[unknown, 0])
            u = u + step.reshape(u.shape)
        raise AssertionError("FElupe did not converge")


@pytest.mark.parametrize("mesh", [half_tube(4, 2, 1), whole_tube(4, 2, 1)], ids=["half", "whole"])
def test_felupe_finds_the_same_displacements_and_reactions(mesh: BodyMesh) -> None:
    stuff = material(0.48)
    problem = inflation(mesh, stuff, pressure=0.06, mixed=False)
    point = inflated(problem)
    ours, held = problem.state(point.z, 1.0), problem.reactions(point.z, 1.0)
    assert np.abs(ours.displacement).max() > 0.1
    u, f = InFelupe(problem, stuff.bulk, stuff.shear).solve(ours.displacement, mesh.free)
    np.testing.assert_allclose(u, ours.displacement, rtol=0.0, atol=1e-8 * np.abs(ours.displacement).max())
    np.testing.assert_allclose(f, held, rtol=0.0, atol=1e-8 * np.abs(held).max())
    motion = ours.motion if mesh.half else ours.motion[[0, 2, 4]]
    pull = pulls(mesh, u, motion, f)
    np.testing.assert_allclose(imbalance(problem, motion, pull), 0.0, atol=1e-8 * np.abs(pull).max())
