"""Conforming cuts of hexahedra into six tetrahedra each; cells that share a face share its diagonal.

Both follow the rule of Dompierre, Labbé, Vallet & Camarero, "How to subdivide pyramids, prisms and hexahedra into
tetrahedra" (1999): a diagonal leaves the lowest vertex number of its face.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from skfem import ElementHex1

from actuator.arrays import Floats, Ints

#: Corners (end, section vertex) of the three tetrahedra of a prism; section vertices are sorted by number.
_PRISM = np.array(
    [
        [(0, 0), (0, 1), (0, 2), (1, 2)],
        [(0, 0), (0, 1), (1, 1), (1, 2)],
        [(0, 0), (1, 0), (1, 1), (1, 2)],
    ]
)


def _corner(*offsets: int) -> int:
    """Local number of a corner of scikit-fem's reference hexahedron."""
    return ElementHex1.doflocs.astype(np.int64).tolist().index(list(offsets))


#: Corners of the six faces of a hexahedron, each around the face; then of one section, around it.
_FACES = np.array(
    [
        [_corner(*np.insert(np.array(around), axis, end)) for around in ((0, 0), (1, 0), (1, 1), (0, 1))]
        for axis in range(3)
        for end in (0, 1)
    ]
)
_SECTION = _FACES[0]


class Tetrahedra(NamedTuple):
    """Tetrahedra that fill a mesh.

    Attributes:
        corners: vertices, (n, 4), all with positive volume.
        cells: the hexahedron that each is a part of, (n,).
    """

    corners: Ints
    cells: Ints


def pulled(points: Floats, cells: Ints) -> Tetrahedra:
    """Cut any conforming hexahedra: every cell's lowest vertex is joined to the cut faces that it does not belong to.

    Args:
        points: (n_vertices, 3), mm.
        cells: (n_cells, 8), in scikit-fem's local order.
    """
    n = len(cells)
    faces = cells[:, _FACES].astype(np.int64)  # (n_cells, 6, 4)
    lowest = cells.min(axis=1).astype(np.int64)
    opposite = faces[~(faces == lowest[:, None, None]).any(axis=2)].reshape(n, 3, 4)
    # Each face turned so that its lowest vertex, from which the diagonal goes, comes first.
    turn = (opposite.argmin(axis=2)[..., None] + np.arange(4)) % 4
    turned = np.take_along_axis(opposite, turn, axis=2)
    triangles = turned[..., [[0, 1, 2], [0, 2, 3]]].reshape(n, 6, 3)
    apex = np.broadcast_to(lowest[:, None, None], (n, 6, 1))
    corners = np.concatenate([apex, triangles], axis=2).reshape(-1, 4)
    return Tetrahedra(_positive(points, corners), np.repeat(np.arange(n), 6))


def swept(points: Floats, section: Ints, layers: int, step: int) -> Tetrahedra:
    """Cut cells swept along X1: every section cell along its shorter diagonal, which leaves better shapes.

    The prisms below its two triangles a < b < c are cut along the diagonals that leave their lowest vertex number.

    Args:
        points: (n_vertices, 3), mm.
        section: cells of the first layer, (n_classes, 8), in scikit-fem's local order, the first axis being X1.
        layers: how many layers there are.
        step: vertices of a section: what the numbers of the next layer's are higher by.
    """
    triangles = np.sort(_section_triangles(points, section), axis=1)
    corners = triangles[:, _PRISM[:, :, 1]] + step * _PRISM[:, :, 0]
    corners = (corners[None] + step * np.arange(layers)[:, None, None, None]).reshape(-1, 4)
    cells = np.repeat(np.tile(np.arange(len(section)), 2), len(_PRISM))
    return Tetrahedra(_positive(points, corners), (cells + len(section) * np.arange(layers)[:, None]).ravel())


def mirrored(half: Tetrahedra, image: Ints, cells: int) -> Tetrahedra:
    """Tetrahedra of a half and their mirror images, whose corners are exchanged so that volumes stay positive.

    Args:
        half: of the half.
        image: for every vertex of the half its mirror image, (n_vertices,); itself on the symmetry plane.
        cells: what the number of a cell's mirror image is higher by.
    """
    images = image[half.corners][:, [0, 1, 3, 2]]
    return Tetrahedra(np.concatenate([half.corners, images]), np.concatenate([half.cells, half.cells + cells]))


def _positive(points: Floats, corners: Ints) -> Ints:
    """The same tetrahedra, two corners exchanged where the volume is negative."""
    edges = points[corners[:, 1:]] - points[corners[:, :1]]
    inverted = np.einsum("ij,ij->i", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2]) < 0.0
    corners[inverted] = corners[inverted][:, [0, 1, 3, 2]]
    return corners


def _section_triangles(points: Floats, section: Ints) -> Ints:
    """Triangles of the first section, (2 n_classes, 3)."""
    quad = section[:, _SECTION].astype(np.int64)
    corner = points[quad]
    first_diagonal = np.linalg.norm(corner[:, 2] - corner[:, 0], axis=1)
    second_diagonal = np.linalg.norm(corner[:, 3] - corner[:, 1], axis=1)
    # Ties, as between mirror images about X3 = 0, must not be decided by rounding.
    turn = second_diagonal < first_diagonal * (1.0 - 1e-9)
    quad[turn] = np.roll(quad[turn], -1, axis=1)
    return np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
