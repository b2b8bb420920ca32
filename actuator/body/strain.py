"""What a state of a body does to its material: strain, stretch, and where walls touch each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from actuator.arrays import Bools, Floats, Ints
from actuator.body.element import POINTS, points_of
from actuator.body.mesh import BodyMesh

#: Depth, over the length of the body, to which a node of the surface must have entered another cell to count.
ENTERED = 1e-3
#: Cells near a node that are asked whether they hold it.
NEIGHBOURS = 24
#: Spots of high strain that are named.
SPOTS = 3


@dataclass(frozen=True)
class Strains:
    """Strain of a body in one state.

    Attributes:
        strain: sqrt(2 Ψ / E) at the points of the cells, (n_cells, 4).
        stretch: largest principal stretch there, (n_cells, 4).
        weights: volume that each point stands for, (n_cells, 4), mm³.
        places: of the points, undeformed, (n_cells, 4, 3), mm.
    """

    strain: Floats
    stretch: Floats
    weights: Floats
    places: Floats

    def share_above(self, limit: float) -> float:
        """Share of the volume with a strain above a limit."""
        return float(self.weights[self.strain > limit].sum() / self.weights.sum())

    def percentile(self, values: Floats, share: float) -> float:
        """The value below which a share of the volume stays."""
        order = np.argsort(values, axis=None)
        volume = np.cumsum(self.weights.ravel()[order])
        return float(values.ravel()[order][np.searchsorted(volume, share * volume[-1])])

    def spots(self, apart: float) -> list[tuple[float, tuple[float, float, float]]]:
        """The largest strains of cells that lie so far apart (mm), each with its place."""
        mean = self.strain.mean(axis=1)
        centres = self.places.mean(axis=1)
        found: list[tuple[float, tuple[float, float, float]]] = []
        left = np.ones(len(mean), dtype=bool)
        while left.any() and len(found) < SPOTS:
            worst = int(np.argmax(np.where(left, mean, -1.0)))
            x, y, z = centres[worst].tolist()
            found.append((float(self.strain[worst].max()), (x, y, z)))
            left &= np.linalg.norm(centres - centres[worst], axis=1) > apart
        return found


def strains(mesh: BodyMesh, displacement: Floats, density: Floats, youngs_modulus: float) -> Strains:
    """Strain and stretch of a state.

    Args:
        mesh: of the body.
        displacement: (n_nodes, 3), mm.
        density: Ψ at the points of the cells, (n_cells, 4), N/mm².
        youngs_modulus: E, N/mm².
    """
    points = points_of(mesh.nodes, mesh.cells)
    F = np.eye(3) + np.einsum("eai,eqaj->eqij", displacement[mesh.cells], points.gradients)
    stretch = np.sqrt(np.linalg.eigvalsh(np.swapaxes(F, 2, 3) @ F)[..., -1])
    places = np.einsum("qc,eci->eqi", POINTS, mesh.nodes[mesh.cells[:, :4]])
    return Strains(np.sqrt(2.0 * np.maximum(density, 0.0) / youngs_modulus), stretch, points.volumes, places)


def touching(mesh: BodyMesh, displacement: Floats) -> tuple[float, float, float] | None:
    """Where walls have passed into each other, undeformed, mm; None if nowhere.

    A node of the surface touches if it lies inside of another part of the deformed body, taken with flat faces, or of
    the image of a half, by more than :data:`ENTERED`; contact is not part of the equilibrium, so nothing stops it from
    doing so.
    """
    deformed = mesh.nodes + displacement
    depth = ENTERED * mesh.length
    number = np.unique(mesh.boundary)
    corners = deformed[mesh.cells[:, :4]]
    inverse = np.linalg.inv(corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    # Smallest height of each cell: barycentric coordinates times it are depths.
    heights = 1.0 / np.linalg.norm(np.concatenate([inverse, -inverse.sum(axis=1, keepdims=True)], axis=1), axis=2)
    _, near = cKDTree(corners.mean(axis=1)).query(deformed[number], k=min(NEIGHBOURS, len(corners)))
    near = np.asarray(near).reshape(len(number), -1)
    local = np.einsum("nkcj,nkj->nkc", inverse[near], deformed[number][:, None] - corners[near, 0])
    barycentric = np.concatenate([local, 1.0 - local.sum(axis=2, keepdims=True)], axis=2)
    inside = (barycentric * heights[near]).min(axis=2)
    node, which = np.nonzero(inside > depth)
    entered = np.zeros(len(number))
    if len(node):
        foreign = ~_beside(mesh, number[node], near[node, which])
        np.maximum.at(entered, node[foreign], inside[node[foreign], which[foreign]])
    if mesh.half:
        entered = np.maximum(entered, -deformed[number, 1])
    worst = int(np.argmax(entered))
    if entered[worst] <= depth:
        return None
    x, y, z = mesh.nodes[number[worst]].tolist()
    return x, y, z


def _beside(mesh: BodyMesh, nodes: Ints, cells: Ints) -> Bools:
    """Whether cells (n,) share a vertex with one that holds the node (n,), as flat faces cut off nodes between them."""
    number = np.arange(len(mesh.cells))
    ones, size = np.ones(mesh.cells.shape, dtype=np.int32), (len(mesh.cells), len(mesh.nodes))
    holds = csr_array((ones.ravel(), (np.repeat(number, mesh.cells.shape[1]), mesh.cells.ravel())), size)
    asked, row = np.unique(nodes, return_inverse=True)
    around = holds[:, asked].T @ holds @ holds.T
    return np.asarray(around[row, cells] > 0)
