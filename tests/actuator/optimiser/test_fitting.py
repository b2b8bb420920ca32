"""The design that an optimisation between regions begins with lies within their bounds at the quadrature points."""

from __future__ import annotations

import numpy as np
from physics import half_cylinder
from small_case import INTERFACE_WIDTH, metric_of, small_objective, start_of

from actuator.optimiser.fitting import within_bounds
from actuator.regions.bounds import Region, Regions
from actuator.regions.shapes import Box, Cylinder

DOMAIN = half_cylinder(4, 2, 6)
PLATE = Box(np.array([0.0, -15.0, -15.0]), np.array([3.0, 15.0, 15.0]))
INLET = Cylinder(np.array([-1.0, 0.0, 0.0]), np.array([5.0, 0.0, 0.0]), 5.0)


def test_a_flange_with_its_hole_is_kept_at_the_points_too() -> None:
    regions = Regions(DOMAIN, [Region("solid", PLATE), Region("free", INLET), Region("void", INLET)])
    objective = small_objective(DOMAIN, regions=regions)
    passive, chi = objective.design.passive, regions.fitted(start_of(DOMAIN), INTERFACE_WIDTH)
    before = passive.room(chi).min()
    assert before < -0.5, "at the vertices the bounds are kept, between them they are not"
    found = within_bounds(objective, metric_of(objective), chi)
    assert passive.room(found).min() > 0.1 * before
    assert passive.missing(found) == passive.share(found) == 0.0


def test_without_regions_the_design_is_kept() -> None:
    objective = small_objective(DOMAIN, regions=Regions(DOMAIN, [Region("free", INLET)]))
    chi = start_of(DOMAIN)
    assert within_bounds(objective, metric_of(objective), chi) is chi
