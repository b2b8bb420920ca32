"""The section ``initial``: which design the optimisation begins with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np
from pydantic import Field, model_validator

from actuator.failure import InvalidSettings
from actuator.geometry.printing.directions import Axis
from stages.section import Section

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from actuator.domains.interface import Domain
    from actuator.geometry.zero_set import Surface
    from stages.settings import ProblemSettings

    #: What a file holds: the domain of another result and χ at its vertices, (n,), or a closed surface in mm.
    Given = tuple[Domain, Floats] | Surface

#: |χ| of what is given by its surface, a width L_i / 2 away from it and beyond: ρ is 0.982 or 0.018 there. So steep an
#: interface is what C_i allows, and from so little void or solid the optimiser still comes back.
DEEP = 4.0


class InitialSettings(Section):
    """The design to begin with; without any of these keys that of Appendix C, a tube from 0.45 R to 0.95 R."""

    wall: float | None = Field(None, gt=0, description="thickness of a wall around a chamber to begin with [mm]")
    file: str | None = Field(
        None,
        min_length=1,
        description="or a file: another case's NAME.h5 or NAME.refined.h5, or a part as STL or 3MF; "
        "seen from the case file's folder",
    )
    scale: float | None = Field(
        None, gt=0, description="size of the part in the file over size of the domain; by their lengths if left out [-]"
    )
    axis: Axis | None = Field(None, description="axis of the part in the file; x if left out [-]")
    sha256: str | None = Field(
        None, pattern="^[0-9a-f]{64}$", description="what the file must hold; found by the program if left out"
    )

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if self.wall is not None and self.file is not None:
            raise ValueError("has both 'wall' and 'file'; write one of the two")
        if self.file is None and (lost := [key for key in ("scale", "axis", "sha256") if getattr(self, key)]):
            raise ValueError(f"has '{lost[0]}' but no 'file' that it is about; write 'file' or remove it")
        return self

    @property
    def own(self) -> bool:
        """Whether the design to begin with is the domain's own."""
        return self.wall is None and self.file is None


def first_design(settings: InitialSettings, problem: ProblemSettings, given: Given | None) -> Floats | None:
    """χ to begin with at the vertices of the case's mesh, (n_vertices,); None where it is the domain's own.

    Args:
        settings: of the section.
        problem: domain and interface width, in the units of the case.
        given: what the file holds.

    Raises:
        actuator.failure.InvalidSettings: if the wall leaves no chamber, or nothing of what is given lies in the domain.
        actuator.failure.NotManifold: if the triangles that the file holds bound no solid.
    """
    if settings.own:
        return None
    from actuator.geometry.transfer import around_chamber, interpolated, of_solid  # VTK: only where it is wanted
    from stages.chambers import posed
    from stages.check.soundness import sound

    domain, limits = posed(problem), problem.objective
    if settings.wall is not None:
        if problem.load.chambers:
            raise InvalidSettings(
                "initial.wall: a wall along the outside leaves one chamber, and load.chambers has several; remove it "
                "to begin with walls between them."
            )
        if settings.wall >= domain.size:
            raise InvalidSettings(
                f"initial.wall: a wall of {settings.wall:g} mm leaves no chamber in a domain of {domain.size:g} mm; "
                "write less."
            )
        inside = around_chamber(domain, settings.wall)
    elif given is None:
        raise InvalidSettings(f"initial.file: {settings.file} was not read; give the design or the part it holds.")
    elif isinstance(given, tuple):
        return interpolated(*given, domain)
    else:
        solid = sound(given.vertices, given.triangles).surface
        inside = of_solid(solid, domain, settings.axis or "x", settings.scale)
        if not (inside > 0.0).any():
            raise InvalidSettings(
                f"initial.file: no vertex of the mesh lies in the solid of {settings.file}; mind initial.scale and "
                "initial.axis, or take a finer mesh."
            )
    chi = np.clip(2.0 * DEEP / limits.interface_width * inside, -DEEP, DEEP)
    bound = domain.passive_bound(domain.points, limits.interface_width, limits.length_unit)
    return np.minimum(chi, bound)
