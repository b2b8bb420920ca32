"""A conforming split of the swept mesh into tetrahedra, and the triangles it leaves on ends and wall.

Every section cell is cut along its shorter diagonal and every prism below a section triangle a < b < c into three
tetrahedra along the diagonals that leave its lowest vertex number, the rule of Dompierre, Labbé, Vallet & Camarero,
"How to subdivide pyramids, prisms and hexahedra into tetrahedra" (1999). Cells that share a face therefore share its
diagonal.
"""

from __future__ import annotations

import numpy as np

from actuator.arrays import Ints
from actuator.domains.half_cylinder import HEX_OFFSETS, HalfCylinder

#: Corners (end, section vertex) of the three tetrahedra of a prism; section vertices are sorted by number.
_PRISM = np.array(
    [
        [(0, 0), (0, 1), (0, 2), (1, 2)],
        [(0, 0), (0, 1), (1, 1), (1, 2)],
        [(0, 0), (1, 0), (1, 1), (1, 2)],
    ]
)

#: Faces of a tetrahedron with positive volume, each oriented outwards; face i is opposite to vertex i.
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def tetrahedra(domain: HalfCylinder) -> Ints:
    """Vertices of the 6 n_cells tetrahedra, (n, 4), all with positive volume."""
    ns = domain.section_points
    triangles = np.sort(_section_triangles(domain), axis=1)
    corners = triangles[:, _PRISM[:, :, 1]] + ns * _PRISM[:, :, 0]
    tets = (corners[None] + ns * np.arange(domain.layers)[:, None, None, None]).reshape(-1, 4)
    edges = domain.points[tets[:, 1:]] - domain.points[tets[:, :1]]
    inverted = np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2]) < 0.0
    tets[inverted] = tets[inverted][:, [0, 1, 3, 2]]
    return tets


def cells_of_tetrahedra(domain: HalfCylinder) -> Ints:
    """The hexahedron that each of the :func:`tetrahedra` is a part of, (n,)."""
    section = np.repeat(np.tile(np.arange(domain.section_cells), 2), len(_PRISM))
    return (section + domain.section_cells * np.arange(domain.layers)[:, None]).ravel()


def outer_triangles(domain: HalfCylinder, tets: Ints) -> Ints:
    """Faces of the tetrahedra on the two ends and on the cylinder wall, (n, 3), oriented outwards.

    The faces on the symmetry plane are left out: there the half is open.
    """
    x1 = domain.points[:, 0]
    on_wall = np.zeros(len(x1), dtype=bool)
    on_wall[domain.wall_vertices] = True
    found = []
    # A tetrahedron has at most two section vertices on the wall, so three wall vertices span a face of the wall.
    for on_surface in (x1 == 0.0, x1 == domain.length, on_wall):
        touching = tets[on_surface[tets].sum(axis=1) == 3]
        opposite = np.argmin(on_surface[touching], axis=1)
        found.append(np.take_along_axis(touching, _FACES[opposite], axis=1))
    return np.concatenate(found)


def _section_triangles(domain: HalfCylinder) -> Ints:
    """Triangles of the first section, (2 section_cells, 3)."""
    first = domain.cells[: domain.section_cells]
    quad = np.stack([first[:, _local(*corner)] for corner in ((0, 0), (1, 0), (1, 1), (0, 1))], axis=1).astype(np.int64)
    corner = domain.points[quad]
    first_diagonal = np.linalg.norm(corner[:, 2] - corner[:, 0], axis=1)
    second_diagonal = np.linalg.norm(corner[:, 3] - corner[:, 1], axis=1)
    # Ties, as between mirror images about X3 = 0, must not be decided by rounding.
    turn = second_diagonal < first_diagonal * (1.0 - 1e-9)
    quad[turn] = np.roll(quad[turn], -1, axis=1)
    return np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])


def _local(second: int, third: int) -> int:
    return HEX_OFFSETS.tolist().index([0, second, third])
