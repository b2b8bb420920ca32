"""Bodies of quadratic tetrahedra whose shapes are known: layers of the same triangles, every prism cut into three."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from physics import parameters

from actuator.arrays import Bools, Floats, Ints
from actuator.body.inflation import Inflation
from actuator.body.mesh import EDGES, BodyMesh, Tetrahedra, boundary_faces, quadratic, signed_volumes
from actuator.parameters import Material
from actuator.solve.path import Control, Point, begin, follow

PRECISE = Control(first=0.25, largest=1.0, tolerance=1e-10)


def material(poisson_ratio: float = 0.48) -> Material:
    """The paper's, with another Poisson's ratio."""
    return parameters(material={"poisson_ratio": poisson_ratio})[0]


def layered(layers: Floats, triangles: Ints) -> Tetrahedra:
    """Tetrahedra between layers (n_layers, n, 3) of points on the same triangles (m, 3); those of the first come first.

    The corners of every triangle are taken by number, so that neighbours cut the face between them alike.
    """
    count, n, _ = layers.shape
    a, b, c = np.sort(triangles, axis=1).T
    one = np.concatenate([np.stack(tet, axis=1) for tet in ((a, b, c, c + n), (a, b, b + n, c + n))])
    one = np.concatenate([one, np.stack([a, a + n, b + n, c + n], axis=1)])
    corners = np.concatenate([one + k * n for k in range(count - 1)])
    points = layers.reshape(-1, 3)
    turned = signed_volumes(points, corners) < 0.0
    corners[turned] = corners[turned][:, [0, 1, 3, 2]]
    return Tetrahedra(points, corners)


def grid(first: Floats, second: Floats) -> tuple[Floats, Floats, Ints]:
    """Coordinates (n,) and (n,) of a rectangle's points, and its triangles (m, 3)."""
    one, other = (line.ravel() for line in np.meshgrid(first, second, indexing="ij"))
    number = np.arange(len(one)).reshape(len(first), len(second))
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return one, other, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def sector(
    angle: float, radii: Floats, length: float, around: int, along: int, offset: float = 0.0
) -> tuple[Tetrahedra, int]:
    """A sector 0 to ``angle`` (from X3 to X2) of a tube along X1, and how many vertices lie on its inner wall.

    The inner wall is moved along X3 by an offset, mm.
    """
    theta, x, triangles = grid(np.linspace(0.0, angle, around + 1), np.linspace(0.0, length, along + 1))
    sine, cosine = (np.where(np.abs(values) < 1e-12, 0.0, values) for values in (np.sin(theta), np.cos(theta)))
    outside = (radii - radii[0]) / (radii[-1] - radii[0])
    layers = [
        np.stack([x, r * sine, r * cosine + (1.0 - far) * offset], axis=1)
        for r, far in zip(radii, outside, strict=True)
    ]
    return layered(np.array(layers), triangles), len(x)


def octant(radii: Floats, around: int) -> tuple[Tetrahedra, int]:
    """The octant of positive coordinates of a spherical shell, and how many vertices lie on its inner wall."""
    steps = [(i, j, around - i - j) for i in range(around + 1) for j in range(around + 1 - i)]
    number = {step: k for k, step in enumerate(steps)}
    triangles = []
    for i, j, _ in steps:
        corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]
        a, b, c, d = (number.get((p, q, around - p - q), -1) for p, q in corners)
        triangles += [t for t in ((a, b, c), (b, d, c)) if min(t) >= 0]
    # Equal angles along the edges, so that the triangles are nearly of one size.
    directions = np.tan(0.25 * np.pi * np.array(steps) / around * 2.0 / (1.0 + np.array(steps) / around))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return layered(radii[:, None, None] * directions, np.array(triangles)), len(steps)


def curve(nodes: Floats, cells: Ints, components: slice) -> None:
    """Move nodes on edges outwards, until each is as far from the origin as the ends of its edge in the mean."""
    ends = nodes[cells[:, EDGES]][..., components]
    radius, middle = np.linalg.norm(ends, axis=3).mean(axis=2), ends.mean(axis=2)
    nodes[cells[:, 4:], components] = middle * (radius / np.linalg.norm(middle, axis=2))[..., None]


