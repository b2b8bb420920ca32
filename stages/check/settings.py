"""Settings of the checks: how the part is printed, and what counts as too thin, too narrow or too flat.

For printed silicone (Formlabs Silicone 40A Resin) no least wall, gap, angle or drain hole and no density were found, as
of November 2026. The defaults are those for rigid SLA resins, the more cautious ones where sources differ:

- "generic": Protolabs Network, hubs.com/knowledge-base/how-design-parts-sla-3d-printing; the same figures stand in
  addema.se/guides-sla;
- "Formlabs": formlabs.com/support/Design-specifications-for-3D-models-form-3 (Form 3) and
  formlabs.com/white-papers/form-4-design-guide (Form 4), both taken from summaries of September 2026, and
  all3dp.com/2/how-to-design-parts-for-sla-3d-printing of 12 March 2019 (Form 2).

docs/use/printing.md says what was read where.
"""

from __future__ import annotations

from pydantic import Field

from actuator.geometry.printing.directions import Axis, Direction
from stages.section import Section


class Settings(Section):
    """How the part is printed and what counts as too thin, too narrow or too flat."""

    direction: Direction = Field(
        "z", description="build direction, from the platform to the part; z is up where a slicer opens the file [-]"
    )
    on_platform: bool = Field(
        False, description="printed flat on the platform, which closes openings below, not on supports [-]"
    )
    axis: Axis = Field("x", description="axis of the actuator; x is the X1 of this program's parts [-]")
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
