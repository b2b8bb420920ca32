"""Making the checks: what is measured, and in which order."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.failure import GridTooLarge
from stages.check import findings
from stages.check.findings import Check, Finding
from stages.check.settings import Settings
from stages.check.soundness import examined

if TYPE_CHECKING:
    from actuator.geometry.bodies import Shell
    from actuator.geometry.printing.voxels import Voxels
    from actuator.geometry.zero_set import Surface


@dataclass(frozen=True)
class Result:
    """What was found.

    Attributes:
        findings: one for each check, in the order of :class:`stages.check.findings.Check`.
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
    found = examined(vertices, triangles)
    surface = found.surface
    if found.crossings:
        others = [found.crossings, *_of_the_solid(surface, found.shells, settings)]
    else:
        reason = "The triangles bound no solid."
        others = [findings.not_applicable(check, reason) for check in Check if check is not Check.CLOSED]
    x, y, z = np.ptp(surface.vertices, axis=0).tolist()
    return Result((found.closed, *others), len(surface.triangles), (x, y, z))


def _of_the_solid(surface: Surface, parts: list[Shell], settings: Settings) -> list[Finding]:
    """The checks of a closed surface, in order."""
    from actuator.geometry.printing.cups import cups
    from actuator.geometry.printing.drains import pockets
    from actuator.geometry.printing.overhangs import overhangs
    from actuator.geometry.printing.rays import spread
    from actuator.geometry.printing.thickness import thickness
    from actuator.geometry.printing.voxels import voxelised

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
        _air_chamber(surface, settings, lambda: grid),
    ]


def air_chamber(surface: Surface, settings: Settings) -> Finding:
    """Whether a solid holds air with plates on both ends, and where it gets out if not.

    Args:
        surface: closed, oriented 2-manifold.
        settings: axis, glue and the pitch of the voxels on which a leak is looked for.
    """
    from actuator.geometry.printing.voxels import voxelised

    def grid() -> Voxels | None:
        try:
            return voxelised(surface, settings.pitch)
        except GridTooLarge:
            return None

    return _air_chamber(surface, settings, grid)


def _air_chamber(surface: Surface, settings: Settings, grid: Callable[[], Voxels | None]) -> Finding:
    from actuator.geometry.printing.chamber import Leak, leak, sealing

    def place() -> Leak | None:
        voxels = grid()
        return leak(voxels, settings.axis) if voxels else None

    return findings.air_chamber(sealing(surface, settings.axis, settings.glue), place)
