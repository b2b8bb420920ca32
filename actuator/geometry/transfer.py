"""Designs from elsewhere on the vertices of a domain: of another mesh, of a solid, of a wall of given thickness."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Boundary, Domain
from actuator.geometry.distance import distance, signed_distance
from actuator.geometry.location import located
from actuator.geometry.placing import placed
from actuator.geometry.printing.directions import Axis
from actuator.geometry.zero_set import Surface

#: How far from the planes of the plates a solid's end faces may lie, and the inside is asked for, over the length.
FLAT = 1e-3


def interpolated(source: Domain, chi: Floats, domain: Domain) -> Floats:
    """χ of another domain at the vertices of this one, (n_vertices,).

    Equal meshes keep their values. Others are laid over each other by length and size; χ is linear in the tetrahedra
    of the source, and a vertex outside of them, at a curved wall, takes the value of the nearest place.
    """
    if source.points.shape == domain.points.shape and np.allclose(source.points, domain.points, atol=0.0, rtol=1e-9):
        return np.array(chi)
    ratio = np.array([source.length / domain.length, *(2 * [source.size / domain.size])])
    places = domain.points * ratio
    if source.mirrored:
        places[:, 1] = np.abs(places[:, 1])
    return located(source.points, source.tetrahedra().corners, places).of(chi)


def facets_of(domain: Domain, boundary: Boundary) -> Surface:
    """The facets of a boundary in triangles that face either way: enough for a distance without a sign."""
    facets = domain.mesh.facets[:, boundary.facets].T
    # The corners of a facet stand in no order around it; all four triangles of three of them cover it in any case.
    return Surface(domain.points, np.concatenate([facets[:, corners] for corners in combinations(range(4), 3)]))


def around_chamber(domain: Domain, thickness: float) -> Floats:
    """Distance into a wall of a thickness along the outside of the domain, (n_vertices,), mm; negative in its chamber.

    The outside is measured as positive too: that the surface lies in the domain is the passive bound's business.
    """
    return thickness - distance(domain.points, facets_of(domain, domain.outside))


def of_solid(solid: Surface, domain: Domain, axis: Axis, scale: float | None) -> Floats:
    """Distance into a solid from its sides at the vertices of a domain, (n_vertices,), mm; negative outside of it.

    Its end faces do not count: plates close them, and the wall goes on to the plates.

    Args:
        solid: closed, in the size of the print, mm.
        domain: with its axis along X1, from X1 = 0.
        axis: of the solid.
        scale: size of the solid over that of the domain; by their lengths if None.
    """
    vertices = np.roll(solid.vertices, -"xyz".index(axis), axis=1)
    scale = scale or float(np.ptp(vertices[:, 0])) / domain.length
    surface = Surface(placed(vertices) / scale, solid.triangles)
    x = surface.vertices[surface.triangles, 0]
    low, high = FLAT * domain.length, (1.0 - FLAT) * domain.length
    sides = ~((x <= low).all(axis=1) | (x >= high).all(axis=1))
    # On the very planes of the plates inside and outside of the end faces are not told apart.
    places = np.column_stack([np.clip(domain.points[:, 0], 2.0 * low, domain.length - 2.0 * low), domain.points[:, 1:]])
    inside = np.where(signed_distance(places, surface) < 0.0, 1.0, -1.0)
    return inside * distance(places, Surface(surface.vertices, surface.triangles[sides]))
