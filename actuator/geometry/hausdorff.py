"""Hausdorff distance of the extracted surface to the zero set of the isoparametric field.

The surface is the zero set of χ linear in tetrahedra; the field itself is trilinear in every hexahedron. Both are
sampled by a fixed rule, and every sample's distance to the other set is computed. Maximum and root mean square are
symmetrised as by Aspert, Santa-Cruz & Ebrahimi, "MESH: measuring errors between surfaces using the Hausdorff distance"
(ICME 2002): the larger of the two directions.

- Zero set to surface: on a line of two constant reference coordinates χ is linear and its root exact. The roots on a
  grid of lines in all three directions sample the zero set, and VTK gives their distance to the triangles. Each is
  exact, so the largest is a lower bound of the largest in this direction.
- Surface to zero set: vertices and centroids of the triangles are projected on the zero set of the hexahedron they lie
  in, and where that does not settle inside it, also from the nearest roots, in the hexahedra of these. Every foot lies
  on the zero set to rounding, so that a sample's distance to the nearest foot is an upper bound of its distance; it is
  larger where that foot, at a side of its hexahedron or one of several, is not the nearest point.

What the numbers do not bound is the distance between the samples. No piece of either set in a cell goes without one:
trilinear functions are harmonic in the reference coordinates, so that their zero sets reach the edges of the cell. But
beyond that nothing sharper is proved than that a distance changes no faster than its place, and samples are up to half
a cell apart. Beside brute force on coarse meshes maxima are up to 4 % short, and root mean squares up to 7 % too large.
Values at the threshold count as void in both sets. Only the surface inside the half is compared, not the faces that
close it at ends and wall; the other half is its mirror image, and no point of it is nearer to a point of this half than
the image of that point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from actuator.arrays import Floats, Ints
from actuator.domains.interface import HEX_OFFSETS, Domain
from actuator.domains.tetrahedra import Tetrahedra
from actuator.geometry.distance import distance
from actuator.geometry.trilinear import TINY, cofactor_matrices, field, projected, shape_functions
from actuator.geometry.zero_set import Surface, solid_boundary

#: Where the lines cross a side of the reference cube, and the trapezoidal rule there. Largest distances lie above the
#: middles of cells and faces, or near the thirds of them.
LINES, WEIGHTS = np.array([0.0, 1 / 3, 1 / 2, 2 / 3, 1.0]), np.array([2, 3, 2, 3, 2]) / 12.0
#: Projections in a sample's own hexahedron, and from the nearest roots. The latter take part of each step, which
#: settles also where the distance is as large as the radius of curvature.
OWN, FROM_ROOTS = (3, 1.0), (5, 0.7)
#: Nearest roots that a doubtful sample is projected from.
NEAREST = 4
#: Samples worked on at once; so few that their arrays stay in the cache.
CHUNK = 1 << 12


@dataclass(frozen=True)
class Distance:
    """Distances between the extracted surface and the zero set of the field, mm.

    Attributes:
        maximum_to_surface, rms_to_surface: from the zero set to the surface; the mean is over the zero set's area.
        maximum_to_zero_set, rms_to_zero_set: from the surface to the zero set; the mean is over the surface's area.
    """

    maximum_to_surface: float
    rms_to_surface: float
    maximum_to_zero_set: float
    rms_to_zero_set: float

    @property
    def maximum(self) -> float:
        """The Hausdorff distance as the samples show it, mm."""
        return max(self.maximum_to_surface, self.maximum_to_zero_set)

    @property
    def rms(self) -> float:
        """The larger of the two root mean squares, mm."""
        return max(self.rms_to_surface, self.rms_to_zero_set)


@dataclass(frozen=True)
class _Samples:
    """Points in cut hexahedra.

    Attributes:
        points: (n, 3), mm.
        cell: row of the hexahedron among the cut ones, (n,).
        reference: reference coordinates, (n, 3); of points on the surface roughly.
        area: area that each point stands for, (n,), mm².
    """

    points: Floats
    cell: Ints
    reference: Floats
    area: Floats


def distance_to_zero_set(domain: Domain, tets: Tetrahedra, chi: Floats, threshold: float = 0.0) -> Distance:
    """Distance between the surface that ``solid_boundary`` extracts and the zero set of the trilinear field.

    Args:
        domain: the meshed domain.
        tets: all its tetrahedra, as the domain cuts its cells.
        chi: χ at its vertices, (n_vertices,), finite.
        threshold: level of the surface, in units of χ.

    Returns:
        The distances, all zero if no surface enters the domain.
    """
    cut = np.flatnonzero(_mixed((chi > threshold)[domain.cells]))
    if not len(cut):
        return Distance(0.0, 0.0, 0.0, 0.0)
    values = chi[domain.cells[cut]] - threshold
    # Scaled, so that no square overflows, and what is solid stays so.
    scaled = values / np.abs(values).max(axis=1, keepdims=True)
    scaled = np.where(values > 0.0, np.maximum(scaled, TINY), scaled)
    corners = np.concatenate([domain.points[domain.cells[cut]], scaled[..., None]], axis=2)
    roots = _roots(corners)
    surface, samples = _surface_samples(domain, tets, chi, threshold, cut)
    there = distance(roots.points, surface)
    back = _to_zero_set(corners, samples, roots)
    return Distance(*_measures(there, roots.area), *_measures(back, samples.area))


def _measures(distances: Floats, area: Floats) -> tuple[float, float]:
    return float(distances.max()), float(np.sqrt(distances**2 @ area / area.sum()))


def _mixed(solid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return np.asarray(solid.any(axis=1) & ~solid.all(axis=1))


def _roots(corners: Floats) -> _Samples:
    """Roots of χ on the lines of all cut hexahedra, whose corners (n, 8, 4) are places and values.

    In reference coordinates, a piece dA of the zero set is met by lines of direction i in proportion to |n_i| dA. A
    root on a line of weight w therefore stands for the area w / Σ |n_i| (Cauchy and Crofton).
    """
    pairs = np.stack(np.meshgrid(LINES, LINES, indexing="ij"), axis=-1).reshape(-1, 2)
    weights = np.outer(WEIGHTS, WEIGHTS).ravel()
    found = []
    for axis in range(3):
        start = np.insert(pairs, axis, 0.0, axis=1)
        first, last = (corners[:, :, 3] @ shape_functions(np.insert(pairs, axis, end, axis=1))[0] for end in (0.0, 1.0))
        cell, line = np.nonzero((first > 0.0) != (last > 0.0))
        place = start[line]
        place[:, axis] = first[cell, line] / (first[cell, line] - last[cell, line])
        for part in _chunks(len(cell)):
            point, edges, _, slope = field(corners[cell[part]], place[part])
            # Nanson: the cofactors take area vectors of the reference cube to those of the hexahedron.
            area = np.linalg.norm(np.einsum("nik,nk->ni", cofactor_matrices(edges), slope), axis=1)
            area *= weights[line[part]] / np.maximum(np.abs(slope).sum(axis=1), TINY)
            found.append((point, cell[part], place[part], area))
    return _Samples(*(np.concatenate(column) for column in zip(*found, strict=True)))


def _surface_samples(
    domain: Domain, tets: Tetrahedra, chi: Floats, threshold: float, cut: Ints
) -> tuple[Surface, _Samples]:
    """The surface, and its vertices and centroids with the hexahedra they lie in.

    It is extracted hexahedron by hexahedron, from the same cuts of the same edges. Weights of 1/12 for vertices and 3/4
    for centroids integrate quadratic polynomials exactly.
    """
    mixed = _mixed((chi > threshold)[tets.corners])
    corners, owner = tets.corners[mixed], tets.cells[mixed]
    row, local = np.searchsorted(cut, owner), (domain.cells[owner, None] == corners[..., None]).argmax(axis=2)
    corner = domain.cells[cut].ravel()
    # Reference coordinates and row are cut as the points are; the former are not exact, but a place to start from.
    columns = (domain.points[corner], np.tile(HEX_OFFSETS, (len(cut), 1)), np.repeat(np.arange(len(cut)), 8)[:, None])
    apart = solid_boundary(np.hstack(columns), 8 * row[:, None] + local, corners[:0, :3], chi[corner], threshold)
    vertices, triangles = apart.vertices, apart.triangles
    surface = Surface(np.ascontiguousarray(vertices[:, :3]), triangles)
    sides = surface.vertices[triangles[:, 1:]] - surface.vertices[triangles[:, :1]]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    around = np.bincount(triangles.ravel(), np.repeat(area, 3), len(vertices))
    found = np.concatenate([vertices, vertices[triangles].mean(axis=1)])
    shares = np.concatenate([around / 12.0, 0.75 * area])
    return surface, _Samples(found[:, :3], np.rint(found[:, 6]).astype(np.int64), found[:, 3:6], shares)


def _to_zero_set(corners: Floats, samples: _Samples, roots: _Samples) -> Floats:
    """Distance of samples to the zero set, (n,), mm."""
    count = min(NEAREST, len(roots.points))
    reach, near = map(np.asarray, KDTree(roots.points).query(samples.points, k=range(1, count + 1)))
    found = [
        projected(corners[samples.cell[part]], samples.reference[part], samples.points[part], *OWN)
        for part in _chunks(len(samples.cell))
    ]
    own, settled = (np.concatenate(column) for column in zip(*found, strict=True))
    distances = np.minimum(own, reach[:, 0])
    doubtful = np.flatnonzero(~settled | (own > 0.5 * reach[:, 0]))
    sample, root = np.repeat(doubtful, count), near[doubtful].ravel()
    for part in _chunks(len(sample)):
        start = root[part]
        target = samples.points[sample[part]]
        other, _ = projected(corners[roots.cell[start]], roots.reference[start], target, *FROM_ROOTS)
        np.minimum.at(distances, sample[part], other)
    return distances


def _chunks(size: int) -> list[slice]:
    return [slice(start, start + CHUNK) for start in range(0, size, CHUNK)]
