"""The settings every stage shares: the sections of a case file that describe the physical problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field, field_validator

from actuator.equations.scheme import PressureElements, Scheme
from actuator.parameters import Load, Material, Objective
from stages.domains import AnyDomainSettings, HalfCylinderSettings
from stages.laws import AnyLawSettings, NeoHookeSettings
from stages.regions import AnyRegionSettings, regions_on
from stages.section import Instead, Section
from stages.units import rounded

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.regions.bounds import Bounds
    from stages.regions import Bodies

__all__ = ["LoadSettings", "MaterialSettings", "ObjectiveSettings", "ProblemSettings", "Section"]


class MaterialSettings(Section):
    """Porohyperelastic ersatz material (Section 2.1, Table 1)."""

    youngs_modulus: float = Field(2.736, gt=0, description="E, initial Young's modulus of the solid [N/mm²]")
    poisson_ratio: float = Field(0.48, gt=-1, lt=0.5, description="ν, initial Poisson's ratio of the solid [-]")
    ramp_penalty: float = Field(3.0, ge=0, description="p̂, RAMP penalisation [-]")
    stiffness_contrast: float = Field(1.0e-6, gt=0, lt=1, description="E0, void to solid stiffness [-]")
    void_permeability_rate: float = Field(1000.0, gt=0, description="k_v E / L² [1/s]")
    permeability_contrast: float = Field(1.0e-6, gt=0, lt=1, description="k_s / k_v [-]")
    hessian_regularisation: float = Field(1.0e-6, ge=0, description="α = c_r / (L² K_s) [-]")
    law: AnyLawSettings = Field(NeoHookeSettings(), description="hyperelastic law of the solid")


#: Largest spring ratio: a stiffer spring's force drowns in rounding, and this one is within 1e-7 of a held arm's end.
STIFFEST_SPRING = 1e6


class LoadSettings(Section):
    """Pressure, rigid arm and foundation spring, per half actuator (Table 1)."""

    instead: ClassVar[Mapping[str, Instead]] = {
        "pressure": Instead("pressure_ratio", "p_in of an actuator of material.youngs_modulus [kPa]"),
        "arm_length": Instead("arm_ratio", "L_arm, from the glued face [mm]"),
        "spring_stiffness": Instead("spring_ratio", "spring at the arm's end, of the whole actuator [N/mm]"),
    }

    pressure_ratio: float = Field(2.0e-2, ge=0, description="p_in / E [-]")
    arm_ratio: float = Field(4.0, gt=0, description="L_arm / R [-]")
    spring_ratio: float = Field(1.6e-2, ge=0, description="k_sp L_arm² / (E R³), up to 1e6 [-]")

    @field_validator("spring_ratio", mode="before")
    @classmethod
    def _not_infinite(cls, value: Any) -> Any:
        """Refuse a spring that does not give, and say what comes near it; YAML's infinity arrives as text."""
        infinite = isinstance(value, str) and value.lower().lstrip("+.") in ("inf", "infinity")
        if infinite or (isinstance(value, float | int) and value > STIFFEST_SPRING):
            raise ValueError(f"must be at most {STIFFEST_SPRING:g}; write 1.0e+6 for an arm whose end is held")
        return value


