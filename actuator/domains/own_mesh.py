"""A design domain on any mesh of 8-node hexahedra, whose boundaries and inlet are given with it.

Nothing is known of such a mesh but its cells: each is a class of its own, with shape functions of its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from skfem import MeshHex

from actuator.arrays import Bools, Floats, Ints
from actuator.domains import channel
from actuator.domains.interface import HEX_OFFSETS, Boundary, Domain, Parameter
from actuator.failure import InvalidSettings

if TYPE_CHECKING:
    import pyvista

#: How far, over the size of the domain, vertices may lie off the planes of the fixed face, the tip and the symmetry,
#: and how near each other they count as one: files may have no more than six digits.
FLAT = 1e-5
#: Most cells or vertices that a sentence names.
NAMED = 5
#: Places along the inlet's axis where its distance from the wall is measured.
ALONG = 33


class Unusable(ValueError):
    """A mesh cannot be a design domain; the text is the end of a sentence that begins with the mesh."""


@dataclass(frozen=True, eq=False)
class OwnMesh(Domain):
    """A mesh with boundaries by name; :func:`checked` makes one of what a file holds.

    Args:
        vertices: (n, 3), mm.
        hexahedra: (m, 8), in scikit-fem's local order, right-handed.
        fixed_facets, tip_facets, symmetry_facets, outside_facets: by their vertices, (k, 4); no symmetry: the whole.
        inlet_places: where the air comes in, (k, 3), mm; none for a channel along X1.
        inlet_width: of the zone around these in which the source falls to zero, mm.
        inlet_height: X3 of the channel's axis, mm.
        radius: of an outer wall that is round about the axis X1, mm; 0 for any other wall.
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
    def length(self) -> float:  # type: ignore[override]  # found, not given
        """L, mm."""
        return float(self.vertices[:, 0].max())

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
        return Boundary(self.mesh, _numbered(self.mesh, facets))

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
            return channel.inlet(self._radii(points), self._reach)
        ramp = np.minimum(1.0, self._radii(points) / self.inlet_width)
        return np.asarray(1.0 - np.sin(0.5 * np.pi * ramp) ** 2)

    def passive_bound(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """The bound on χ in C_χ of Eq. (21), (...)."""
        radii, depth, reach = self._distances(points, length_unit)
        return channel.passive_bound(radii, depth, reach, interface_width / length_unit)

    def initial_design(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """χ at t = 0, Eq. (22): a wall from 0.05 R to 0.55 R below the outside, a little thinner for X3 > 0; (...)."""
        radii, depth, reach = self._distances(points, length_unit)
        wall = depth - (1.0 - channel.OUTER) * reach, (1.0 - channel.INNER) * reach - depth
        height, width = points[..., 2] / length_unit, interface_width / length_unit
        return channel.initial_design(radii, depth, wall, height, reach, width)

    def _distances(self, points: Floats, unit: float) -> tuple[Floats, Floats, float]:
        """Those that Eqs. (21) and (22) are about: r, R - r and R, in a length unit."""
        radii, reach = self._radii(points), self._reach
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
    def _reach(self) -> float:
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
        around = _around(self.mesh.facets[:, facets].T, self.vertices)
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


def checked(
    vertices: Floats,
    hexahedra: Ints,
    sets: Mapping[str, Ints],
    *,
    length: float | None = None,
    radius: float = 0.0,
    inlet_height: float = 0.0,
) -> OwnMesh:
    """The domain that a mesh with named sets is.

    Args:
        vertices: (n, 3), in any unit if the length is given, else mm.
        hexahedra: (m, 8), in scikit-fem's local order.
        sets: by their names ``fixed``, ``tip``, ``symmetry``, ``outside`` and ``inlet``: facets by their vertices
            (k, 4), or vertices (k,). Without ``outside`` it is the rest; without ``symmetry`` the mesh is the whole;
            without ``inlet`` the air comes in along an axis.
        length: L, mm, to which the mesh is scaled.
        radius, inlet_height: see :class:`OwnMesh`, mm.

    Raises:
        Unusable: with what is wrong first.
    """
    size = float(np.ptp(vertices, axis=0).max())
    vertices = vertices + 0.0
    used = np.unique(hexahedra)
    if len(used) < len(vertices):
        raise Unusable(f"has {len(vertices) - len(used)} vertices of no cell; remove them")
    _refuse_together(vertices, size)
    _refuse_turned(vertices, hexahedra)
    mesh = MeshHex(np.ascontiguousarray(vertices.T), np.ascontiguousarray(hexahedra.T, dtype=np.int32))
    _refuse_apart(mesh, vertices, size)
    boundary = mesh.boundary_facets()
    found: dict[str, Ints] = {}
    for name in ("fixed", "tip", "symmetry", "outside"):
        if name in sets:
            found[name] = _on_surface(name, sets[name], mesh, boundary)
        elif name in ("fixed", "tip"):
            raise Unusable(f"has no set '{name}' but {_listed(sorted(sets)) or 'none at all'}; name the facets so")
    found.setdefault("symmetry", np.zeros(0, np.int64))
    given = np.concatenate([found["fixed"], found["tip"], found["symmetry"]])
    found.setdefault("outside", np.setdiff1d(boundary, given))
    every = np.concatenate([given, found["outside"]])
    if len(np.unique(every)) < len(every):
        raise Unusable("has facets in two of the sets fixed, tip, symmetry and outside; leave each in one of them")
    if not len(found["outside"]):
        raise Unusable("has no facet outside, where air could leak; check the sets")
    scale = 1.0 if length is None else length / float(np.ptp(vertices[:, 0]))
    planes = {"fixed": (0, 0.0), "tip": (0, float(vertices[:, 0].max())), "symmetry": (1, 0.0)}
    for name, (axis, at) in planes.items():
        corners = np.unique(mesh.facets[:, found[name]])
        off = np.abs(vertices[corners, axis] - at)
        if len(corners) and off.max() > FLAT * size:
            raise Unusable(
                f"has a vertex of '{name}', number {corners[off.argmax()] + 1}, {off.max():.3g} off the plane "
                f"X{axis + 1} = {at:g}; put all of the set there"
            )
        vertices[corners, axis] = at
    if len(found["symmetry"]) and vertices[:, 1].min() < 0.0:
        raise Unusable("has a set 'symmetry' and vertices at X2 < 0; keep the half X2 >= 0, or leave that set out")
    vertices *= scale
    inlet, width = np.zeros((0, 3)), 0.0
    if "inlet" in sets:
        numbers = np.unique(sets["inlet"])
        if not numbers.size:
            raise Unusable("has an empty set 'inlet'; fill it, or leave it out for a channel along X1")
        inlet = vertices[numbers]
        ends = vertices[mesh.edges[:, np.isin(mesh.edges, numbers).any(axis=0)]]
        width = float(np.linalg.norm(ends[0] - ends[1], axis=1).max())
    facets = {f"{name}_facets": mesh.facets[:, numbers].T.astype(np.int64) for name, numbers in found.items()}
    domain = OwnMesh(
        vertices,
        hexahedra.astype(np.int64),
        **facets,
        inlet_places=inlet,
        inlet_width=width,
        inlet_height=inlet_height,
        radius=radius,
    )
    if not (domain.inlet(vertices) > 0.0).any():
        raise Unusable("has no vertex in its inlet; name the cells in a set 'inlet', or move inlet_height")
    if domain._reach <= FLAT * domain.size:
        raise Unusable("has an inlet that touches the outside, where the air would leak; keep it inside")
    return domain


# ----------------------------------------------------------------------------------------------------------- checks


def _refuse_together(vertices: Floats, size: float) -> None:
    pairs = cKDTree(vertices).query_pairs(FLAT * size, output_type="ndarray")
    if len(pairs):
        one, other = pairs[0] + 1
        raise Unusable(f"has {len(pairs)} pairs of vertices in one place, {one} and {other} first; merge them")


def _refuse_turned(vertices: Floats, hexahedra: Ints) -> None:
    """Jacobians at the corners are products of the three edges that meet there."""
    corner = vertices[hexahedra]
    lowest = np.full(len(hexahedra), np.inf)
    for at, offsets in enumerate(HEX_OFFSETS):
        edges = []
        for axis in range(3):
            neighbour = offsets.copy()
            neighbour[axis] = 1 - offsets[axis]
            other = int(np.flatnonzero((neighbour == HEX_OFFSETS).all(axis=1))[0])
            edges.append((corner[:, other] - corner[:, at]) * (1 - 2 * offsets[axis]))
        lowest = np.minimum(lowest, np.einsum("ij,ij->i", np.cross(edges[0], edges[1]), edges[2]))
    bad = np.flatnonzero(lowest <= 0.0)
    if bad.size:
        which = _listed([str(number + 1) for number in bad])
        raise Unusable(
            f"has {bad.size} of {len(hexahedra)} cells that are left-handed, twisted or flat, {which}; mend them, or "
            "exchange their lower and upper four vertices if they are left-handed"
        )


def _refuse_apart(mesh: MeshHex, vertices: Floats, size: float) -> None:
    """Cells must share whole facets, and hang together by them."""
    sides = np.sort(mesh.t[np.array(mesh.refdom.facets)], axis=1)
    _, times = np.unique(sides.transpose(0, 2, 1).reshape(-1, 4), axis=0, return_counts=True)
    if times.max() > 2:
        raise Unusable("has a facet that more than two cells share; mend the mesh")
    boundary = mesh.boundary_facets()
    around = _around(mesh.facets[:, boundary].T, vertices)
    corners = np.unique(around)
    tree = cKDTree(vertices[corners])
    places = vertices[around]  # (k, 4, 3)
    middle = places.mean(axis=1)
    reach = np.linalg.norm(places - middle[:, None], axis=2).max(axis=1)
    for facet, near in enumerate(tree.query_ball_point(middle, (1.0 + FLAT) * reach)):
        others = np.setdiff1d(corners[near], around[facet])
        if len(others) and (hanging := others[_on_facet(places[facet], vertices[others], FLAT * size)]).size:
            raise Unusable(
                f"has a hanging vertex, number {hanging[0] + 1}, on another cell's facet; every facet must be that "
                "of two cells or of the surface"
            )
    first, second = mesh.f2t[:, mesh.f2t[1] >= 0]
    graph = sp.coo_array((np.ones(len(first)), (first, second)), (mesh.nelements, mesh.nelements))
    pieces, _ = connected_components(graph, directed=False)
    if pieces > 1:
        raise Unusable(f"has {pieces} pieces that share no facets; join them, or leave one")


def _on_facet(quad: Floats, places: Floats, near: float) -> Bools:
    """Which places lie on a quadrilateral, (n,), by its two triangles."""
    found = np.zeros(len(places), dtype=bool)
    for triangle in (quad[[0, 1, 2]], quad[[0, 2, 3]]):
        edges = triangle[1:] - triangle[0]
        normal = np.cross(*edges)
        area = np.linalg.norm(normal)
        off = np.abs((places - triangle[0]) @ normal) / area
        shares = np.linalg.lstsq(edges.T, (places - triangle[0]).T, rcond=None)[0]
        found |= (off < near) & (shares > -FLAT).all(axis=0) & (shares.sum(axis=0) < 1.0 + FLAT)
    return found


def _on_surface(name: str, given: Ints, mesh: MeshHex, boundary: Ints) -> Ints:
    """Numbers of the facets of a set."""
    if given.ndim == 1:
        facets = boundary[np.isin(mesh.facets[:, boundary], given).all(axis=0)]
    else:
        facets = _numbered(mesh, given)
        if (facets < 0).any() or not np.isin(facets, boundary).all():
            raise Unusable(f"has a set '{name}' with facets that are not of the cells' surface; mend the set")
    if not len(facets):
        raise Unusable(f"has no whole facet of its surface in the set '{name}'; fill it, or leave it out")
    return np.unique(facets)


def _numbered(mesh: MeshHex, facets: Ints) -> Ints:
    """Numbers of facets given by their vertices, (k, 4); -1 for one that the mesh does not have."""
    known = {tuple(corners): number for number, corners in enumerate(np.sort(mesh.facets, axis=0).T.tolist())}
    return np.array([known.get(tuple(corners), -1) for corners in np.sort(facets, axis=1).tolist()], dtype=np.int64)


def _around(facets: Ints, vertices: Floats) -> Ints:
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


def _listed(names: list[str]) -> str:
    return ", ".join(names[:NAMED]) + (", …" if len(names) > NAMED else "")
