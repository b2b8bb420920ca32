"""The design domain: half of a cylinder, meshed by an O-grid section swept along its axis.

Section 2 of Mehta & Poulios (arXiv:2605.20101): radius R, length L, cut at the symmetry plane X2 = 0.
Axes are X1 (cylinder axis), X2 (normal to the symmetry plane), X3 (bending direction); lengths in mm.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from skfem import Basis, ElementHex1, ElementHexS2, MeshHex

from actuator.arrays import Floats, Ints

#: Bulge of the core's sides, 0 straight to 1 circular. 0.3 makes the three angles that meet at a
#: corner of the core nearly equal (118 and 2 x 121 degrees).
CORE_BULGE = 0.3

#: Local vertex offsets (axial, second, third) in the order of scikit-fem's reference hexahedron.
HEX_OFFSETS: Ints = ElementHex1.doflocs.astype(np.int64)


@dataclass(frozen=True)
class HalfCylinder:
    """Hexahedral mesh of the half cylinder ``0 <= X1 <= length``, ``X2 >= 0``, ``r <= radius``.

    The section has 2 (m² + 2 m k) cells: a core of m x m cells per quarter and k rings around it;
    m = 12, k = 5 gives the paper's 528.

    Args:
        radius: R in mm.
        length: L in mm.
        core_cells: m, cells along each side of a quarter of the core.
        rings: k, cells between the core and the cylinder wall.
        layers: N1, cells along X1.

    Raises:
        ValueError: if a size is not positive.
    """

    radius: float
    length: float
    core_cells: int
    rings: int
    layers: int

    def __post_init__(self) -> None:
        if not (self.radius > 0.0 and self.length > 0.0):
            raise ValueError("radius and length must be positive")
        if min(self.core_cells, self.rings, self.layers) < 1:
            raise ValueError("core_cells, rings and layers must be at least 1")

    # ---------------------------------------------------------------- section

    @property
    def section_cells(self) -> int:
        """Number of cells in one section, N23."""
        return 2 * self.core_cells * (self.core_cells + 2 * self.rings)

    @cached_property
    def _section(self) -> tuple[Floats, Ints]:
        """Section points (ns, 2) as (X2, X3), and cells (nc, 2, 2) indexed by the two local axes."""
        m, k = self.core_cells, self.rings
        # The core's half side is chosen so that cells of the core and of the rings have about the same size;
        # with few rings its corners must still keep off the wall, or the rings would turn inside out.
        half_side = min(0.7 * m / (k + 0.875 * m), 0.6) * self.radius
        t, s = np.meshgrid(np.arange(m + 1) / m, np.arange(-m, m + 1) / m, indexing="ij")
        core = half_side * _bulged_square(t, s)
        core_id = np.arange((m + 1) * (2 * m + 1)).reshape(m + 1, 2 * m + 1)
        # Outline of the core from X3 < 0 over X2 > 0 to X3 > 0; 4 m edges.
        outline = np.concatenate([core_id[:-1, 0], core_id[-1, :], core_id[-2::-1, -1]])
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 4 * m + 1)
        wall = self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        wall[[0, -1], 0] = 0.0
        inner = core.reshape(-1, 2)[outline]
        weight = (np.arange(1, k + 1) / k)[:, None, None]
        rings = (1.0 - weight) * inner + weight * wall
        points = np.concatenate([core.reshape(-1, 2), rings.reshape(-1, 2)])
        ring_id = np.concatenate([outline[None], len(core_id.ravel()) + np.arange(k * (4 * m + 1)).reshape(k, -1)])
        cells = np.concatenate([_quads(core_id), _quads(ring_id)])
        return points, cells

    @property
    def section_points(self) -> int:
        """Number of vertices in one section."""
        return len(self._section[0])

    # ------------------------------------------------------------------- mesh

    @cached_property
    def mesh(self) -> MeshHex:
        """Vertices and 8-node cells; cell ``layer * section_cells + c`` is section cell ``c`` of that layer."""
        plane, quads = self._section
        ns, levels = len(plane), self.layers + 1
        x1 = np.linspace(0.0, self.length, levels)
        points = np.empty((3, ns * levels))
        points[0] = np.repeat(x1, ns)
        points[1:] = np.tile(plane.T, levels)
        axial, second, third = HEX_OFFSETS.T
        base = quads[:, second, third].T  # (8, nc)
        cells = (base[:, None, :] + ns * (axial[:, None] + np.arange(self.layers))[:, :, None]).reshape(8, -1)
        return MeshHex(points, cells.astype(np.int32))

    @cached_property
    def _quadratic(self) -> Basis:
        return Basis(self.mesh, ElementHexS2(), intorder=1)

    @property
    def points(self) -> Floats:
        """Vertices, (n_vertices, 3), mm. The first ``n_vertices`` nodes of :attr:`nodes` are the same points."""
        return self.mesh.p.T

    @property
    def cells(self) -> Ints:
        """8-node connectivity, (n_cells, 8), in scikit-fem's local order (:data:`HEX_OFFSETS`)."""
        return self.mesh.t.T

    @cached_property
    def nodes(self) -> Floats:
        """Nodes of the 20-node element, (n_nodes, 3), mm: vertices first, then edge midpoints."""
        return np.ascontiguousarray(self._quadratic.doflocs.T)

    @cached_property
    def edges(self) -> Ints:
        """Vertices at the ends of the edges, (n_edges, 2), in the order of the midpoints among :attr:`nodes`."""
        return np.ascontiguousarray(self.mesh.edges.T)

    @cached_property
    def node_cells(self) -> Ints:
        """20-node connectivity, (n_cells, 20), in scikit-fem's local order."""
        return np.ascontiguousarray(self._quadratic.element_dofs.T)

    # ------------------------------------------------------------- boundaries

    @cached_property
    def fixed_nodes(self) -> Ints:
        """Nodes on X1 = 0, where the displacement is zero."""
        return np.flatnonzero(self.nodes[:, 0] == 0.0)

    @cached_property
    def tip_nodes(self) -> Ints:
        """Nodes on X1 = L (the face Γ), which move with the rigid arm."""
        return np.flatnonzero(self.nodes[:, 0] == self.length)

    @cached_property
    def symmetry_nodes(self) -> Ints:
        """Nodes on the symmetry plane X2 = 0."""
        return np.flatnonzero(self.nodes[:, 1] == 0.0)

    @cached_property
    def wall_facets(self) -> Ints:
        """Indices of the mesh facets on the cylinder wall (Γ_ext)."""
        facets = self.mesh.boundary_facets()
        on_wall = np.zeros(self.mesh.nvertices, dtype=bool)
        on_wall[self.wall_vertices] = True
        return facets[on_wall[self.mesh.facets[:, facets]].all(axis=0)]

    @cached_property
    def wall_vertices(self) -> Ints:
        """Vertices on the cylinder wall r = R: the outermost ring of every section."""
        ns, per_ring = self.section_points, 4 * self.core_cells + 1
        last_ring = np.arange(ns - per_ring, ns)
        return (last_ring + ns * np.arange(self.layers + 1)[:, None]).ravel()

    # ------------------------------------------------------------- refinement

    def refined(self, factor: int) -> HalfCylinder:
        """The same cylinder with ``factor`` times the cells in all three directions.

        Every vertex is placed by the exact map of the section, so new ones at r = R lie on the cylinder,
        and every vertex of this mesh is a vertex of the finer one.
        """
        if factor < 1:
            raise ValueError("the refinement factor must be at least 1")
        return HalfCylinder(
            self.radius, self.length, factor * self.core_cells, factor * self.rings, factor * self.layers
        )

    def prolongation(self, factor: int) -> sp.csr_array:
        """Trilinear interpolation from the vertices of this mesh to those of :meth:`refined`.

        Interpolation is in the reference coordinates of each cell. Shape (n_fine, n_coarse), rows sum to 1.
        """
        m, k = self.core_cells, self.rings
        core = _grid_weights(m, 2 * m, factor)
        ring = _grid_weights(k, 4 * m, factor)
        plane_coarse, _ = self._section
        core_id = np.arange((m + 1) * (2 * m + 1)).reshape(m + 1, 2 * m + 1)
        outline = np.concatenate([core_id[:-1, 0], core_id[-1, :], core_id[-2::-1, -1]])
        ring_id = np.concatenate([outline[None], core_id.size + np.arange(k * (4 * m + 1)).reshape(k, -1)])
        to_section = sp.csr_array(
            (np.ones(ring_id.size), (np.arange(ring_id.size), ring_id.ravel())), (ring_id.size, len(plane_coarse))
        )
        pad = sp.csr_array((core.shape[0], len(plane_coarse) - core.shape[1]))
        outer = (ring @ to_section).tocsr()[4 * m * factor + 1 :]  # the first row of the rings is the core's outline
        section = sp.vstack([sp.hstack([core, pad]), outer])
        return sp.kron(_line_weights(self.layers, factor), section, format="csr")

    def coinciding(self, factor: int) -> Ints:
        """For every vertex of this mesh the number of the same point in :meth:`refined`, (n_vertices,)."""
        weights = self.prolongation(factor)
        rows = np.flatnonzero(np.diff(weights.indptr) == 1)  # interpolated from one vertex alone: the same point
        found = np.empty(weights.shape[1], dtype=np.int64)
        found[weights.indices[weights.indptr[rows]]] = rows
        return found


