"""The units in which a problem is computed: every case as the similar one of the paper's size and stiffness.

By dimensional analysis (Section 4 of arXiv:2605.20101) cases of any size, stiffness and permeability with the same
ratios have the same solution. They are computed with a domain of the paper's size, the paper's Young's modulus and its
drainage, so that forces and moments, millimetres and radians, equations of force and of flow have the same weights in
every norm, and similar cases take the same way to the last bits; the paper's own case is computed in N and mm as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from actuator.parameters import drainage_ratio

if TYPE_CHECKING:
    from stages.settings import ProblemSettings

#: R (mm), E (N/mm²), L_i (mm), k_v E / L² (1/s) and k_s / k_v of Table 1, with L = R.
SIZE, STIFFNESS, WIDTH, RATE, CONTRAST = 15.0, 2.736, 3.0, 1000.0, 1.0e-6


@dataclass(frozen=True)
class Units:
    """What results count in.

    Attributes:
        length: mm.
        stress: N/mm².
    """

    length: float
    stress: float


def similar(problem: ProblemSettings) -> tuple[ProblemSettings, Units]:
    """The similar problem of the paper's size, stiffness and drainage, and the units that its numbers count in."""
    units = Units(problem.domain.size / SIZE, problem.material.youngs_modulus / STIFFNESS)
    scaled = problem.in_units(units.length, units.stress)
    material, width = scaled.material, scaled.objective.interface_width
    # Permeability and drainage enter Eq. (5) by their ratios alone: a factor on both is a unit of time.
    papers = drainage_ratio(WIDTH) * CONTRAST * (RATE * SIZE**2 / STIFFNESS)
    void = material.void_permeability_rate * scaled.domain.length**2 / STIFFNESS
    own = drainage_ratio(width) * material.permeability_contrast * void
    rate = material.void_permeability_rate * (papers / own)
    return scaled.model_copy(update={"material": material.model_copy(update={"void_permeability_rate": rate})}), units