def between_plates(
    tetrahedra: Tetrahedra, inner: int, length: float, *, half: bool = True, curved: bool = False
) -> BodyMesh:
    """The body glued between plates at X1 = 0 and ``length``; air presses on faces of the first ``inner`` vertices."""
    nodes, cells = quadratic(tetrahedra)
    if curved:
        curve(nodes, cells, slice(1, 3))
    faces = boundary_faces(cells)
    planes = [(nodes[faces[:, :3], axis] == at).all(axis=1) for axis, at in ((0, 0.0), (0, length), (1, 0.0))]
    fixed, tip, symmetry = planes[0], planes[1], planes[2] & half
    walls = faces[(faces[:, :3] < inner).all(axis=1)]
    return BodyMesh(
        nodes=nodes,
        cells=cells,
        vertices=len(tetrahedra.points),
        walls=walls,
        boundary=faces[~symmetry],
        fixed=np.unique(faces[fixed]),
        tip=np.unique(faces[tip]),
        symmetry=np.unique(faces[symmetry]),
        opening=opening_at(nodes, walls, length)[0],
        length=length,
        half=half,
    )


def opening_at(nodes: Floats, walls: Ints, length: float) -> tuple[float, float]:
    """Area that the plate at X1 = length closes, mm², and its first moment ∫ X3 dA, mm³."""
    points, weights = np.polynomial.legendre.leggauss(4)
    edges = nodes[_rim(nodes, walls, length)][:, [0, 2, 1], 1:]
    # Parabolas through start, middle and end, at -1, 0 and 1.
    shapes = np.stack([0.5 * points * (points - 1.0), 1.0 - points**2, 0.5 * points * (points + 1.0)])
    slopes = np.stack([points - 0.5, -2.0 * points, points + 0.5])
    (y, z), (dy, dz) = (np.einsum("aq,eai->ieq", values, edges) for values in (shapes, slopes))
    area, moment = float(np.sum(weights * y * dz)), float(np.sum(-0.5 * weights * z**2 * dy))
    return (area, moment) if area > 0.0 else (-area, -moment)


def _rim(nodes: Floats, walls: Ints, length: float) -> Ints:
    """Edges (m, 3) of walls in the plane X1 = length: two ends and the node between them."""
    edges = walls[:, [[0, 1, 3], [1, 2, 4], [2, 0, 5]]].reshape(-1, 3)
    return edges[(nodes[edges, 0] == length).all(axis=1)]


@dataclass(frozen=True)
class Mirrored(BodyMesh):
    """A body that is a part of its images in planes X_i = const, on which its nodes slide.

    Attributes:
        slides: nodes that may not leave their plane normal to each axis.
    """

    slides: tuple[Ints, ...] = ()

    @property
    def free(self) -> Bools:
        free = super().free
        for axis, nodes in enumerate(self.slides):
            free[nodes, axis] = False
        return free


def mirrored(
    tetrahedra: Tetrahedra, inner: int, planes: Sequence[tuple[int, float]], round_about: slice | None = None
) -> Mirrored:
    """A part of a symmetric body, with a lid on the chamber where that ends in a plane X1 > 0.

    Arm and plates belong to a lone tetrahedron far away, which no air presses on.

    Args:
        round_about: components of a radius, which edges are curved along.
    """
    away = np.array([(0.0, 99.0, 0.0), (0.0, 99.0, 1.0), (1.0, 99.0, 0.0), (1.0, 98.0, 1.0)])
    points, corners = tetrahedra
    lone = len(points) + np.arange(4)
    nodes, cells = quadratic(
        Tetrahedra(np.concatenate([points, away]), np.concatenate([corners, lone[None, [0, 1, 3, 2]]]))
    )
    own = cells[:-1]
    if round_about is not None:
        curve(nodes, own, round_about)
    faces = boundary_faces(own)
    walls = faces[(faces[:, :3] < inner).all(axis=1)]
    slides = [np.flatnonzero(np.zeros(len(nodes))) for _ in range(3)]
    used = np.unique(own)
    for axis, at in planes:
        slides[axis] = np.concatenate([slides[axis], used[np.abs(nodes[used, axis] - at) < 1e-9]])
        if axis == 0 and at > 0.0:
            nodes, lid = _lid(nodes, walls, at)
            walls = np.concatenate([walls, lid])
            for other in range(3):  # its own nodes rest
                slides[other] = np.concatenate([slides[other], np.setdiff1d(lid, used)])
    ends = cells[-1]
    return Mirrored(
        nodes=nodes,
        cells=cells,
        vertices=len(points) + 4,
        walls=walls,
        boundary=faces,
        fixed=ends[nodes[ends, 0] == 0.0],
        tip=ends[nodes[ends, 0] == 1.0],
        symmetry=np.empty(0, dtype=np.int64),
        opening=0.0,
        length=1.0,
        half=True,
        slides=tuple(slides),
    )


