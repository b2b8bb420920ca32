"""An optimised design as its artifact holds it, for drawing and reporting."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from actuator.arrays import Floats
from pipeline.case.model import Case, stored_case
from pipeline.store import artifact, contents

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.geometry.zero_set import Surface


@dataclass(frozen=True)
class Design:
    """A design and its state.

    Attributes:
        name: of the case.
        domain: the mesh of the optimisation.
        chi: χ at the vertices, (n_vertices,).
        pressure: p over the source pressure at the vertices, (n_vertices,).
        displacement: u at the vertices, (n_vertices, 3), mm.
        history: columns by name, one entry per design.
        summary: of the stage.
        case: as it was optimised.
        arm: rigid motion of the arm's root: T1, T3 in mm and θ2 in rad, (3,).
    """

    name: str
    domain: Domain
    chi: Floats
    pressure: Floats
    displacement: Floats
    history: dict[str, Floats]
    summary: dict[str, Any]
    case: Case
    arm: Floats

    @cached_property
    def shape(self) -> Surface:
        """The shape that refining and mirroring make of it, closed, in the size of the computation.

        Raises:
            actuator.failure.EmptySolid: if nothing is solid.
        """
        from pipeline.results.shape import shape_of  # the stages: only for what is drawn with the shape

        return shape_of(self)


def read_design(path: Path) -> Design:
    """Read the artifact of ``optimize``.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    domain, chi = contents.design(path, "optimize")
    pressure, displacement, arm = artifact.read(path, "optimize", "vertices/pressure", "nodes/displacement", "arm")
    contents.refuse_not_finite(path, "vertices/pressure", pressure)
    contents.refuse_not_finite(path, "nodes/displacement", displacement)
    case = stored_case(artifact.read_header(path).case_resolved, path)
    _, load, _ = case.optimize.parameters()
    return Design(
        case.name,
        domain,
        chi,
        pressure / load.pressure if load.pressure > 0.0 else pressure,
        displacement[: len(chi)],
        artifact.read_group(path, "optimize", "history"),
        contents.summary(path, "optimize"),
        case,
        arm,
    )
