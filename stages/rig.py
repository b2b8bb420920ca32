"""The test rig for a printed part: pressure, arm and spring by the paper's dimensional analysis (Section 4).

A design holds for any size and stiffness: with lengths scaled by R̄/R and stresses by Ē/E, pressures scale by Ē/E,
forces by Ē R̄²/(E R²), the spring by Ē R̄/(E R), and displacements by R̄/R.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from pydantic import Field

from stages.settings import ProblemSettings, Section

if TYPE_CHECKING:  # what computes nothing need not load NumPy
    import numpy as np
    from numpy.typing import NDArray

Values = TypeVar("Values", float, "NDArray[np.float64]")


class Settings(Section):
    """Material of the print, and the plate that serves as the spring."""

    youngs_modulus: float | None = Field(None, gt=0, description="Ē, initial Young's modulus of the print [N/mm²]")
    spring_thickness: float = Field(0.5, gt=0, description="thickness of the cantilever spring [mm]")
    spring_width: float = Field(12.7, gt=0, description="width of the cantilever spring [mm]")
    spring_modulus: float = Field(2.0e5, gt=0, description="Young's modulus of the cantilever spring [N/mm²]")


@dataclass(frozen=True)
class Result:
    """What to build and what to expect, for the whole actuator.

    Attributes:
        scale: R̄ / R.
        youngs_modulus: Ē, N/mm².
        lengths: of the part, by the keys of the section ``domain``, mm; of the half cylinder R̄ and L̄.
        arm_length: L̄_arm, mm.
        pressure: p̄_in, kPa.
        spring_stiffness: k̄_sp of the whole actuator, N/mm.
        spring_length: free length of the cantilever that has this stiffness, mm; infinite without a spring.
        spring_travel: of the spring's end at p̄_in, mm; None if no design has been evaluated.
        as_printed: whether that is what the exported part does, and not the optimised density field.
    """

    scale: float
    youngs_modulus: float
    lengths: dict[str, float]
    arm_length: float
    pressure: float
    spring_stiffness: float
    spring_length: float
    spring_travel: float | None
    as_printed: bool = False


def run(
    problem: ProblemSettings,
    scale: float,
    youngs_modulus: float,
    settings: Settings,
    elongation: float | None = None,
    *,
    as_printed: bool = False,
) -> Result:
    """Scale a case to a part and a material.

    Args:
        problem: the case as it was optimised.
        scale: R̄ / R.
        youngs_modulus: Ē, N/mm².
        settings: the spring's plate.
        elongation: of the spring in the units of the case, mm; its size is the travel.
        as_printed: whether that is of the exported part, and not of the optimised density field.
    """
    _, load, _ = problem.parameters()
    stiffer = youngs_modulus / problem.material.youngs_modulus
    pressure, travel = scaled(load.pressure, elongation or 0.0, problem, scale, youngs_modulus)
    # The model is half an actuator, or a whole one.
    stiffness = 2.0 / problem.domain.halves * load.spring_stiffness * stiffer * scale
    inertia = settings.spring_width * settings.spring_thickness**3 / 12.0
    # k = 3 E I / l³
    length = (3.0 * settings.spring_modulus * inertia / stiffness) ** (1.0 / 3.0) if stiffness > 0.0 else float("inf")
    return Result(
        scale=scale,
        youngs_modulus=youngs_modulus,
        lengths={key: scale * getattr(problem.domain, key) for key in problem.domain.lengths},
        arm_length=scale * load.arm_length,
        pressure=pressure,
        spring_stiffness=stiffness,
        spring_length=length,
        spring_travel=None if elongation is None else abs(travel),
        as_printed=as_printed,
    )


def scaled(
    pressure: Values, length: Values, problem: ProblemSettings, scale: float, youngs_modulus: float
) -> tuple[Values, Values]:
    """Pressures and displacements of a case as a part and a material show them.

    Args:
        pressure: N/mm², number or array.
        length: mm, number or array: displacement, travel or size.
        problem: the case as it was computed.
        scale: R̄ / R.
        youngs_modulus: Ē, N/mm².

    Returns:
        The pressure times Ē/E in kPa, and the length times R̄/R in mm.
    """
    return 1e3 * pressure * (youngs_modulus / problem.material.youngs_modulus), scale * length
