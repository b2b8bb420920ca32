"""The test rig for a printed part: pressure, arm and spring by the paper's dimensional analysis (Section 4).

A design holds for any size and stiffness: with lengths scaled by R̄/R and stresses by Ē/E, pressures scale by Ē/E,
forces by Ē R̄²/(E R²), the spring by Ē R̄/(E R), and displacements by R̄/R.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

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


#: Standard gravity, m/s², and the weights that the paper's cantilever is calibrated with (Appendix E), g.
GRAVITY, WEIGHTS = 9.80665, (10, 20, 50, 70, 100)


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

    @property
    def calibration(self) -> dict[int, float]:
        """Deflection of the spring's end under each of :data:`WEIGHTS`, mm; empty without a spring."""
        stiffness = self.spring_stiffness
        return {weight: 1e-3 * weight * GRAVITY / stiffness for weight in WEIGHTS} if stiffness else {}


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


@dataclass(frozen=True)
class RigUnits:
    """What turns numbers of a case into those of its part on the test rig; every place that tells of both uses it.

    Attributes:
        problem: the case as it was computed.
        scale: R̄ / R.
        youngs_modulus: Ē, N/mm²; that of the case where nobody says what is printed.
    """

    problem: ProblemSettings
    scale: float
    youngs_modulus: float

    @property
    def stress(self) -> float:
        """Ē / E."""
        return self.youngs_modulus / self.problem.material.youngs_modulus

    @property
    def same(self) -> bool:
        """Whether the part has the size and the stiffness of the case."""
        return self.scale == 1.0 and self.stress == 1.0

    @property
    def pressure(self) -> float:
        """p̄_in, kPa."""
        return self.kilopascals(self.problem.parameters()[1].pressure)

    def scaled(self, pressure: Values, length: Values) -> tuple[Values, Values]:
        """Pressures in kPa and lengths in mm of the part; see :func:`scaled`."""
        return scaled(pressure, length, self.problem, self.scale, self.youngs_modulus)

    def kilopascals(self, pressure: float) -> float:
        """A pressure of the case, N/mm², as that of the part, kPa."""
        return self.scaled(pressure, 0.0)[0]

    def millimetres(self, length: float) -> float:
        """A length of the case, mm, as that of the part, mm."""
        return self.scaled(0.0, length)[1]

    def newtons(self, force: float) -> float:
        """A force of the case, N, as that of the part, N."""
        return self.stress * self.scale**2 * force

    def both_lengths(self, length: float, digits: int) -> str:
        """A length of the case, and that of the part where it is another."""
        text, part = f"{length:.{digits}f} mm", f"{self.millimetres(length):.{digits}f} mm"
        return text if self.scale == 1.0 else f"{text}, of the part {part}"

    def both_pressures(self, pressure: float) -> str:
        """A pressure of the case, N/mm², in kPa, and that of the part where it is another."""
        text, part = f"{1e3 * pressure:.3g} kPa", f"{self.kilopascals(pressure):.3g} kPa"
        return text if self.stress == 1.0 else f"{text}, of the part {part}"

    def of_part(self) -> str:
        """What the part is, and its pressure."""
        return f"scale {self.scale:.6g}, Young's modulus {self.youngs_modulus:g} N/mm²: p_in {self.pressure:.3g} kPa"

    def columns(self, curve: Mapping[str, Any]) -> dict[str, Any]:
        """Columns for a table of a curve, with their units, as the rig shows them."""
        found = {"rig_pressure [kPa]": self.scaled(curve["pressure"], curve["T3"])[0]}
        for name in ("elongation", "T1", "T3"):
            found[f"rig_{name} [mm]"] = self.scaled(curve["pressure"], curve[name])[1]
        return found
