"""The units in which a problem is computed: every case as the similar one of the paper's size and stiffness.

By dimensional analysis (Section 4 of arXiv:2605.20101) cases of any size, stiffness and permeability with the same
ratios have the same solution. They are computed with a domain of the paper's size, the paper's Young's modulus and its
drainage, so that forces and moments, millimetres and radians, equations of force and of flow have the same weights in
every norm, and similar cases take the same way to the last bits; the paper's own case is computed in N and mm as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

from actuator.parameters import Material
from stages.settings import ProblemSettings

#: The paper's case, Table 1: what the keys of a case are if they are left out.
PAPER = ProblemSettings()


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
    units = Units(
        problem.domain.size / PAPER.domain.size, problem.material.youngs_modulus / PAPER.material.youngs_modulus
    )
    scaled = problem.in_units(units.length, units.stress)
    # Permeability and drainage enter Eq. (5) by their ratios alone: a factor on both is a unit of time.
    rate = scaled.material.void_permeability_rate * (_material(PAPER).drainage / _material(scaled).drainage)
    return scaled.model_copy(
        update={"material": scaled.material.model_copy(update={"void_permeability_rate": rate})}
    ), units


def _material(problem: ProblemSettings) -> Material:
    return problem.parameters()[0]
