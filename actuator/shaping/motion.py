"""How the surface of a part moves with χ.

A place X of the surface {χ = level} moves by -∇χ δχ / |∇χ|² when χ changes by δχ, in the plane of a plate or of
symmetry by the same with ∇χ in that plane (Osher & Sethian 1988, doi:10.1016/0021-9991(88)90002-2). The nodes inside
of the body follow by harmonic extension, which makes a derivative by all nodes one by those of the surface.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import cg

from actuator.arrays import Bools, Floats
from actuator.body.element import Points
from actuator.body.mesh import BodyMesh
from actuator.domains.interface import Domain
from actuator.domains.tetrahedra import Tetrahedra
from actuator.failure import SolveFailure
from actuator.geometry.location import located

#: Least share of ∇χ that must lie in a plane for nodes on it to move: a surface that is almost parallel to a plate
#: would run along it.
LEAST_IN_PLANE = 0.3
#: Relative residual of the harmonic extension, and its most iterations.
EXTENSION_TOLERANCE, MOST_ITERATIONS = 1e-6, 4000


class SurfaceMotion:
    """Motion of the nodes on the sides of a body with the values of χ at the vertices of its domain.

    Args:
        domain: of χ.
        tetrahedra: of the domain, in which χ is linear.
        slope: ∇χ at the vertices, (n_vertices, 3), 1/mm.
        mesh: of the body.
        points: of its cells, which the harmonic extension is computed with.

    Attributes:
        nodes: numbers of the nodes on the sides, (n,).
        outward: unit normals there, (n, 3), in the plane for nodes of a plate or of symmetry.
        rate: motion along the normal with χ, (n,), mm; 0 where a node does not move.
        weights: of the vertices at the nodes, (n, n_vertices).
    """

    def __init__(self, domain: Domain, tetrahedra: Tetrahedra, slope: Floats, mesh: BodyMesh, points: Points) -> None:
        self._mesh, self._laplacian = mesh, _laplacian(mesh, points)
        self.nodes = np.flatnonzero(_sides(mesh))
        places = mesh.nodes[self.nodes]
        corners, shares, _ = located(domain.points, tetrahedra.corners, places)
        rows = np.repeat(np.arange(len(places)), 4)
        self.weights = sp.csr_array((shares.ravel(), (rows, corners.ravel())), (len(places), len(domain.points)))
        steepest: Floats = np.asarray(self.weights @ slope)
        whole = np.linalg.norm(steepest, axis=1)
        steepest[(places[:, 0] == 0.0) | (places[:, 0] == mesh.length), 0] = 0.0
        if mesh.half:
            steepest[np.isin(self.nodes, mesh.symmetry), 1] = 0.0
        inside = np.linalg.norm(steepest, axis=1)
        moves = inside > LEAST_IN_PLANE * whole
        size = np.where(moves, inside, 1.0)
        self.outward = np.where(moves[:, None], -steepest / size[:, None], 0.0)
        self.rate = np.where(moves, 1.0 / size, 0.0)

    def along_normal(self, change: Floats) -> Floats:
        """Motion of the nodes along their normals, (n,), mm, for a change of χ (n_vertices,)."""
        return self.rate * (self.weights @ change)

    def by_normal_motion(self, by_nodes: Floats) -> Floats:
        """The derivative by the motion of the nodes along their normals, (n,), of one by all nodes (n_nodes, 3).

        Raises:
            SolveFailure: if the harmonic extension is not found.
        """
        return np.einsum("ni,ni->n", self._of_surface(by_nodes), self.outward)

    def by_chi(self, by_normal_motion: Floats) -> Floats:
        """The derivative by χ at the vertices, (n_vertices,), of one by the motion along the normals (n,)."""
        return np.asarray(self.weights.T @ (self.rate * by_normal_motion))

    def _of_surface(self, by_nodes: Floats) -> Floats:
        """The same as a derivative by the nodes of the sides, (n, 3), that the others follow."""
        mesh, laplacian = self._mesh, self._laplacian
        held = np.zeros(by_nodes.shape, dtype=bool)
        held[self.nodes] = True
        held[mesh.fixed, 0] = held[mesh.tip, 0] = True
        held[mesh.symmetry, 1] = True
        found = np.empty((len(self.nodes), 3))
        for k in range(3):
            free = np.flatnonzero(~held[:, k])
            matrix = laplacian[free][:, free]
            inverse_diagonal = sp.diags_array(1.0 / matrix.diagonal())
            solution, failed = cg(
                matrix, by_nodes[free, k], rtol=EXTENSION_TOLERANCE, maxiter=MOST_ITERATIONS, M=inverse_diagonal
            )
            if failed:
                raise SolveFailure("The motion of the surface could not be extended into the body.")
            found[:, k] = by_nodes[self.nodes, k] - laplacian[self.nodes][:, free] @ solution
        return found


def _laplacian(mesh: BodyMesh, points: Points) -> sp.csr_array:
    """∫ ∇N_a · ∇N_b dV of the nodes, (n_nodes, n_nodes), mm."""
    local = np.einsum("eq,eqai,eqbi->eab", points.volumes, points.gradients, points.gradients, optimize=True)
    rows, columns = np.repeat(mesh.cells, 10, axis=1).ravel(), np.tile(mesh.cells, (1, 10)).ravel()
    return sp.csr_array((local.ravel(), (rows, columns)), (len(mesh.nodes), len(mesh.nodes)))


def _sides(mesh: BodyMesh) -> Bools:
    """Which nodes lie on faces of the boundary that are in no plane of a plate or of symmetry, (n_nodes,)."""
    x = mesh.nodes[mesh.boundary, 0]
    flat = (x == 0.0).all(axis=1) | (x == mesh.length).all(axis=1)
    sides = np.zeros(len(mesh.nodes), dtype=bool)
    sides[mesh.boundary[~flat]] = True
    return sides
