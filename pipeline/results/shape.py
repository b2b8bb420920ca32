"""The printed shape of a design, with what its computation says about the surface: pressure and displacement."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scipy.special import expit

import stages.mirror
import stages.refine
from actuator.arrays import Floats
from actuator.geometry.sampling import sampled
from actuator.geometry.zero_set import Surface
from stages.datasets import vtk_order

if TYPE_CHECKING:
    from pipeline.results.design import Design


def shape_of(design: Design) -> Surface:
    """The shape that refining and mirroring make of a design, closed, in the size of the computation.

    Raises:
        actuator.failure.EmptySolid: if nothing is solid.
    """
    fine = stages.refine.run(design.domain, design.chi, design.case.refine)
    whole = stages.mirror.run(fine.domain, fine.chi, design.case.mirror)
    return Surface(whole.vertices, whole.triangles)


def fields_at(design: Design, points: Floats) -> tuple[dict[str, Floats], Floats]:
    """The state of a design on its shape.

    The fields are first carried to the refined mesh, whose wall the shape lies on: beside the chords of the coarse
    mesh's wall there is nothing to interpolate in.

    Args:
        design: the design.
        points: of its shape, (n, 3), mm.

    Returns:
        ``pressure`` over the source pressure and ``density``, (n,) each, and the displacement, (n, 3), mm.
    """
    factor = design.case.refine.factor
    fine, carry = design.domain.refined(factor), design.domain.prolongation(factor)
    fields = {"pressure": carry @ design.pressure, "density": expit(carry @ design.chi)}
    cells, moved = fine.cells[:, vtk_order()[:8]], carry @ design.displacement
    return sampled(fine.points, cells, points, fields, moved, mirrored=fine.mirrored)
