"""Whether a mesh of 8-node hexahedra with named sets can be a design domain, and the domain that it is."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree
from skfem import MeshHex

from actuator.arrays import Bools, Floats, Ints
from actuator.domains.interface import HEX_OFFSETS
from actuator.domains.own_mesh import OwnMesh, around_facets, numbered

#: How far, over the size of the domain, vertices may lie off the planes of the fixed face, the tip and the symmetry,
#: and how near each other they count as one: files may have no more than six digits.
FLAT = 1e-5
#: Most cells or vertices that a sentence names.
NAMED = 5


class Unusable(ValueError):
    """A mesh cannot be a design domain; the text is the end of a sentence that begins with the mesh."""


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
    if domain.reach <= FLAT * domain.size:
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
    around = around_facets(mesh.facets[:, boundary].T, vertices)
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
        facets = numbered(mesh, given)
        if (facets < 0).any() or not np.isin(facets, boundary).all():
            raise Unusable(f"has a set '{name}' with facets that are not of the cells' surface; mend the set")
    if not len(facets):
        raise Unusable(f"has no whole facet of its surface in the set '{name}'; fill it, or leave it out")
    return np.unique(facets)


def _listed(names: list[str]) -> str:
    return ", ".join(names[:NAMED]) + (", …" if len(names) > NAMED else "")
