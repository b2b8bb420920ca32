"""Body-fitted tetrahedra of a solid between plates, by Mmg (Dapogny, Dobrzynski & Frey 2014).

The distance to the solid's sides is a level set on a regular grid of tetrahedra whose outer planes are those of the
plates and, for a symmetric solid, of symmetry; doi:10.1016/j.jcp.2014.01.005. Mmg cuts the grid at the level set, and
improves the part inside.
"""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from actuator.arrays import Bools, Floats, Ints
from actuator.body.element import least_jacobian
from actuator.body.mesh import EDGES, BodyMesh, Tetrahedra, boundary_faces, on_plane, quadratic, signed_volumes
from actuator.body.plates import Glued
from actuator.failure import InvalidSettings, NotInflatable
from actuator.geometry.distance import distance, signed_distance
from actuator.geometry.zero_set import Surface

if TYPE_CHECKING:
    from mmgpy import MmgMesh3D

#: Edge of the grid's cubes over the size of the tetrahedra.
GRID = 0.4
#: Values of the level set that count as zero, over the edge of the cubes, so that no slivers are cut off.
ZERO = 0.05
#: Mmg's largest distance of the boundary from the level set, over the size, and its ratio of neighbouring edges.
CHORD, GRADATION = 0.1, 1.5
#: Least edge over the size.
SHORTEST = 0.2
#: How far the solid's vertices may lie off the mesh, over the size, before the mesh is too coarse for it; and how much
#: of its boundary may be taken for the wrong side.
MOST_OFF, MOST_MISTAKEN = 0.5, 0.02
#: Share of its volume by which a mesh may differ from the solid.
MOST_LOST = 0.1
#: How far nodes of a plane may lie off it, over the size; they are then put onto it.
FLAT = 1e-6
#: Least det ∂X/∂λ over its mean in a cell with curved edges, and how often distorted cells get their vertices back.
LEAST_JACOBIAN, MOST_RETREATS = 0.2, 5
#: Number of the sides, by which Mmg keeps them apart from the planes, which count from 1.
_SIDES = 10


def mesh_of(solid: Glued, size: float, *, half: bool | None = None) -> BodyMesh:
    """A body-fitted mesh of 10-node tetrahedra.

    Args:
        solid: as it is glued.
        size: largest edge, mm.
        half: whether the half X2 >= 0 is meshed; if the solid is symmetric, where None.

    Raises:
        NotInflatable: if the mesh is too coarse to show the solid.
    """
    half = solid.symmetric if half is None else half
    grid = _grid(solid, GRID * size, half)
    level = signed_distance(grid.points, _sides_beyond_plates(solid))
    level[np.abs(level) < ZERO * GRID * size] = 0.0
    inside = _cut(grid, level, size)
    planes = ((0, 0.0), (0, solid.length), (1, 0.0))[: 3 if half else 2]
    tetrahedra = _improved(inside, planes, size)
    return _named(tetrahedra, solid, planes, size, half)


def _grid(solid: Glued, edge: float, half: bool) -> Tetrahedra:
    """Cubes of six tetrahedra each, with the same diagonals throughout (Kuhn 1960)."""
    low, high = solid.surface.vertices.min(axis=0) - edge, solid.surface.vertices.max(axis=0) + edge
    low[0], high[0] = 0.0, solid.length
    if half:
        low[1] = 0.0
    counts = np.maximum(np.ceil((high - low) / edge).astype(np.int64), 1)
    lines = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, counts, strict=True)]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape(counts + 1)
    first = numbers[:-1, :-1, :-1].ravel()
    steps = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    corners = []
    for way in permutations(range(3)):
        path = np.stack([first + steps[list(way[:k])].sum(dtype=np.int64) for k in range(4)], axis=1)
        odd = np.linalg.det(np.eye(3)[list(way)]) < 0.0
        corners.append(path[:, [0, 1, 3, 2]] if odd else path)
    return Tetrahedra(points, np.concatenate(corners))


