"""The settings every stage shares: the sections of a case file that describe the physical problem."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from actuator.equations.scheme import PressureElements, Scheme
from actuator.parameters import Load, Material, Objective
from stages.domains import AnyDomainSettings, HalfCylinderSettings
from stages.goals import Goals, goal_of
from stages.laws import AnyLawSettings, NeoHookeSettings
from stages.regions import AnyRegionSettings, regions_on
from stages.section import Instead, Section
from stages.units import rounded

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.load_case import LoadCase
    from actuator.regions.bounds import Bounds
    from actuator.terms.goals.interface import Goal
    from stages.regions import Bodies

__all__ = ["LoadCaseSettings", "LoadSettings", "MaterialSettings", "ObjectiveSettings", "ProblemSettings", "Section"]


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


def _nothing(value: Any) -> bool:
    """Whether a key says nothing: results from before it was known keep their content keys."""
    return not value


def _gives(value: Any) -> Any:
    """Refuse a spring that does not give, and say what comes near it; YAML's infinity arrives as text."""
    infinite = isinstance(value, str) and value.lower().lstrip("+.") in ("inf", "infinity")
    if infinite or (isinstance(value, float | int) and value > STIFFEST_SPRING):
        raise ValueError(f"must be at most {STIFFEST_SPRING:g}; write 1.0e+6 for an arm whose end is held")
    return value


