"""The triangles that the tetrahedra of a domain leave on its surface, at which a solid is closed."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Ints
from actuator.domains.interface import Domain

#: Faces of a tetrahedron with positive volume, each oriented outwards; face i is opposite to vertex i.
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def outer_triangles(domain: Domain, tets: Ints) -> Ints:
    """Faces of the tetrahedra on the domain's surface, (n, 3), oriented outwards: fixed end, tip, then all others.

    The faces on the symmetry plane are left out: there the half is open.

    Args:
        domain: the meshed domain.
        tets: corners of its tetrahedra, (n, 4).
    """
    facets = domain.mesh.facets[:, domain.mesh.boundary_facets()]
    fixed, tip, symmetry, surface = (
        _mask(domain.mesh.nvertices, vertices)
        for vertices in (domain.fixed.vertices, domain.tip.vertices, domain.symmetry.vertices, facets)
    )
    touching = tets[surface[tets].sum(axis=1) >= 3]
    tet, face = np.nonzero(surface[touching[:, _FACES]].all(axis=2))
    triangles = touching[tet[:, None], _FACES[face]]
    # A face of one tetrahedron alone is on the surface; one that only has its corners there belongs to two.
    _, owners, count = np.unique(np.sort(triangles, axis=1), axis=0, return_inverse=True, return_counts=True)
    triangles = triangles[(count[owners.ravel()] == 1) & ~symmetry[triangles].all(axis=1)]
    part = np.where(fixed[triangles].all(axis=1), 0, np.where(tip[triangles].all(axis=1), 1, 2))
    return triangles[np.argsort(part, kind="stable")]


def _mask(n: int, vertices: Ints) -> np.ndarray:
    mask = np.zeros(n, dtype=bool)
    mask[vertices] = True
    return mask