def _bulged_square(t: Floats, s: Floats) -> Floats:
    """Coons patch on [-1, 1]² whose sides bulge towards a circle; returns (X2, X3) per unit half side."""

    def side(x: Floats) -> tuple[Floats, Floats]:
        along = (1.0 - CORE_BULGE) * x + CORE_BULGE * np.sqrt(2.0) * np.sin(0.25 * np.pi * x)
        across = (1.0 - CORE_BULGE) + CORE_BULGE * np.sqrt(2.0) * np.cos(0.25 * np.pi * x)
        return along, across

    along_t, across_t = side(t)
    along_s, across_s = side(s)
    # Opposite sides are mirror images, so the two linear blends and the bilinear corners collapse to:
    x2 = t * across_s + along_t - t
    x3 = s * across_t + along_s - s
    return np.stack([x2, x3], axis=-1)


def _quads(node: Ints) -> Ints:
    """Cells (n, 2, 2) of a structured grid of node numbers."""
    corners = np.stack([np.stack([node[:-1, :-1], node[:-1, 1:]], -1), np.stack([node[1:, :-1], node[1:, 1:]], -1)], -2)
    return corners.reshape(-1, 2, 2)


def _line_weights(cells: int, factor: int) -> sp.csr_array:
    """Linear interpolation from ``cells + 1`` equidistant nodes to ``factor * cells + 1``."""
    fine = np.arange(factor * cells + 1)
    left = np.minimum(fine // factor, cells - 1)
    weight = (fine - factor * left) / factor
    rows = np.concatenate([fine, fine])
    columns = np.concatenate([left, left + 1])
    matrix = sp.csr_array((np.concatenate([1.0 - weight, weight]), (rows, columns)), (len(fine), cells + 1))
    matrix.eliminate_zeros()
    return matrix


def _grid_weights(first: int, second: int, factor: int) -> sp.csr_array:
    return sp.kron(_line_weights(first, factor), _line_weights(second, factor), format="csr")
