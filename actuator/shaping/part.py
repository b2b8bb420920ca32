"""The part that a design on its finer mesh becomes, as a body between plates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.body.inflation import Inflation
from actuator.body.mesh import EDGES, BodyMesh
from actuator.body.meshing import mesh_of
from actuator.body.plates import glued
from actuator.domains.interface import Domain
from actuator.domains.tetrahedra import Tetrahedra
from actuator.geometry.islands import without_islands
from actuator.geometry.location import located
from actuator.geometry.solid import prove_solid
from actuator.geometry.whole import whole_boundary
from actuator.geometry.zero_set import Surface


@dataclass(frozen=True)
class Part:
    """A part.

    Attributes:
        surface: of the whole, closed, mm.
        mesh: that fits it.
    """

    surface: Surface
    mesh: BodyMesh


def part_of(domain: Domain, tetrahedra: Tetrahedra, chi: Floats, threshold: float, size: float) -> Part:
    """Extract, prove, glue and mesh the solid {χ > threshold}.

    Args:
        domain: of the design.
        tetrahedra: of the domain.
        chi: χ at its vertices, (n_vertices,).
        threshold: level of the surface.
        size: largest edge of the mesh, mm.

    Raises:
        actuator.failure.NotInflatable: if there is no closed chamber between the plates, or the mesh is too coarse.
        actuator.failure.EmptySolid: if nothing is solid.
        actuator.failure.NotManifold: if the surface bounds no solid.
    """
    whole = whole_boundary(domain, tetrahedra, chi, threshold).surface
    surface, _ = without_islands(prove_solid(whole.vertices, whole.triangles).surface)
    return Part(surface, mesh_of(glued(surface.vertices, surface.triangles), size))


def carried(before: Inflation, z: Floats, after: Inflation) -> Floats:
    """The state of a part at the nodes of another one that is almost the same, (size,): where to look for its own."""
    mesh, nodes = before.mesh, after.mesh.nodes
    corners, shares, cells = located(mesh.nodes, mesh.cells[:, :4], nodes)
    a, b = EDGES.T
    shapes = np.concatenate([shares * (2.0 * shares - 1.0), 4.0 * shares[:, a] * shares[:, b]], axis=1)
    displacement = np.einsum("na,nai->ni", shapes, before.displacement(z)[mesh.cells[cells]])
    stress = before.mean_stress(z)[corners] if before.mixed else np.zeros((len(nodes), 4))
    return after.unknowns(displacement, (stress * shares).sum(axis=1)[: after.mesh.vertices], z[before.of_arm])
