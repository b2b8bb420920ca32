"""What the rest of the program may ask of a design domain.

A domain lies between the plane X1 = 0, where it is held, and the plane X1 = L, whose face Γ moves with the rigid arm:
T1 along X1, T3 along X3 and the rotation θ2 about X2. It is meshed by hexahedra with eight vertices; lengths are in mm.
What a mesh alone decides has a default here. A new domain is a subclass, and its settings are registered in
:mod:`stages.domains`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import Basis, ElementHex1, ElementHexS2, MeshHex

from actuator.arrays import Floats, Ints
from actuator.domains.tetrahedra import Tetrahedra, pulled

#: Local vertex offsets (axial, second, third) in the order of scikit-fem's reference hexahedron.
HEX_OFFSETS: Ints = ElementHex1.doflocs.astype(np.int64)
#: Weights of an interpolation, and distances over the size of a domain, that are zero but for rounding.
ROUNDING = 1e-9


class Parameter(NamedTuple):
    """A number, or an array of numbers, that a domain is rebuilt from.

    Attributes:
        value: the number or the array.
        units: its unit as artifacts name it, ``mm`` or ``1``.
        meaning: what it is, for the reader of an artifact.
    """

    value: float | int | Floats | Ints
    units: str
    meaning: str


class Boundary:
    """A part of the surface of a mesh, given by its facets.

    Args:
        mesh: the whole mesh.
        facets: numbers of mesh facets, (n_facets,).
    """

    def __init__(self, mesh: MeshHex, facets: Ints) -> None:
        self._mesh, self.facets = mesh, facets

    @cached_property
    def vertices(self) -> Ints:
        """Vertices of the facets, (n,), ascending."""
        return np.unique(self._mesh.facets[:, self.facets])

    @cached_property
    def nodes(self) -> Ints:
        """Nodes of the 20-node element on the facets, (n,), ascending: their vertices, then the middles of their edges.

        Numbers are those of :attr:`Domain.nodes`.
        """
        n = self._mesh.nvertices
        corners = np.sort(self._mesh.facets[:, self.facets].astype(np.int64), axis=0)
        pairs = corners[np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])]
        edges = np.sort(self._mesh.edges.astype(np.int64), axis=0)
        on_edges = np.flatnonzero(np.isin(edges[0] * n + edges[1], pairs[:, 0] * n + pairs[:, 1]))
        return np.concatenate([self.vertices, n + on_edges])


class Domain(ABC):
    """A meshed design domain.

    A subclass has :attr:`mesh`, :attr:`length`, :attr:`size`, :attr:`parameters`, the three functions of place
    :meth:`inlet`, :meth:`passive_bound` and :meth:`initial_design`, and :meth:`refined`. The rest has defaults.

    Attributes:
        shape: name under which its settings are registered and its artifacts store it.
        length: L, distance of the tip's plane from the fixed one, mm.
    """

    shape: ClassVar[str]
    length: float

    # ------------------------------------------------------------------------------------------------- sizes

    @property
    @abstractmethod
    def size(self) -> float:
        """R, half the height along X3, mm: what the arm, the spring and displacements are measured against."""

    @property
    def mirrored(self) -> bool:
        """Whether half of the solid is modelled, X2 >= 0, with the rest its mirror image across the plane X2 = 0.

        Vertices on that plane then have X2 = 0 to the last bit. If not, the mesh is that of the whole solid.
        """
        return True

    @property
    @abstractmethod
    def parameters(self) -> Mapping[str, Parameter]:
        """Numbers by name that its type, called with them as keyword arguments, makes an equal domain from."""

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Domain) and type(self) is type(other) and self.parameters == other.parameters

    def __hash__(self) -> int:
        return hash((type(self), *self.parameters.items()))

    # -------------------------------------------------------------------------------------------------- mesh

    @property
    @abstractmethod
    def mesh(self) -> MeshHex:
        """Vertices in mm and 8-node cells, conforming and right-handed; a cached property, being asked for often."""

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

    @property
    def representatives(self) -> Ints:
        """One cell of each class, (n_classes,).

        Cells of a class are translates of each other along X1 with their vertices in the same order, so that they
        share shape functions; inlet and passive bound, too, must be the same in them. By default each cell is a class
        of its own; a domain swept along X1 saves time and memory by saying which cells are alike.
        """
        return np.arange(self.mesh.nelements)

    @property
    def cell_class(self) -> Ints:
        """Class of each cell, (n_cells,): an index into :attr:`representatives`."""
        return np.arange(self.mesh.nelements)

    # -------------------------------------------------------------------------------------------- boundaries

    @cached_property
    def _boundary_facets(self) -> Ints:
        return self.mesh.boundary_facets()

    def _in_plane(self, on_plane: NDArray[np.bool_]) -> Boundary:
        facets = self._boundary_facets
        return Boundary(self.mesh, facets[on_plane[self.mesh.facets[:, facets]].all(axis=0)])

    @cached_property
    def fixed(self) -> Boundary:
        """Where the displacement is zero; by default the face X1 = 0."""
        return self._in_plane(np.abs(self.points[:, 0]) <= ROUNDING * self.size)

    @cached_property
    def tip(self) -> Boundary:
        """Γ, which moves with the rigid arm: the face X1 = L.

        It must lie in that plane: the arm's rotation about X2 moves a point of it by its X3 alone.
        """
        return self._in_plane(np.abs(self.points[:, 0] - self.length) <= ROUNDING * self.size)

    @cached_property
    def symmetry(self) -> Boundary:
        """Facets on the plane X2 = 0, where u2 = 0, if the domain is mirrored there; else none."""
        return self._in_plane((self.points[:, 1] == 0.0) & self.mirrored)

    @cached_property
    def outside(self) -> Boundary:
        """Γ_ext, where the pressure must not leak: by default all the surface that is not one of the other three."""
        others = np.concatenate([self.fixed.facets, self.tip.facets, self.symmetry.facets])
        return Boundary(self.mesh, self._boundary_facets[~np.isin(self._boundary_facets, others)])

    @cached_property
    def tip_cells(self) -> Ints:
        """Cells that touch Γ, by a facet, an edge or a vertex, (n,), ascending: all that pulls at the arm."""
        return np.flatnonzero(np.isin(self.cells, self.tip.vertices).any(axis=1))

    # --------------------------------------------------------------------------------- functions of the place

    @abstractmethod
    def inlet(self, points: Floats) -> Floats:
        """Profile of the pressure source, Eq. (18): 1 where the air comes in, falling to 0; times 100 Q_s it is Q_in.

        Args:
            points: (..., 3), mm.

        Returns:
            Dimensionless, (...).
        """

    def profiles(self, points: Floats) -> Floats:
        """:meth:`inlet` of every chamber, (n_chambers, ...); a domain by itself has one."""
        return self.inlet(points)[None]

    @abstractmethod
    def passive_bound(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """Upper bound of χ in C_χ, Eq. (21): below zero where there must be void, to keep the inlet free.

        Args:
            points: (..., 3), mm.
            interface_width: L_i, mm; χ changes by at most 8 / L_i per mm.
            length_unit: what the paper calls 1 mm; the numbers of its equation have units, mm.

        Returns:
            Dimensionless, (...).
        """

    @abstractmethod
    def initial_design(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """χ at t = 0, as in Eq. (22): a chamber around the inlet with walls that hold the air.

        Args:
            points: (..., 3), mm.
            interface_width: L_i, mm.
            length_unit: what the paper calls 1 mm, as in :meth:`passive_bound`.

        Returns:
            Dimensionless, (...).
        """

    # -------------------------------------------------------------------------------------------- finer meshes

    @abstractmethod
    def refined(self, factor: int) -> Domain:
        """The same domain with ``factor`` times the cells in all three directions, and all vertices of this one.

        Raises:
            ValueError: if the factor is not positive.
        """

    def prolongation(self, factor: int) -> sp.csr_array:
        """Trilinear interpolation from the vertices of this mesh to those of :meth:`refined`.

        Shape (n_fine, n_coarse), rows sum to 1. This default looks every new vertex up in the cells. Where curved
        boundaries put new vertices outside of all cells a domain has to say which cell a vertex belongs to.
        """
        fine = self.refined(factor)
        weights = sp.csr_array(Basis(self.mesh, ElementHex1(), intorder=1).probes(np.ascontiguousarray(fine.mesh.p)))
        weights.data[np.abs(weights.data) < ROUNDING] = 0.0
        weights.eliminate_zeros()
        return weights

    # ----------------------------------------------------------------------------------------------- the solid

    def tetrahedra(self) -> Tetrahedra:
        """A conforming cut of the cells into tetrahedra, on which the surface of a design is extracted."""
        return pulled(self.points, self.cells)

    def outline(self) -> Floats:
        """Closed polygon around the section at X1 = 0 of what is modelled, (n, 2) as (X2, X3), mm: for figures.

        This default follows the sides of the fixed facets around a section that has no holes.
        """
        corners = self.mesh.facets[:, self.fixed.facets].T
        middle = self.points[corners, 1:].mean(axis=1, keepdims=True)
        ray = self.points[corners, 1:] - middle
        around = np.take_along_axis(corners, np.argsort(np.arctan2(ray[..., 1], ray[..., 0]), axis=1), axis=1)
        sides = np.stack([around, np.roll(around, -1, axis=1)], axis=-1).reshape(-1, 2)
        # A side inside the section is passed twice, once in each direction.
        _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
        following = dict(sides[first[count == 1]].tolist())
        at = next(iter(following))
        ring = [at]
        while (at := following[at]) != ring[0]:
            ring.append(at)
        return self.points[ring, 1:]
