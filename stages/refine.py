"""Stage ``refine``: the design on a finer mesh, smoothed by the Helmholtz filter (Section 4, Eq. 17)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from pydantic import Field

from actuator.arrays import Floats
from actuator.geometry.zero_set import check_field
from stages.datasets import HEXAHEDRON, Dataset, GridPaths, Packed, corners, design, of_domain
from stages.events import Message, Observer, silent
from stages.regions import pack_bounds, unpack
from stages.settings import Section
from stages.task import Need, Task

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.regions.bounds import Bounds

VERSION = 2


class Settings(Section):
    """Finer mesh and filter (Section 4 of the paper: factor 2 and r = 0.1 mm)."""

    factor: int = Field(2, ge=1, le=8, description="cells of the finer mesh per cell and direction [-]")
    filter_radius: float = Field(0.1, ge=0, description="r, radius of the Helmholtz filter [mm]")


@dataclass(frozen=True)
class Result:
    """The filtered design on the finer mesh.

    Attributes:
        domain: the finer domain, new vertices on its exact boundary.
        chi: χ̄ at its vertices, (n_vertices,), dimensionless.
        bounds: what keeps regions of the case in the part, at its vertices; None without regions.
    """

    domain: Domain
    chi: Floats
    bounds: Bounds | None = None


def needs(case: Any) -> Need:
    """Least memory for the finer mesh and its surface; measured on 1,080 to 135,000 cells."""
    cells = case.domain.cells * case.refine.factor**3
    return Need(cells, (0.07 + 5.8e-6 * cells) * 2.0**30, "lower refine.factor")


def run(
    domain: Domain,
    chi: Floats,
    settings: Settings,
    observer: Observer = silent,
    bounds_on: Callable[[Domain], Bounds | None] | None = None,
) -> Result:
    """Refine and filter a design. Factor 1 keeps the domain and radius 0 keeps the field, as the same objects.

    Regions of the case are kept: neither interpolation nor filter moves their surfaces.

    Args:
        domain: the mesh of the optimisation.
        chi: χ at its vertices, (n_vertices,), dimensionless.
        settings: factor and filter radius.
        observer: receives a message with the range of the filtered field.
        bounds_on: the bounds of the case's regions on a domain.

    Raises:
        actuator.failure.InvalidField: if χ has the wrong size or is not finite.
        actuator.failure.SolveFailure: if the filter's system is not solved.
    """
    from actuator.equations.helmholtz import helmholtz_filter  # scikit-fem: only where it runs

    check_field(chi, domain.mesh.nvertices)
    if settings.factor > 1:
        chi = domain.prolongation(settings.factor) @ chi
        domain = domain.refined(settings.factor)
    chi = helmholtz_filter(domain.mesh, chi, settings.filter_radius)
    bounds = bounds_on(domain) if bounds_on else None
    if bounds:
        chi = bounds.kept(chi)
    observer(Message(f"{domain.mesh.nelements} cells, filtered χ from {chi.min():.3g} to {chi.max():.3g}"))
    return Result(domain, chi, bounds)


def start(task: Task) -> Result:
    """Refine the optimised design of a case."""
    problem = task.case.optimize
    bodies = unpack(task.upstream, problem.regions)
    return run(*design(task.upstream), task.case.refine, task.observer, lambda domain: problem.bounds(domain, bodies))


def pack(result: Result) -> Packed:
    """The finer mesh and the filtered design."""
    from scipy.special import expit  # slow to load: only where there is a design to store

    domain = result.domain
    datasets = {
        "vertices/points": Dataset(domain.points, "mm", "vertices of the finer mesh"),
        "vertices/connectivity": corners(domain),
        "vertices/chi": Dataset(result.chi, "1", "filtered design field at the vertices"),
        "vertices/density": Dataset(expit(result.chi), "1", "density rho = 1 / (1 + exp(-chi)), Eq. (1)"),
        **pack_bounds(result.bounds),
        **of_domain(domain),
    }
    fields = {name: f"/vertices/{name}" for name in ("chi", "density")}
    grid = GridPaths("/vertices/points", "/vertices/connectivity", HEXAHEDRON, fields)
    return Packed({"cells": domain.mesh.nelements}, datasets, grid)
