"""Physical parameters of the model, in N, mm and s (Table 1 of arXiv:2605.20101)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import log
from typing import Any, Literal, TypeAlias

#: Coefficients of a hyperelastic law over its initial shear modulus, a named tuple of :mod:`actuator.material.laws`.
Law: TypeAlias = tuple[float, ...]


def drainage_ratio(interface_width: float) -> float:
    """Q_s / k_s, 1/mm²: pressure decays to a tenth within 2 % of the interface width (Section 2.1)."""
    return (-log(0.1) / (0.02 * interface_width)) ** 2


@dataclass(frozen=True)
class Material:
    """Ersatz material of Section 2.1.

    Attributes:
        bulk, shear: K_s and G_s, initial moduli of the solid, N/mm².
        ramp_penalty: p̂ of Eq. (2).
        stiffness_contrast: E_0 of Eq. (2).
        void_permeability, solid_permeability: k_v and k_s, mm⁴/(N s).
        drainage: Q_s, drainage of the solid, mm²/(N s).
        hessian_penalty: c_r, N.
        law: hyperelastic law of the solid, with its coefficients over G_s.
    """

    bulk: float
    shear: float
    ramp_penalty: float
    stiffness_contrast: float
    void_permeability: float
    solid_permeability: float
    drainage: float
    hessian_penalty: float
    law: Law

    @classmethod
    def from_ratios(
        cls,
        *,
        length: float,
        interface_width: float,
        youngs_modulus: float,
        poisson_ratio: float,
        ramp_penalty: float,
        stiffness_contrast: float,
        void_permeability_rate: float,
        permeability_contrast: float,
        hessian_regularisation: float,
        law: Law,
    ) -> Material:
        """Parameters from the dimensionless ratios of Table 1; c_r = α L² K_s."""
        bulk = youngs_modulus / (3.0 * (1.0 - 2.0 * poisson_ratio))
        shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio))
        void_permeability = void_permeability_rate * length**2 / youngs_modulus
        solid_permeability = permeability_contrast * void_permeability
        drainage = drainage_ratio(interface_width) * solid_permeability
        return cls(
            bulk,
            shear,
            ramp_penalty,
            stiffness_contrast,
            void_permeability,
            solid_permeability,
            drainage,
            hessian_regularisation * length**2 * bulk,
            law,
        )


@dataclass(frozen=True)
class Load:
    """Actuation and environment of what is modelled: half an actuator, or a whole one where it has no symmetry plane.

    Attributes:
        pressure: p_in, N/mm² (p_out is zero).
        arm_length: L_arm, mm.
        spring_stiffness: k_sp, N/mm; of a whole actuator twice that of a half.
        chambers: pressures of the sources of several chambers, N/mm², of which p_in is the largest; a chamber at zero
            is open to the outside. Empty where there is one chamber, at p_in.
        force: dead force at the arm's end along X1, X2 and X3, N; on half an actuator half of that on a whole one.
    """

    pressure: float
    arm_length: float
    spring_stiffness: float
    chambers: tuple[float, ...] = ()
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def none(self) -> bool:
        """Whether nothing is there that could move the actuator."""
        return self.pressure == 0.0 and not any(self.force)

    @classmethod
    def from_ratios(
        cls, *, radius: float, youngs_modulus: float, pressure_ratio: float, arm_ratio: float, spring_ratio: float
    ) -> Load:
        """Parameters of half an actuator from the dimensionless ratios of Table 1."""
        arm_length = arm_ratio * radius
        return cls(
            pressure_ratio * youngs_modulus, arm_length, spring_ratio * youngs_modulus * radius**3 / arm_length**2
        )


@dataclass(frozen=True)
class Objective:
    """Weights and limits of Eqs. (9) to (15) and Appendix B.

    Attributes:
        area_weight, slope_weight, leak_weight, strain_energy_weight, passive_weight: c_A, c_i, c_p, c_Ψ and the
            factor of C_χ.
        energy_limit: Ψ_lim, N/mm².
        interface_width, diffusivity_length: L_i and L_t, mm.
        length_unit: what the paper calls 1 mm in Eqs. (14), (15), (20), (21) and (22), whose numbers have units, mm.
        energy_shift: shift of χ in C_Ψ, Eq. (14), dimensionless.
        halves: how many halves of the actuator Ω is. C_0 and C_p are of either the same; weights of what grows with Ω
            are such that the terms of a whole are those of a half of it, and so are their minimisers.
        terms: parameters of the terms that the paper does not have, by name (:data:`actuator.terms.TERMS`).
    """

    area_weight: float
    slope_weight: float
    leak_weight: float
    strain_energy_weight: float
    passive_weight: float
    energy_limit: float
    interface_width: float
    diffusivity_length: float
    length_unit: float = 1.0
    energy_shift: float = 0.0
    halves: int = 1
    terms: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @classmethod
    def from_strain_limit(
        cls,
        *,
        youngs_modulus: float,
        strain_limit: float,
        interface_width: float,
        length_unit: float = 1.0,
        halves: int = 1,
        area_weight: float,
        slope_weight: float,
        strain_energy_weight: float,
        passive_weight: float,
        diffusivity_length: float | None = None,
        strain_energy_shift: float | Literal["4/L_i", "8/L_i"] = 0.0,
        **others: Any,
    ) -> Objective:
        """Ψ_lim = E ε² / 2 for an allowable strain ε; weights of integrals over Ω count it in the length unit cubed.

        The weights given are of half an actuator.

        Args:
            halves: how many of them Ω is; c_A is divided by their cube root, as C_A has |Ω|^(-2/3) before its integral.
            diffusivity_length: 5 L_i as in Table 1, if None.
            strain_energy_shift: "4/L_i" is what Eq. (14) prints, with L_i counted in the length unit.
        """
        volume, shift = length_unit**3 * halves, strain_energy_shift
        if isinstance(shift, str):
            shift = float(shift.partition("/")[0]) / (interface_width / length_unit)
        return cls(
            energy_limit=0.5 * youngs_modulus * strain_limit**2,
            interface_width=interface_width,
            diffusivity_length=5.0 * interface_width if diffusivity_length is None else diffusivity_length,
            length_unit=length_unit,
            halves=halves,
            area_weight=area_weight / halves ** (1.0 / 3.0),
            slope_weight=slope_weight * length_unit**3 / halves,
            strain_energy_weight=strain_energy_weight / volume,
            passive_weight=passive_weight / volume,
            energy_shift=shift,
            **others,
        )