class ObjectiveSettings(Section):
    """Weights and limits of the objective (Eqs. 9 to 15, Appendix B)."""

    area_weight: float = Field(1.0e-3, ge=0, description="c_A, surface area [-]")
    slope_weight: float = Field(1.0, ge=0, description="c_i, interface width [-]")
    leak_weight: float = Field(1.0e6, ge=0, description="c_p, leaking pressure [-]")
    strain_energy_weight: float = Field(1.0e6, ge=0, description="c_Ψ, strain energy density [-]")
    passive_weight: float = Field(1.0e5, ge=0, description="weight of C_χ, passive void core [-]")
    strain_limit: float = Field(0.14, gt=0, description="sqrt(2 Ψ_lim / E), allowable strain [-]")
    strain_energy_shift: float | Literal["4/L_i", "8/L_i"] = Field(
        0.0,
        description="shift of χ in C_Ψ; 0 holds the limit in the material as it is, 4/L_i as Eq. (14) prints it [-]",
    )
    interface_width: float = Field(3.0, gt=0, description="L_i, void-solid interface width [mm]")
    diffusivity_length: float | None = Field(
        None, ge=0, description="L_t, design diffusivity length; left out, 5 L_i [mm]"
    )
    length_unit: float = Field(
        1.0, gt=0, description="what the paper's numbers with hidden units take for 1 mm; scale it with a case [mm]"
    )

    terms: dict[str, dict[str, float]] = Field({}, description="further terms of the objective and their parameters")

    @field_validator("terms")
    @classmethod
    def _known(cls, terms: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
        """Refuse terms that nobody registered, the paper's, which have keys of their own, and wrong parameters."""
        for name, parameters in terms.items():
            if fault := _fault_of_term(name, parameters):
                raise ValueError(fault)
        return terms


def _fault_of_term(name: str, parameters: dict[str, float]) -> str:
    """What is wrong with a further term, in a sentence without full stop; empty if nothing is."""
    from inspect import signature

    from actuator.terms import PAPER, TERMS  # numba: only for a case that has further terms

    known = [other for other in TERMS if other not in PAPER]
    if name not in known:
        listed = ", ".join(known) or "none; a program that has one registers it in actuator.terms.TERMS"
        return f"there is no further term '{name}'; there are {listed}"
    try:
        signature(TERMS[name]).bind(None, **parameters)
    except TypeError as error:
        wanted = ", ".join(list(signature(TERMS[name]).parameters)[1:])
        return f"the term '{name}' does not take these parameters ({error}); it has {wanted}"
    return ""


class ElementSettings(Section):
    """Finite elements."""

    pressure: PressureElements = Field(
        "fitted",
        description="of p: plain trilinear ones, with source and drainage summed by rows, or with k fitted as well",
    )

    def scheme(self) -> Scheme:
        """How the equations are discretised."""
        return Scheme(pressure=self.pressure)


class ProblemSettings(Section):
    """Everything that defines the optimisation problem: domain and its regions, material, load, objective, elements."""

    domain: AnyDomainSettings = HalfCylinderSettings()
    material: MaterialSettings = MaterialSettings()
    load: LoadSettings = LoadSettings()
    objective: ObjectiveSettings = ObjectiveSettings()
    elements: ElementSettings = ElementSettings()
    regions: list[AnyRegionSettings] = Field(
        [], description="parts of the domain that stay void or solid; a later one wins where it is free"
    )

    def ratios(self, quantities: Mapping[str, float]) -> dict[str, float]:
        """The ratios of :class:`LoadSettings` that quantities are in place of, for this domain and material.

        Args:
            quantities: by the keys of ``LoadSettings.instead``, in their units.
        """
        modulus, size, found = self.material.youngs_modulus, self.domain.size, {}
        if "pressure" in quantities:
            found["pressure_ratio"] = 1e-3 * quantities["pressure"] / modulus
        if "arm_length" in quantities:
            found["arm_ratio"] = quantities["arm_length"] / size
        if "spring_stiffness" in quantities:
            arm = size * found.get("arm_ratio", self.load.arm_ratio)
            found["spring_ratio"] = 0.5 * quantities["spring_stiffness"] * arm**2 / (modulus * size**3)
        return {key: rounded(value) for key, value in found.items()}

    def quantities(self) -> dict[str, float]:
        """What the ratios of the load are for this domain and material: the other way round."""
        load, modulus, size = self.load, self.material.youngs_modulus, self.domain.size
        arm = load.arm_ratio * size
        found = {
            "pressure": 1e3 * load.pressure_ratio * modulus,
            "arm_length": arm,
            "spring_stiffness": 2.0 * load.spring_ratio * modulus * size**3 / arm**2,
        }
        return {key: rounded(value) for key, value in found.items()}

    def bounds(self, domain: Domain, bodies: Bodies) -> Bounds | None:
        """Bounds on χ at the vertices of a domain that keep the regions in the part; None without regions.

        Args:
            domain: that of the case, or a finer one.
            bodies: what the files hold that regions name, by the number of the region.
        """
        if not self.regions:
            return None
        limits = self.objective
        return regions_on(domain, self.regions, bodies).bounds(
            domain.points, limits.interface_width, limits.length_unit
        )

    def parameters(self) -> tuple[Material, Load, Objective]:
        """The model's parameters in N, mm and s."""
        domain, objective = self.domain, self.objective
        material = Material.from_ratios(
            length=domain.length,
            interface_width=objective.interface_width,
            **self.material.model_dump(exclude={"law"}),
            law=self.material.law.build(),
        )
        load = Load.from_ratios(
            radius=domain.size, youngs_modulus=self.material.youngs_modulus, **self.load.model_dump()
        )
        load = replace(load, spring_stiffness=domain.halves * load.spring_stiffness)
        limits = Objective.from_strain_limit(youngs_modulus=self.material.youngs_modulus, **objective.model_dump())
        return material, load, limits