def _sides_beyond_plates(solid: Glued) -> Surface:
    """The sides, continued beyond the plates by their mirror images: near a plate its face must not count."""
    vertices, triangles = solid.surface.vertices, solid.surface.triangles
    below, beyond = vertices * [-1.0, 1.0, 1.0], [2.0 * solid.length, 0.0, 0.0] + vertices * [-1.0, 1.0, 1.0]
    sides = triangles[~(solid.at_fixed | solid.at_arm)]
    n, turned = len(vertices), sides[:, ::-1]
    ends = (triangles[solid.at_arm][:, ::-1] + n, triangles[solid.at_fixed][:, ::-1] + 2 * n)
    every = np.concatenate([sides, turned + n, turned + 2 * n, *ends])
    points = np.concatenate([vertices, below, beyond])
    # Where both copies have a vertex, on the plane of a plate, they share it.
    _, first, number = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    return Surface(points[first], number[every])


def _cut(grid: Tetrahedra, level: Floats, size: float) -> Tetrahedra:
    """The part of the grid where the level set is negative, cut at its zero set."""
    mesh = _mmg()(grid.points, grid.corners.astype(np.int32))
    still: dict[str, Any] = {"noinsert": 1, "noswap": 1, "nomove": 1, "nosurf": 1}
    mesh.remesh_levelset(level[:, None], hmin=1e-3 * size, hmax=10.0 * size, verbose=-1, **still)
    corners, side = mesh.get_tetrahedra_with_refs()
    inside = corners[side == 3]
    if not len(inside):
        raise NotInflatable("The solid is thinner than its mesh can show: choose a smaller size of the tetrahedra.")
    return _compact(mesh.get_vertices(), inside.astype(np.int64))


def _mmg() -> type[MmgMesh3D]:
    """Mmg's mesh, loaded only where something is meshed.

    Raises:
        InvalidSettings: if it is not installed.
    """
    try:
        from mmgpy import MmgMesh3D
    except ImportError:
        raise InvalidSettings(
            "The mesher of parts, mmgpy, is not installed, as there is no package of it for some machines: leave the "
            "inflation out (--no-inflate), or install it."
        ) from None
    return MmgMesh3D


def _compact(points: Floats, corners: Ints) -> Tetrahedra:
    used, number = np.unique(corners, return_inverse=True)
    return Tetrahedra(points[used], number.reshape(corners.shape))


def _improved(inside: Tetrahedra, planes: tuple[tuple[int, float], ...], size: float) -> Tetrahedra:
    """Better tetrahedra of the same body; its planes stay planes."""
    mesh = _mmg()(inside.points, inside.corners.astype(np.int32))
    faces = boundary_faces(quadratic(inside)[1])[:, :3]
    side = np.full(len(faces), _SIDES, dtype=np.int64)
    for number, (axis, at) in enumerate(planes, start=1):
        side[on_plane(inside.points, faces, axis, at, FLAT * size)] = number
    mesh.set_mesh_size(vertices=len(inside.points), tetrahedra=len(inside.corners), triangles=len(faces))
    mesh.set_vertices(inside.points)
    mesh.set_tetrahedra(inside.corners.astype(np.int32))
    mesh.set_triangles(faces.astype(np.int32), side)
    mesh.remesh(hmax=size, hmin=SHORTEST * size, hausd=CHORD * size, hgrad=GRADATION, verbose=-1)
    points = mesh.get_vertices()
    corners, _ = mesh.get_tetrahedra_with_refs()
    return _compact(points, corners.astype(np.int64))


