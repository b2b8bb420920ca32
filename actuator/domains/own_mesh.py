"""A design domain on any mesh of 8-node hexahedra, whose boundaries and inlet are given with it.

Nothing is known of such a mesh but its cells: each is a class of its own, with shape functions of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from skfem import MeshHex

from actuator.arrays import Floats, Ints
from actuator.domains import channel
from actuator.domains.interface import Boundary, Parameter
from actuator.failure import InvalidSettings

if TYPE_CHECKING:
    import pyvista

#: Places along the inlet's axis where its distance from the wall is measured.
ALONG = 33


@dataclass(frozen=True, eq=False)
class OwnMesh(channel.ByDepth):
    """A mesh with boundaries by name; :func:`actuator.domains.own_mesh_checks.checked` makes one of what a file holds.

    Args:
        vertices: (n, 3), mm.
        hexahedra: (m, 8), in scikit-fem's local order, right-handed.
        fixed_facets, tip_facets, symmetry_facets, outside_facets: by their vertices, (k, 4); no symmetry: the whole.
        inlet_places: where the air comes in, (k, 3), mm; none for a channel along X1.
        inlet_width: of the zone around these in which the source falls to zero, mm.
        inlet_height: X3 of the channel's axis, mm.
        radius: of an outer wall that is round about the axis X1, mm; 0 for any other wall.

    Attributes:
        length: L, mm, that of the vertices.
    """

    shape: ClassVar[str] = "mesh"

    vertices: Floats
    hexahedra: Ints
    fixed_facets: Ints
    tip_facets: Ints
    symmetry_facets: Ints
    outside_facets: Ints
    inlet_places: Floats
    inlet_width: float
    inlet_height: float
    radius: float
    length: float = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", float(self.vertices[:, 0].max()))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, OwnMesh):
            return NotImplemented
        mine, others = self.parameters, other.parameters
        return all(np.array_equal(mine[name].value, others[name].value) for name in mine)

    def __hash__(self) -> int:
        return hash((self.vertices.tobytes(), self.hexahedra.tobytes()))

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """All of the mesh."""
        meanings = {
            "vertices": ("mm", "vertices of the mesh"),
            "hexahedra": ("1", "vertices of its cells, in scikit-fem's order"),
            "fixed_facets": ("1", "vertices of the facets that are held"),
            "tip_facets": ("1", "vertices of the facets that move with the arm"),
            "symmetry_facets": ("1", "vertices of the facets on the symmetry plane"),
            "outside_facets": ("1", "vertices of the facets where the air must not leak"),
            "inlet_places": ("mm", "where the air comes in; none for a channel along X1"),
            "inlet_width": ("mm", "width of the zone around these in which the source falls to zero"),
            "inlet_height": ("mm", "X3 of the channel's axis"),
            "radius": ("mm", "radius of a round outer wall; 0 for any other"),
        }
        return {name: Parameter(getattr(self, name), *what) for name, what in meanings.items()}

    @cached_property
    def size(self) -> float:
        """Half the height along X3, mm."""
        return 0.5 * float(np.ptp(self.vertices[:, 2]))

    @property
    def mirrored(self) -> bool:
        """Whether the mesh has a symmetry plane."""
        return len(self.symmetry_facets) > 0

    @cached_property
    def mesh(self) -> MeshHex:
        """The mesh, its vertices and cells numbered as they were given."""
        return MeshHex(np.ascontiguousarray(self.vertices.T), np.ascontiguousarray(self.hexahedra.T, dtype=np.int32))

    @cached_property
    def fixed(self) -> Boundary:
        """Where the displacement is zero."""
        return self._boundary(self.fixed_facets)

    @cached_property
    def tip(self) -> Boundary:
        """Γ, which moves with the arm."""
        return self._boundary(self.tip_facets)

    @cached_property
    def symmetry(self) -> Boundary:
        """Facets on the plane X2 = 0, where u2 = 0."""
        return self._boundary(self.symmetry_facets)

    @cached_property
    def outside(self) -> Boundary:
        """Γ_ext, where the pressure must not leak."""
        return self._boundary(self.outside_facets)

    def _boundary(self, facets: Ints) -> Boundary:
        return Boundary(self.mesh, numbered(self.mesh, facets))

    def scaled(self, factor: float) -> OwnMesh:
        """The same mesh, its lengths multiplied by a factor."""
        if factor == 1.0:
            return self
        lengths = ("vertices", "inlet_places", "inlet_width", "inlet_height", "radius")
        return replace(self, **{name: factor * getattr(self, name) for name in lengths})

    # -------------------------------------------------------------------------------------- functions of the place

    def inlet(self, points: Floats) -> Floats:
        """Profile of Eq. (18) around the channel's axis, or 1 at the inlet's places, falling to 0; (...)."""
        if not len(self.inlet_places):
            return channel.inlet(self._radii(points), self.reach)
        ramp = np.minimum(1.0, self._radii(points) / self.inlet_width)
        return np.asarray(1.0 - np.sin(0.5 * np.pi * ramp) ** 2)

    def _distances(self, points: Floats, unit: float) -> tuple[Floats, Floats, float]:
        """Those that Eqs. (21) and (22) are about: r, R - r and R, in a length unit."""
        radii, reach = self._radii(points), self.reach
        if len(self.inlet_places):
            # Where the source falls to zero r is as in the paper, so that the free zone is as much wider.
            radii = radii - self.inlet_width + channel.NONE * reach
        return radii / unit, self._depth(points) / unit, reach / unit

    def _radii(self, points: Floats) -> Floats:
        """Distance from the channel's axis or from the nearest of the inlet's places, mm, (...)."""
        if not len(self.inlet_places):
            return np.asarray(np.hypot(points[..., 1], points[..., 2] - self.inlet_height))
        distance, _ = cKDTree(self.inlet_places).query(_folded(points, self.mirrored))
        return np.asarray(distance)

    @cached_property
    def reach(self) -> float:
        """The R of Eqs. (18), (21) and (22): the distance of the inlet from the outside, mm."""
        if self.radius:
            return self.radius
        places = self.inlet_places
        if not len(places):
            places = np.zeros((ALONG, 3))
            places[:, 0], places[:, 2] = np.linspace(0.0, self.length, ALONG), self.inlet_height
        return float(self._depth(places).min())

    def _depth(self, points: Floats) -> Floats:
        """Distance from the outside, mm, (...)."""
        if self.radius:
            return self.radius - np.asarray(np.hypot(points[..., 1], points[..., 2]))
        places = _folded(points, self.mirrored).reshape(-1, 3)
        _, nearest = self._wall.find_closest_cell(places, return_closest_point=True)
        return np.linalg.norm(places - nearest, axis=1).reshape(points.shape[:-1])

    @cached_property
    def _wall(self) -> pyvista.PolyData:
        import pyvista  # slow to load

        facets = self.outside.facets
        around = around_facets(self.mesh.facets[:, facets].T, self.vertices)
        triangles = np.concatenate([around[:, [0, 1, 2]], around[:, [0, 2, 3]]])
        return pyvista.PolyData.from_regular_faces(self.vertices, triangles)

    # ------------------------------------------------------------------------------------------------ finer meshes

    def refined(self, factor: int) -> OwnMesh:
        """Each cell divided into 8 by the middles of its edges, facets and volume, once for every factor of two.

        Raises:
            actuator.failure.InvalidSettings: if the factor is no power of two.
        """
        halvings = factor.bit_length() - 1
        if factor < 1 or factor != 1 << halvings:
            raise InvalidSettings(f"An own mesh is refined by 1, 2, 4 or 8, not by {factor}; change refine.factor.")
        return self._halved.refined(factor // 2) if halvings else self

    @cached_property
    def _halved(self) -> OwnMesh:
        coarse = self.mesh
        fine = coarse.refined()
        boundary = fine.boundary_facets()
        corners = fine.facets[:, boundary]
        # Each new facet has one corner in the middle of the facet that it is a quarter of.
        parent = corners.max(axis=0) - coarse.nvertices - coarse.nedges
        found = {
            f"{name}_facets": corners[:, np.isin(parent, getattr(self, name).facets)].T.astype(np.int64)
            for name in ("fixed", "tip", "symmetry", "outside")
        }
        rest = {name: getattr(self, name) for name in ("inlet_places", "inlet_width", "inlet_height", "radius")}
        return OwnMesh(np.ascontiguousarray(fine.p.T), fine.t.T.astype(np.int64), **found, **rest)

    def prolongation(self, factor: int) -> sp.csr_array:
        """Means over the edges, facets and cells in whose middles the new vertices lie; rows sum to 1."""
        if factor == 1:
            return sp.eye_array(len(self.vertices), format="csr")
        mesh = self.mesh
        groups = (np.arange(mesh.nvertices)[None], mesh.edges, mesh.facets, mesh.t)
        weights = sp.vstack([_means(group.T, mesh.nvertices) for group in groups], format="csr")
        return weights if factor == 2 else sp.csr_array(self._halved.prolongation(factor // 2) @ weights)


def numbered(mesh: MeshHex, facets: Ints) -> Ints:
    """Numbers of facets given by their vertices, (k, 4); -1 for one that the mesh does not have."""
    known = {tuple(corners): number for number, corners in enumerate(np.sort(mesh.facets, axis=0).T.tolist())}
    return np.array([known.get(tuple(corners), -1) for corners in np.sort(facets, axis=1).tolist()], dtype=np.int64)


def around_facets(facets: Ints, vertices: Floats) -> Ints:
    """Vertices of facets, (k, 4), in an order that goes around each of them."""
    corner = vertices[facets]
    diagonals = (((0, 1), (2, 3)), ((0, 2), (1, 3)), ((0, 3), (1, 2)))
    # The two diagonals cross: their middles are nearer each other than those of opposite sides.
    middles = [[corner[:, list(ends)].mean(axis=1) for ends in pair] for pair in diagonals]
    apart = np.stack([np.linalg.norm(one - other, axis=1) for one, other in middles])
    orders = np.array([[a[0], b[0], a[1], b[1]] for a, b in diagonals])
    return np.take_along_axis(facets, orders[apart.argmin(axis=0)], axis=1)


def _means(groups: Ints, n: int) -> sp.csr_array:
    """Mean over groups of vertices, (k, size), as a matrix (k, n)."""
    count, size = groups.shape
    rows = np.repeat(np.arange(count), size)
    return sp.csr_array((np.full(groups.size, 1.0 / size), (rows, groups.ravel())), (count, n))


def _folded(points: Floats, mirrored: bool) -> Floats:
    """Places on the modelled side of the symmetry plane."""
    return points * np.where(points[..., 1:2] < 0.0, (1.0, -1.0, 1.0), 1.0) if mirrored else points