#: Names of load cases and chambers, which become names of columns and data sets.
Name = Annotated[str, Field(max_length=30, pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]
Ratio = Annotated[float, Field(ge=0)]


class ChamberSettings(Section):
    """One of several chambers: a channel along X1 that is kept void and brings in air of a pressure of its own."""

    name: Name = Field(description="of the chamber")
    centre: list[float] = Field(min_length=2, max_length=2, description="X2 and X3 of the channel's axis [mm]")
    radius: float = Field(gt=0, description="of the channel; the air comes in within half of it [mm]")
    pressure_ratio: float | None = Field(None, ge=0, description="p / E; left out, that of load [-]")

    def overlaps(self, other: ChamberSettings) -> bool:
        """Whether two channels have a place in common."""
        return math.dist(self.centre, other.centre) <= self.radius + other.radius


class LoadCaseSettings(Section):
    """One of several load cases; what it leaves out is that of `load`."""

    instead: ClassVar[Mapping[str, Instead]] = {
        "pressure": Instead("pressure_ratio", "p_in of an actuator of material.youngs_modulus [kPa]"),
        "spring_stiffness": Instead("spring_ratio", "spring at the arm's end, of the whole actuator [N/mm]"),
    }

    name: Name = Field(description="by which results are told apart")
    weight: float = Field(1.0, gt=0, description="factor on its C0; its leak and strain limit count whole [-]")
    pressure_ratio: float | None = Field(None, ge=0, description="p_in / E; left out, that of load [-]")
    spring_ratio: float | None = Field(None, ge=0, description="k_sp L_arm² / (E R³); left out, that of load [-]")

    force_ratio: list[float] | None = Field(
        None,
        min_length=3,
        max_length=3,
        description="F / (E R²), dead force at the arm's end; left out, that of load [-]",
    )
    chambers: dict[str, Ratio] = Field(
        {}, description="p / E by the name of the chamber, where there are several; one left out is open to the outside"
    )
    goal: Goals = Field(
        None,
        min_length=1,
        exclude_if=_nothing,
        description="what its C0 is, one goal or a list; left out, that of objective",
    )

    _spring = field_validator("spring_ratio", mode="before")(_gives)

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if self.chambers and self.pressure_ratio is not None:
            raise ValueError("has both 'pressure_ratio' and 'chambers'; write one of the two")
        return self


class LoadSettings(Section):
    """Pressure, rigid arm and foundation spring, per half actuator (Table 1); several chambers and load cases."""

    instead: ClassVar[Mapping[str, Instead]] = {
        "pressure": Instead("pressure_ratio", "p_in of an actuator of material.youngs_modulus [kPa]"),
        "arm_length": Instead("arm_ratio", "L_arm, from the glued face [mm]"),
        "spring_stiffness": Instead("spring_ratio", "spring at the arm's end, of the whole actuator [N/mm]"),
    }

    pressure_ratio: float = Field(2.0e-2, ge=0, description="p_in / E [-]")
    arm_ratio: float = Field(4.0, gt=0, description="L_arm / R [-]")
    spring_ratio: float = Field(1.6e-2, ge=0, description="k_sp L_arm² / (E R³), up to 1e6 [-]")

    force_ratio: list[float] | None = Field(
        None,
        min_length=3,
        max_length=3,
        exclude_if=_nothing,
        description="F / (E R²), dead force on the whole actuator at the arm's end, along X1, X2 and X3 [-]",
    )
    chambers: list[ChamberSettings] = Field(
        [],
        exclude_if=_nothing,
        description="several chambers that stay apart, in place of the domain's own inlet",
    )
    cases: list[LoadCaseSettings] = Field(
        [],
        exclude_if=_nothing,
        description="several load cases in place of one; the first one is what a design is shown in",
    )

    _spring = field_validator("spring_ratio", mode="before")(_gives)

    @field_validator("chambers")
    @classmethod
    def _apart(cls, chambers: list[ChamberSettings]) -> list[ChamberSettings]:
        if twice := _twice(chambers):
            raise ValueError(f"two chambers are called '{twice}'; give each a name of its own")
        for one, other in combinations(chambers, 2):
            if one.overlaps(other):
                raise ValueError(
                    f"'{one.name}' and '{other.name}' are joined: their channels overlap; move them apart or make them "
                    "thinner"
                )
        return chambers

    @field_validator("cases")
    @classmethod
    def _told_apart(cls, cases: list[LoadCaseSettings], info: ValidationInfo) -> list[LoadCaseSettings]:
        if twice := _twice(cases):
            raise ValueError(f"two load cases are called '{twice}'; give each a name of its own")
        known = [chamber.name for chamber in info.data.get("chambers", [])]
        for case in cases:
            if unknown := next((name for name in case.chambers if name not in known), None):
                there = f"there are {', '.join(known)}" if known else "load.chambers has none"
                raise ValueError(f"load case '{case.name}' has a chamber '{unknown}', and {there}; write one of these")
        return cases

    @property
    def pressure_ratios(self) -> list[float]:
        """p / E of every chamber; none where there is no more than the domain's own."""
        return [self.pressure_ratio if each.pressure_ratio is None else each.pressure_ratio for each in self.chambers]

    def only(self, case: LoadCaseSettings) -> LoadSettings:
        """The load of one of the cases, as that of a section without cases."""
        own: dict[str, Any] = {
            key: value
            for key in ("pressure_ratio", "spring_ratio", "force_ratio")
            if (value := getattr(case, key)) is not None
        }
        chambers = self.chambers
        if case.chambers:
            ratios = [case.chambers.get(each.name, 0.0) for each in chambers]
            own["pressure_ratio"] = max(ratios)
        else:
            ratios = [own.get("pressure_ratio", each) for each in self.pressure_ratios]
        own["chambers"] = [
            each.model_copy(update={"pressure_ratio": ratio}) for each, ratio in zip(chambers, ratios, strict=True)
        ]
        return self.model_copy(update={**own, "cases": []})


def _twice(named: Sequence[ChamberSettings] | Sequence[LoadCaseSettings]) -> str | None:
    """A name that two of them have."""
    names = [each.name for each in named]
    return next((name for name in names if names.count(name) > 1), None)


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

    goal: Goals = Field(
        None,
        min_length=1,
        exclude_if=_nothing,
        description="what C0 is, one goal or a list; left out, bending as in Eq. (9)",
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

    @property
    def leading(self) -> Self:
        """The same problem under its first load case alone; without load cases the problem itself."""
        return self.under(self.load.cases[0]) if self.load.cases else self

    def under(self, case: LoadCaseSettings) -> Self:
        """The same problem under one of its load cases alone."""
        objective = self.objective if case.goal is None else self.objective.model_copy(update={"goal": case.goal})
        return self.model_copy(update={"load": self.load.only(case), "objective": objective})

    def load_cases(self) -> list[LoadCase]:
        """All load cases in N and mm; one without a name where there is nothing but a load."""
        from actuator.load_case import LoadCase

        if not self.load.cases:
            load = self.parameters()[1]
            return [LoadCase(load, goal=self.goal(load))]
        alone = [(case, self.under(case)) for case in self.load.cases]
        loads = [problem.parameters()[1] for _, problem in alone]
        return [
            LoadCase(load, case.weight, case.name, problem.goal(load))
            for (case, problem), load in zip(alone, loads, strict=True)
        ]

    def ratios(self, quantities: Mapping[str, float]) -> dict[str, float]:
        """The ratios of :class:`LoadSettings` that quantities are in place of, for this domain and material.

        Args:
            quantities: by the keys of ``LoadSettings.instead``, in their units; of load cases ``cases.0.pressure``.
        """
        modulus, size = self.material.youngs_modulus, self.domain.size
        arm = size * (quantities["arm_length"] / size if "arm_length" in quantities else self.load.arm_ratio)
        found = {}
        for key, value in quantities.items():
            place, dot, name = key.rpartition(".")
            if name == "pressure":
                ratio = 1e-3 * value / modulus
            else:
                ratio = value / size if name == "arm_length" else 0.5 * value * arm**2 / (modulus * size**3)
            found[f"{place}{dot}{LoadSettings.instead[name].ratio}"] = rounded(ratio)
        return found

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
        """The model's parameters in N, mm and s; of several load cases, the load is that of the first."""
        if self.load.cases:
            return self.leading.parameters()
        domain, objective = self.domain, self.objective
        material = Material.from_ratios(
            length=domain.length,
            interface_width=objective.interface_width,
            **self.material.model_dump(exclude={"law"}),
            law=self.material.law.build(),
        )
        modulus, ratios = self.material.youngs_modulus, self.load.pressure_ratios
        own = self.load.model_dump(exclude={"cases", "chambers", "force_ratio"})
        load = Load.from_ratios(radius=domain.size, youngs_modulus=modulus, **own)
        if self.load.force_ratio:
            # Of what is modelled: half an actuator, or a whole one.
            unit = 0.5 * domain.halves * modulus * domain.size**2
            along, across, up = (unit * ratio for ratio in self.load.force_ratio)
            load = replace(load, force=(along, across, up))
        if ratios:
            load = replace(load, pressure=max(ratios) * modulus, chambers=tuple(ratio * modulus for ratio in ratios))
        load = replace(load, spring_stiffness=domain.halves * load.spring_stiffness)
        weights = objective.model_dump(exclude={"goal"})
        limits = Objective.from_strain_limit(
            youngs_modulus=self.material.youngs_modulus, halves=domain.halves, **weights
        )
        return material, load, limits

    def goal(self, load: Load) -> Goal:
        """What C_0 is, for the load of :meth:`parameters`."""
        return goal_of(self.objective.goal, load, self.domain.size)