def _named(
    tetrahedra: Tetrahedra, solid: Glued, planes: tuple[tuple[int, float], ...], size: float, half: bool
) -> BodyMesh:
    points = tetrahedra.points.copy()
    for axis, at in planes:
        near = np.abs(points[:, axis] - at) < FLAT * size
        points[near, axis] = at
    nodes, cells = quadratic(Tetrahedra(points, tetrahedra.corners))
    if not (signed_volumes(points, tetrahedra.corners) > 0.0).all():
        raise NotInflatable("The mesh has cells that are inside out: choose another size of the tetrahedra.")
    faces = boundary_faces(cells)
    fixed, tip, *symmetry = (on_plane(nodes, faces, axis, at, 0.0) for axis, at in planes)
    on_symmetry = symmetry[0] if symmetry else np.zeros(len(faces), dtype=bool)
    sides = faces[~(fixed | tip | on_symmetry)]
    _check_volume(nodes, cells, solid, size, half)
    nodes = _fitted(nodes, cells, np.unique(sides), len(points), _sides_beyond_plates(solid), planes)
    _check_distance(nodes, sides, solid, size, half)
    wall = _pressed(nodes, sides, solid, size)
    return BodyMesh(
        nodes=nodes,
        cells=cells,
        vertices=len(points),
        walls=sides[wall],
        boundary=faces[~on_symmetry],
        fixed=np.unique(faces[fixed]),
        tip=np.unique(faces[tip]),
        symmetry=np.unique(faces[on_symmetry]),
        opening=opening_of(nodes, sides[wall], solid.length),
        length=solid.length,
        half=half,
    )


def _fitted(
    nodes: Floats, cells: Ints, sides: Ints, vertices: int, surface: Surface, planes: tuple[tuple[int, float], ...]
) -> Floats:
    """The nodes with those of the sides on the solid's surface, so that cells there have its curvature.

    Where a cell would be too distorted, its edges stay straight, or its vertices where Mmg has put them.
    """
    corner, middle = sides[sides < vertices], sides[sides >= vertices]
    moved = nodes.copy()
    moved[corner] = _onto(nodes[corner], surface, planes)
    ends = np.empty((len(nodes), 2), dtype=np.int64)
    ends[cells[:, 4:].ravel()] = cells[:, EDGES].reshape(-1, 2)
    ends = ends[vertices:]
    for _ in range(MOST_RETREATS):
        bad = least_jacobian(_straight(moved, ends, vertices), cells) < LEAST_JACOBIAN
        if not bad.any():
            break
        back = np.unique(cells[bad, :4])
        moved[back] = nodes[back]
    straight = _straight(moved, ends, vertices)
    curved = straight.copy()
    curved[middle] = _onto(straight[middle], surface, planes)
    while (bad := least_jacobian(curved, cells) < LEAST_JACOBIAN).any():
        stuck = np.unique(cells[bad])
        if (curved[stuck] == straight[stuck]).all():
            break
        curved[stuck] = straight[stuck]
    return curved


def _straight(nodes: Floats, ends: Ints, vertices: int) -> Floats:
    """The nodes with those on edges in the middle of their ends (n_edges, 2)."""
    return np.concatenate([nodes[:vertices], nodes[ends].mean(axis=1)])


def _onto(points: Floats, surface: Surface, planes: tuple[tuple[int, float], ...]) -> Floats:
    """The nearest points of a surface; those of points on a plane stay on it."""
    import pyvista  # slow to load

    there = pyvista.PolyData.from_regular_faces(surface.vertices, surface.triangles)
    nearest = np.array(there.find_closest_cell(points, return_closest_point=True)[1], dtype=np.float64)
    for axis, at in planes:
        nearest[points[:, axis] == at, axis] = at
    return nearest


def _check_volume(nodes: Floats, cells: Ints, solid: Glued, size: float, half: bool) -> None:
    """Refuse a mesh of what is left of walls that are thinner than the grid."""
    corners = solid.surface.vertices[solid.surface.triangles]
    own = float(np.linalg.det(corners).sum()) / (12.0 if half else 6.0)
    found = float(signed_volumes(nodes, cells[:, :4]).sum())
    if abs(found / own - 1.0) > MOST_LOST:
        raise NotInflatable(
            f"The mesh is too coarse for the solid: it has {100.0 * found / own:.0f} % of its volume, as walls or gaps "
            f"are thinner than tetrahedra of {size:.3g} mm can show; choose a smaller size."
        )


