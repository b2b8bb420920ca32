"""What the optimiser's tests share: a case of 128 cells whose initial design reaches into the passive core."""

from __future__ import annotations

from typing import Any

from physics import LENGTH, RADIUS, Floats, half_cylinder, parameters

from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.regions.bounds import Regions
from actuator.solve.reduced import ReducedObjective
from actuator.terms.step import Metric

INTERFACE_WIDTH = 3.0


def small_domain() -> HalfCylinder:
    return half_cylinder(3, 2, 4)


def small_objective(
    domain: Domain | None = None,
    tolerance: float = 1e-8,
    *,
    threads: int = 1,
    regions: Regions | None = None,
    **changes: Any,
) -> ReducedObjective:
    """The paper's problem on a small mesh; ``changes`` are those of :func:`physics.parameters`."""
    return ReducedObjective(
        domain or small_domain(),
        *parameters(**changes),
        state_tolerance=tolerance,
        adjoint_tolerance=max(1e-3 * tolerance, 1e-12),
        threads=threads,
        regions=regions,
    )


def start_of(domain: Domain) -> Floats:
    """The initial design of Appendix C."""
    assert (domain.radius, domain.length) == (RADIUS, LENGTH)
    return domain.initial_design(domain.points, INTERFACE_WIDTH)


def metric_of(objective: ReducedObjective) -> Metric:
    return Metric(objective.discretisation, objective.objective, objective.design.gather, threads=1)
