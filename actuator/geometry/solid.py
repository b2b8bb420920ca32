"""The proof, and if need be the repair, that triangles bound a solid also after rounding to the float32 of a file.

manifold3d (Lalish, github.com/elalish/manifold) decides whether the triangles are an oriented 2-manifold and collapses
what is too short to survive rounding.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from manifold3d import Error, Manifold, Mesh64
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from actuator.arrays import Floats, Ints
from actuator.failure import EmptySolid, InvalidField, NotManifold
from actuator.geometry.zero_set import Surface

#: Tolerances tried for a repair, as fractions of the largest coordinate; float32 resolves 6e-8 of it.
REPAIR_TOLERANCES = (1.0e-6, 1.0e-5, 1.0e-4)


@dataclass(frozen=True)
class Proof:
    """A solid proved by manifold3d, and what that took.

    Attributes:
        surface: closed, oriented 2-manifold; coordinates are exact in float32.
        status: verdict of manifold3d on the rounded input, ``NoError`` if it needed no repair.
        vertices_removed, triangles_removed: input minus output.
        repair_tolerance: mm within which the surface was moved; 0 without a repair.
        genus: handles, summed over all components.
    """

    surface: Surface
    status: str
    vertices_removed: int
    triangles_removed: int
    repair_tolerance: float
    genus: int


def prove_solid(vertices: Floats, triangles: Ints) -> Proof:
    """Prove that the triangles bound a solid, and repair them where they do not.

    The input is rounded to float32 and vertices that coincide are merged, as a reader of the file will do. If that is
    no 2-manifold, the unrounded input is simplified, and touching sheets are pulled apart, by growing distances.

    Args:
        vertices: (n, 3), mm.
        triangles: (m, 3), counter-clockwise seen from outside.

    Raises:
        InvalidField: if a coordinate is not finite.
        EmptySolid: if there is no triangle.
        NotManifold: if there is no repair, or the solid is inside out.
    """
    if not np.isfinite(vertices).all():
        raise InvalidField("The surface has coordinates that are not finite; repeat the stage that extracted it.")
    if not len(triangles):
        raise EmptySolid("The surface has no triangles; extract it from a design with material.")
    largest = float(np.abs(vertices).max())
    exact = rounded(vertices, triangles)
    solid = manifold_of(exact)
    status = solid.status().name if is_two_manifold(exact.triangles) else Error.NotManifold.name
    tolerance = 0.0
    if status != Error.NoError.name:
        exact, tolerance = _repaired(vertices, triangles, largest)
        solid = manifold_of(exact)
    if not solid.volume() > 0.0:
        raise NotManifold("The surface encloses no positive volume; turn its triangles around.")
    surface = surface_of(solid)
    genus = sum(part.genus() for part in solid.decompose())
    removed = len(vertices) - len(surface.vertices), len(triangles) - len(surface.triangles)
    return Proof(surface, status, *removed, tolerance, genus)


def rounded(vertices: Floats, triangles: Ints) -> Surface:
    """The surface as a reader of a float32 file sees it: equal vertices merged, collapsed triangles dropped."""
    single = vertices.astype(np.float32) + np.float32(0.0)  # makes -0 and 0 the same
    first, number = _equal_rows(single)
    merged = number[triangles]
    collapsed = (merged == np.roll(merged, 1, axis=1)).any(axis=1)
    return Surface(single[first].astype(np.float64), merged[~collapsed])


def is_two_manifold(triangles: Ints) -> bool:
    """Whether every edge has two triangles that agree on orientation, and every vertex one ring of triangles."""
    corner = np.arange(triangles.size).reshape(-1, 3)
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    size = int(triangles.max(initial=0)) + 1
    forward, backward = start * size + end, end * size + start
    order, opposite = np.argsort(forward), np.argsort(backward)
    forward, backward = forward[order], backward[opposite]
    if np.any(forward[1:] == forward[:-1]) or not np.array_equal(forward, backward):
        return False
    # Corners at the same vertex are neighbours if their triangles share an edge from that vertex: the corner that the
    # half edge leaves from, and the corner after the opposite half edge.
    following = np.roll(corner, -1, axis=1).ravel()
    graph = coo_array((np.ones(len(order), dtype=bool), (order, following[opposite])), (triangles.size,) * 2)
    rings, _ = connected_components(graph, directed=False)
    return bool(rings == len(np.unique(triangles)))


def component_volumes(surface: Surface) -> Floats:
    """Signed volume of every connected component, mm³, largest first; that of an enclosed cavity is negative."""
    _, labels = np.unique(component_labels(surface)[surface.triangles[:, 0]], return_inverse=True)
    return np.sort(signed_volumes(surface, labels))[::-1]


def component_labels(surface: Surface) -> Ints:
    """Number of the connected component of every vertex, (n,), from 0."""
    t, n = surface.triangles, len(surface.vertices)
    edges = (np.concatenate([t[:, 0], t[:, 1]]), np.concatenate([t[:, 1], t[:, 2]]))
    ones = np.ones(len(edges[0]), dtype=bool)
    _, label = connected_components(coo_array((ones, edges), (n, n)), directed=False)
    return np.asarray(label, dtype=np.int64)


def signed_volumes(surface: Surface, labels: Ints) -> Floats:
    """Signed volume of every group of triangles, mm³, by its label; (largest label + 1,)."""
    corner = surface.vertices[surface.triangles] - surface.vertices.mean(axis=0)
    volume = np.einsum("ij,ij->i", corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) / 6.0
    return np.asarray(np.bincount(labels, volume), dtype=np.float64)


def _equal_rows(points: NDArray[np.float32]) -> tuple[Ints, Ints]:
    """First row of every group of equal rows, and the group of every row."""
    # np.unique(axis=0) compares rows as bytes, which is several times slower than two sorts of packed integers.
    bits = np.ascontiguousarray(points).view(np.uint32).astype(np.uint64)
    _, pair = np.unique(bits[:, 0] << np.uint64(32) | bits[:, 1], return_inverse=True)
    _, first, group = np.unique(
        pair.astype(np.uint64) << np.uint64(32) | bits[:, 2], return_index=True, return_inverse=True
    )
    return first, group


def _repaired(vertices: Floats, triangles: Ints, largest: float) -> tuple[Surface, float]:
    start = Surface(vertices, triangles)
    for fraction in REPAIR_TOLERANCES:
        solid = manifold_of(start, fraction * largest)
        if solid.status() != Error.NoError or solid.is_empty():
            continue
        simplified = surface_of(solid.simplify(fraction * largest))
        apart = _pulled_apart(simplified, fraction * largest)
        exact = rounded(apart.vertices, apart.triangles)
        if len(exact.triangles) and is_two_manifold(exact.triangles) and manifold_of(exact).status() == Error.NoError:
            return exact, fraction * largest
    raise NotManifold(
        f"The {len(triangles)} triangles bound no solid and could not be repaired within "
        f"{REPAIR_TOLERANCES[-1] * largest:.2g} mm; mend it where it was made, "
        "a design of poro's own by a finer or smoother field (refine.factor)."
    )


def _pulled_apart(surface: Surface, distance: float) -> Surface:
    """Move vertices that coincide in float32 towards the mean of their neighbours, so that touching sheets separate."""
    vertices = surface.vertices.copy()
    _, number = _equal_rows(vertices.astype(np.float32) + np.float32(0.0))
    touching = np.bincount(number)[number] > 1
    start, end = surface.triangles.ravel(), np.roll(surface.triangles, -1, axis=1).ravel()
    neighbours = csr_array((np.ones(len(start)), (start, end)), (len(vertices),) * 2)
    valence = np.bincount(start, minlength=len(vertices))
    mean = np.asarray(neighbours @ vertices) / np.maximum(valence, 1)[:, None]
    inward = mean[touching] - vertices[touching]
    length = np.linalg.norm(inward, axis=1, keepdims=True)
    vertices[touching] += inward * np.minimum(0.5, distance / np.maximum(length, np.finfo(float).tiny))
    return Surface(vertices, surface.triangles)


def surface_of(solid: Manifold) -> Surface:
    """The surface of a solid of manifold3d."""
    mesh = solid.to_mesh64()
    return Surface(np.array(mesh.vert_properties[:, :3]), np.array(mesh.tri_verts, dtype=np.int64))


def manifold_of(surface: Surface, tolerance: float = 0.0) -> Manifold:
    """A solid of manifold3d; with a tolerance (mm), vertices that are so near are merged along open edges."""
    mesh = Mesh64(
        np.ascontiguousarray(surface.vertices), surface.triangles.astype(np.uint64, order="C"), tolerance=tolerance
    )
    if tolerance:
        mesh.merge()
    return Manifold(mesh)