def _check_distance(nodes: Floats, sides: Ints, solid: Glued, size: float, half: bool) -> None:
    """Refuse a mesh that misses a wall or a gap of the solid."""
    own = solid.surface.vertices
    there = own[own[:, 1] >= 0.0] if half else own
    off = distance(there, Surface(nodes, sides[:, :3]))
    # What lies inside the end faces is not near the sides.
    inner = (there[:, 0] > FLAT) & (there[:, 0] < solid.length - FLAT)
    worst = int(np.argmax(np.where(inner, off, 0.0)))
    if inner.any() and off[worst] > MOST_OFF * size:
        place = ", ".join(f"{value:.1f}" for value in there[worst])
        raise NotInflatable(
            f"The mesh is too coarse for the solid: at ({place}) mm it is {off[worst]:.2g} mm off, as a wall or gap is "
            f"thinner than tetrahedra of {size:.3g} mm can show; choose a smaller size."
        )


def _pressed(nodes: Floats, sides: Ints, solid: Glued, size: float) -> Bools:
    """Which faces of the sides are walls of the chamber, as the nearer of the solid's walls and other sides says."""
    vertices, triangles = solid.surface.vertices, solid.surface.triangles
    corners = nodes[sides[:, :3]]
    other = ~(solid.wall | solid.at_fixed | solid.at_arm)
    to_wall, to_other = (
        distance(corners.mean(axis=1), Surface(vertices, triangles[own])) for own in (solid.wall, other)
    )
    says = to_wall < to_other
    # Faces that hang together off the planes are of one side.
    group = _groups(sides)
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    share = np.bincount(group, area * says) / np.bincount(group, area)
    mistaken = np.minimum(share, 1.0 - share) @ np.bincount(group, area) / area.sum()
    if mistaken > MOST_MISTAKEN:
        raise NotInflatable(
            f"The mesh joins chamber and outside, as a wall is thinner than tetrahedra of {size:.3g} mm show: choose "
            "a smaller size."
        )
    return np.asarray((share > 0.5)[group])


def _groups(faces: Ints) -> Ints:
    """Number of the group that each face belongs to, (n,): faces that share an edge are of one group."""
    middles = faces[:, 3:].ravel()
    _, edge = np.unique(middles, return_inverse=True)
    own = np.repeat(np.arange(len(faces)), 3)
    n = len(faces)
    graph = coo_array((np.ones(len(own), dtype=bool), (own, n + edge)), (n + edge.max() + 1,) * 2)
    _, label = connected_components(graph, directed=False)
    _, group = np.unique(label[:n], return_inverse=True)
    return np.asarray(group)


def rim_of(nodes: Floats, walls: Ints, length: float) -> tuple[Ints, Ints, Ints]:
    """Start, middle and end of the edges where walls of the chamber meet the arm's plate, (n,) each."""
    edges = walls[:, [[0, 3, 1], [1, 4, 2], [2, 5, 0]]].reshape(-1, 3)
    start, middle, end = edges[(nodes[edges, 0] == length).all(axis=1)].T
    return start, middle, end


def opening_of(nodes: Floats, walls: Ints, length: float) -> float:
    """Area that the chamber opens to the arm's plate, 1/2 ∮ (y dz - z dy) along its rim, mm²."""
    start, middle, end = (nodes[part, 1:] for part in rim_of(nodes, walls, length))

    def product(one: Floats, other: Floats) -> float:
        return float(np.sum(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]))

    # Exact for parabolas: ∮ of the edges' three shape functions and their slopes.
    return abs(2.0 * (product(start, middle) + product(middle, end)) - 0.5 * product(start, end)) / 3.0
