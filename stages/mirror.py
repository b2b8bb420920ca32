"""Stage ``mirror``: the closed surface of the whole solid; where a half is modelled, reflected across X2 = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydantic import Field

from actuator.arrays import Floats, Ints
from stages.datasets import TRIANGLE, Dataset, GridPaths, Packed, design
from stages.events import Message, Observer, silent
from stages.refine import needs
from stages.regions import stored_bounds
from stages.settings import Section
from stages.task import Task

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.geometry.hausdorff import Distance
    from actuator.regions.bounds import Bounds

__all__ = ["VERSION", "Result", "Settings", "needs", "pack", "run", "start"]

VERSION = 2


class Settings(Section):
    """What counts as solid."""

    threshold: float = Field(0.0, description="solid where χ is above this value [-]")


@dataclass(frozen=True)
class Result:
    """The closed boundary of the solid in the whole domain.

    Attributes:
        vertices: (n_vertices, 3), mm; of a mirrored domain symmetric about X2 = 0 to the last bit.
        triangles: vertex numbers, (n_triangles, 3), counter-clockwise seen from outside.
        half_triangles: how many of the triangles, the first ones, belong to the part that is modelled.
        plane_vertices: how many vertices lie on the symmetry plane and belong to both halves; 0 without one.
        distance: between the surface inside the domain and the zero set of the trilinear field, sampled, mm.
    """

    vertices: Floats
    triangles: Ints
    half_triangles: int
    plane_vertices: int
    distance: Distance


def run(
    domain: Domain, chi: Floats, settings: Settings, observer: Observer = silent, bounds: Bounds | None = None
) -> Result:
    """Extract the boundary of {χ > threshold}, closed at the domain's surface, and mirror it if the domain is a half.

    Args:
        domain: the meshed domain.
        chi: χ at its vertices, (n_vertices,), dimensionless.
        settings: the threshold.
        observer: receives messages with the size of the surface and its distance to the field's zero set.
        bounds: of the case's regions, which are kept whatever the threshold.

    Raises:
        actuator.failure.InvalidField: if χ has the wrong size or is not finite.
        actuator.failure.EmptySolid: if χ is nowhere above the threshold.
    """
    # scikit-fem and SciPy: only where it runs
    from actuator.geometry.hausdorff import distance_to_zero_set
    from actuator.geometry.whole import whole_boundary

    if bounds:
        chi = bounds.kept(chi, settings.threshold)
    tets = domain.tetrahedra()
    surface, half, on_plane = whole_boundary(domain, tets, chi, settings.threshold)
    shared = f", {on_plane} vertices shared on the symmetry plane" if domain.mirrored else ""
    observer(Message(f"{len(surface.triangles)} triangles{shared}"))
    distance = distance_to_zero_set(domain, tets, chi, settings.threshold)
    observer(Message(f"{distance.maximum:.2g} mm off the field's zero set at most, {distance.rms:.2g} mm rms"))
    return Result(surface.vertices, surface.triangles, half, on_plane, distance)


def start(task: Task) -> Result:
    """Extract the solid from the refined design of a case."""
    bounds = stored_bounds(task.upstream, task.case.regions)
    return run(*design(task.upstream), task.case.mirror, task.observer, bounds)


def pack(result: Result) -> Packed:
    """The closed surface of the whole solid."""
    triangles = result.triangles.astype(np.int64).ravel()
    datasets = {
        "surface/points": Dataset(result.vertices, "mm", "vertices of the solid's surface"),
        "surface/connectivity": Dataset(triangles, "1", "vertices of the triangles, 3 each, outward normals"),
    }
    summary = {
        "triangles": len(result.triangles),
        "hausdorff_mm": result.distance.maximum,
        "rms_distance_mm": result.distance.rms,
    }
    return Packed(summary, datasets, GridPaths("/surface/points", "/surface/connectivity", TRIANGLE, {}))
