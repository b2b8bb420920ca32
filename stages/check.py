"""Stage ``check``: whether a solid of any origin can be printed in SLA silicone and hold air as an actuator.

For printed silicone (Formlabs Silicone 40A Resin) no least wall, gap, angle or drain hole and no density were found, as
of November 2026. The defaults are those for rigid SLA resins, the more cautious ones where sources differ:

- "generic": Protolabs Network, hubs.com/knowledge-base/how-design-parts-sla-3d-printing; the same figures stand in
  addema.se/guides-sla;
- "Formlabs": formlabs.com/support/Design-specifications-for-3D-models-form-3 (Form 3) and
  formlabs.com/white-papers/form-4-design-guide (Form 4), both taken from summaries of September 2026, and
  all3dp.com/2/how-to-design-parts-for-sla-3d-printing of 12 March 2019 (Form 2).

docs/printing.md says what was read where.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from actuator.failure import EmptySolid, GridTooLarge, InvalidField
from actuator.geometry.directions import Direction
from stages import findings
from stages.findings import Check, Finding
from stages.settings import Section

if TYPE_CHECKING:
    from actuator.geometry.bodies import Shell
    from actuator.geometry.zero_set import Surface

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Settings(Section):
    """How the part is printed and what counts as too thin, too narrow or too flat."""

    direction: Direction = Field(
        "z", description="build direction, from the platform to the part; z is up where a slicer opens the file [-]"
    )
    on_platform: bool = Field(
        False, description="printed flat on the platform, which closes openings below, not on supports [-]"
    )
    axis: Literal["x", "y", "z"] = Field(
        "x", description="axis of the actuator; x is the X1 of this program's parts [-]"
    )
    wall: float = Field(
        0.4, gt=0, description="least wall; generic 0.4 if supported on two sides, Formlabs 0.2 for rigid resins [mm]"
    )
    gap: float = Field(
        0.5, gt=0, description="least gap; generic 0.5, Formlabs clearance 0.5 (Form 3), 0.4 (Form 4) [mm]"
    )
    angle: float = Field(
        19.0, gt=0, lt=90, description="least self-supporting angle from level; generic 19, Formlabs 10 [degrees]"
    )
    drain: float = Field(
        3.5, gt=0, description="least drain hole; generic 3.5, Formlabs 3.5 (Form 2), 2.5 (Form 3), 0.75 (Form 4) [mm]"
    )
    cup: float = Field(
        1.0, ge=0, description="least cup or closed cavity that counts, a small drop; chosen, none is published [mm³]"
    )
    density: float = Field(
        1.1, gt=0, description="of cured resin; liquid silicone rubber has 1.10 to 1.50 (simtec-silicone.com) [g/cm³]"
    )
    glue: float = Field(0.05, gt=0, description="depth that the glued plates enter the end faces; chosen [mm]")
    pitch: float = Field(0.2, gt=0, description="of the voxels; half of the least wall, so that none leaks [mm]")
    points: int = Field(
        20_000, ge=1, le=1_000_000, description="points on the surface where walls and gaps are measured [-]"
    )


@dataclass(frozen=True)
class Result:
    """What was found.

    Attributes:
        findings: one for each check, in the order of :class:`stages.findings.Check`.
        triangles: number of triangles after merging.
        size: of the bounding box, (3,), mm.
    """

    findings: tuple[Finding, ...]
    triangles: int
    size: tuple[float, float, float]

    @property
    def failed(self) -> tuple[str, ...]:
        """Names of the checks that the part fails."""
        return tuple(finding.name.value for finding in self.findings if finding.verdict == "fail")

    @property
    def passed(self) -> bool:
        """Whether no check failed; warnings are no failures."""
        return not self.failed

    @property
    def summary(self) -> str:
        """How many findings of each kind there are."""
        count = Counter(finding.verdict for finding in self.findings)
        return ", ".join(f"{count[verdict]} {verdict}" for verdict in ("pass", "warn", "fail", "not applicable"))


def run(vertices: Floats, triangles: Ints, settings: Settings) -> Result:
    """Make every check that the triangles allow.

    Args:
        vertices: (n, 3), mm; equal ones need not be merged.
        triangles: (m, 3), counter-clockwise seen from outside.
        settings: direction and thresholds.

    Raises:
        actuator.failure.InvalidField: if a coordinate is not finite.
        actuator.failure.EmptySolid: if there is no triangle with an area.
    """
    from actuator.geometry.bodies import shells  # scipy and manifold3d: only where it runs
    from actuator.geometry.flaws import flaws
    from actuator.geometry.solid import rounded

    if not np.isfinite(vertices).all():
        raise InvalidField("The part has coordinates that are not finite; export it again.")
    surface = rounded(vertices, triangles)
    if not len(surface.triangles):
        raise EmptySolid("The part has no triangle with an area; export it again.")
    parts = shells(surface)
    closed = findings.closed_surface(flaws(surface), len(surface.triangles), sum(shell.volume for shell in parts))
    if closed.verdict == "pass":
        others = _of_the_solid(surface, parts, settings)
    else:
        reason = "The triangles bound no solid."
        others = [findings.not_applicable(check, reason) for check in Check if check is not Check.CLOSED]
    x, y, z = np.ptp(surface.vertices, axis=0).tolist()
    return Result((closed, *others), len(surface.triangles), (x, y, z))


def _of_the_solid(surface: Surface, parts: list[Shell], settings: Settings) -> list[Finding]:
    """The checks of a closed surface, in order."""
    from actuator.geometry.chamber import leak, sealing
    from actuator.geometry.cups import cups
    from actuator.geometry.drains import pockets
    from actuator.geometry.overhangs import overhangs
    from actuator.geometry.rays import spread
    from actuator.geometry.thickness import thickness
    from actuator.geometry.voxels import voxelised

    grid = None
    try:
        grid = voxelised(surface, settings.pitch)
        held = cups(grid, settings.direction, on_platform=settings.on_platform)
        on_grid = [
            findings.cups(held, settings),
            findings.drain_holes(pockets(grid, settings.drain), settings),
        ]
    except GridTooLarge as error:
        on_grid = [findings.not_applicable(check, str(error)) for check in (Check.CUPS, Check.DRAINS)]
    points = spread(surface, settings.points)
    return [
        findings.one_body([shell for shell in parts if shell.volume > 0.0]),
        findings.closed_cavities([shell for shell in parts if shell.volume < 0.0], settings),
        *on_grid,
        findings.walls(thickness(surface, points, "wall", settings.wall), settings),
        findings.gaps(thickness(surface, points, "gap", settings.gap), settings),
        findings.overhangs(overhangs(surface, settings.direction, settings.angle), settings),
        findings.volume_and_mass(sum(shell.volume for shell in parts), settings),
        findings.air_chamber(
            sealing(surface, settings.axis, settings.glue), lambda: leak(grid, settings.axis) if grid else None
        ),
    ]