def _lid(nodes: Floats, walls: Ints, length: float) -> tuple[Floats, Ints]:
    """Faces from the rim to the axis. The volume depends on their rim only, while that stays plane."""
    rim = _rim(nodes, walls, length)
    centre = np.array([[length, 0.0, 0.0]])
    ends = np.unique(rim[:, :2])
    spoke = {end: len(nodes) + 1 + k for k, end in enumerate(ends)}
    lid = [(b, a, len(nodes), middle, spoke[a], spoke[b]) for a, b, middle in rim.tolist()]
    return np.concatenate([nodes, centre, 0.5 * (nodes[ends] + centre)]), np.array(lid)


def half_tube(around: int = 8, along: int = 4, through: int = 2, offset: float = 1.0, length: float = 10.0) -> BodyMesh:
    """Half of an eccentric tube between plates, radii of 5 and 8 mm: it bends."""
    half = sector(np.pi, np.linspace(5.0, 8.0, through + 1), length, around, along, offset)
    return between_plates(*half, length, curved=True)


def doubled(tetrahedra: Tetrahedra, inner: int) -> tuple[Tetrahedra, int]:
    """A half and its image in X2 = 0, and how many vertices lie on the inner walls of both."""
    points, corners = tetrahedra
    n, image = len(points), points * [1.0, -1.0, 1.0]
    every = np.concatenate([points, image])
    same = np.where(points[:, 1] == 0.0, np.arange(n), n + np.arange(n))
    corners = np.concatenate([corners, same[corners][:, [0, 1, 3, 2]]])
    # Those on inner walls first, those that are their own images once.
    inside = np.tile(np.arange(n) < inner, 2)
    kept = np.concatenate([np.ones(n, dtype=bool), points[:, 1] != 0.0])
    order = np.concatenate([np.flatnonzero(kept & inside), np.flatnonzero(kept & ~inside)])
    number = np.full(2 * n, -1)
    number[order] = np.arange(len(order))
    return Tetrahedra(every[order], number[corners]), int((kept & inside).sum())


def whole_tube(
    around: int = 8, along: int = 4, through: int = 2, offset: float = 1.0, length: float = 10.0
) -> BodyMesh:
    """That half and its image."""
    half = sector(np.pi, np.linspace(5.0, 8.0, through + 1), length, around, along, offset)
    return between_plates(*doubled(*half), length, half=False, curved=True)


def inflation(mesh: BodyMesh, stuff: Material | None = None, **changes: Any) -> Inflation:
    """The problem with an arm of 60 mm and a pressure of about the paper's."""
    return Inflation(mesh, stuff or material(), **({"pressure": 0.05, "reach": 60.0, "stiffness": 0.02} | changes))


def inflated(problem: Inflation, load: float = 1.0, control: Control = PRECISE) -> Point:
    """The state of a path at a load."""
    here = begin(problem, problem.rest, 0.0, control)
    return list(follow(problem, here, load, control))[-1]


def perturbed(tetrahedra: Tetrahedra, by: float) -> Tetrahedra:
    """The same tetrahedra with vertices inside of the bounding box moved at random."""
    points = tetrahedra.points.copy()
    inside = ((points > points.min(axis=0) + 1e-9) & (points < points.max(axis=0) - 1e-9)).all(axis=1)
    points[inside] += by * np.random.default_rng(0).uniform(-1.0, 1.0, (int(inside.sum()), 3))
    return tetrahedra._replace(points=points)


def imbalance(problem: Inflation, motion: Floats, pull: Floats, load: float = 1.0) -> Floats:
    """Forces 1 and 3, N, and moment 2, N mm, about the plate's centre, that are left on the arm's plate.

    They are what the body pulls by (3,), the air on the plate's opening, and the spring at the end of the arm.

    Args:
        motion: T1, T3 and θ2.
    """
    arm, mesh = problem.arm, problem.mesh
    (area, moment), angle = opening_at(mesh.nodes, mesh.walls, mesh.length), motion[2]
    air = load * problem.pressure
    spring = -arm.stiffness * (motion[1] - arm.reach * np.sin(angle))
    one = pull[0] + air * area * np.cos(angle)
    three = pull[1] - air * area * np.sin(angle) + spring
    two = pull[2] + air * moment - arm.reach * np.cos(angle) * spring
    return np.array([one, three, two])


def pulls(mesh: BodyMesh, displacement: Floats, motion: Floats, reactions: Floats) -> Floats:
    """What the body pulls the arm's plate by: forces 1 and 3, N, and moment 2 about its centre, N mm."""
    place = mesh.nodes[mesh.tip] + displacement[mesh.tip] - [mesh.length + motion[0], 0.0, motion[1]]
    force = -reactions[mesh.tip]
    moment = place[:, 2] * force[:, 0] - place[:, 0] * force[:, 2]
    return np.array([force[:, 0].sum(), force[:, 2].sum(), moment.sum()])
