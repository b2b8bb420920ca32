"""The closed boundary of the whole solid of a design, also where a half of it is modelled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.domains.tetrahedra import Tetrahedra
from actuator.failure import EmptySolid
from actuator.geometry.outer_triangles import outer_triangles
from actuator.geometry.zero_set import Surface, check_field, reflected, solid_boundary


class Whole(NamedTuple):
    """A closed surface.

    Attributes:
        surface: of the whole solid.
        half_triangles: how many of its triangles, the first ones, belong to the part that is modelled.
        plane_vertices: how many of its vertices lie on the symmetry plane and belong to both halves; 0 without one.
    """

    surface: Surface
    half_triangles: int
    plane_vertices: int


def whole_boundary(domain: Domain, tetrahedra: Tetrahedra, chi: Floats, threshold: float) -> Whole:
    """The boundary of {χ > threshold}, closed at the domain's surface, and mirrored if the domain is a half.

    Args:
        domain: the meshed domain.
        tetrahedra: :meth:`Domain.tetrahedra`, in which χ is linear.
        chi: χ at its vertices, (n_vertices,), dimensionless.
        threshold: level of the surface.

    Raises:
        actuator.failure.InvalidField: if χ has the wrong size or is not finite.
        actuator.failure.EmptySolid: if χ is nowhere above the threshold.
    """
    check_field(chi, domain.mesh.nvertices)
    if not np.any(chi > threshold):
        raise EmptySolid(
            f"Nothing is solid: χ is at most {chi.max():.3g} and the threshold is {threshold:.3g}; "
            "lower the threshold or use a design with material."
        )
    corners = tetrahedra.corners
    part = solid_boundary(domain.points, corners, outer_triangles(domain, corners), chi, threshold)
    if not domain.mirrored:
        return Whole(part, len(part.triangles), 0)
    return Whole(reflected(part), len(part.triangles), int(np.count_nonzero(part.vertices[:, 1] == 0.0)))
