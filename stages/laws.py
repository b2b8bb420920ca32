"""The section ``material.law``: which hyperelastic law the solid has, and its coefficients over G."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from actuator.material.laws.coefficients import MOST_TERMS, MooneyRivlin, NeoHooke, Ogden, Yeoh
from stages.section import Section

#: How far the terms of an Ogden law may be from adding up to the initial shear modulus; they are then scaled to it.
ROUNDING = 1e-6
#: Smallest |α| of an Ogden term; its energy is a difference of terms of size 1/α².
LEAST_EXPONENT = 0.01


class NeoHookeSettings(Section):
    """Ψ = G/2 (Ī1 - 3), the paper's law."""

    name: Literal["neo-hooke"] = "neo-hooke"

    def build(self) -> NeoHooke:
        """The law's coefficients."""
        return NeoHooke()


class MooneyRivlinSettings(Section):
    """Ψ = C10 (Ī1 - 3) + C01 (Ī2 - 3), with C10 = G/2 - C01."""

    name: Literal["mooney-rivlin"]
    c01: float = Field(description="C01 / G [-]; C10 / G is 0.5 - c01")

    def build(self) -> MooneyRivlin:
        """The law's coefficients."""
        return MooneyRivlin(self.c01)


class YeohSettings(Section):
    """Ψ = C1 (Ī1 - 3) + C2 (Ī1 - 3)² + C3 (Ī1 - 3)³, with C1 = G/2."""

    name: Literal["yeoh"]
    c2: float = Field(description="C2 / G [-]")
    c3: float = Field(description="C3 / G [-]")

    def build(self) -> Yeoh:
        """The law's coefficients."""
        return Yeoh(self.c2, self.c3)


class OgdenSettings(Section):
    """Ψ = Σ 2 μ_k / α_k² (λ̄1^α_k + λ̄2^α_k + λ̄3^α_k - 3), with Σ μ_k = G."""

    name: Literal["ogden"]
    mu: list[float] = Field(min_length=1, max_length=MOST_TERMS, description="μ_k / G [-]; they add up to 1")
    alpha: list[float] = Field(min_length=1, max_length=MOST_TERMS, description="α_k [-], not zero")

    @model_validator(mode="after")
    def _consistent(self) -> OgdenSettings:
        if len(self.mu) != len(self.alpha):
            raise ValueError(
                f"mu has {len(self.mu)} and alpha {len(self.alpha)} numbers; write as many of one as of the other"
            )
        if abs(sum(self.mu) - 1.0) > ROUNDING:
            raise ValueError(
                f"the numbers of mu add up to {sum(self.mu):.7g}, not 1, so that the initial shear modulus would not "
                "be that of youngs_modulus and poisson_ratio; divide them by their sum"
            )
        if min(abs(alpha) for alpha in self.alpha) < LEAST_EXPONENT:
            raise ValueError(f"the numbers of alpha must be {LEAST_EXPONENT:g} or more away from zero; change them")
        return self

    def build(self) -> Ogden:
        """The law's coefficients, adding up to 1 exactly."""
        return Ogden.of([mu / sum(self.mu) for mu in self.mu], self.alpha)


def _named(value: Any) -> Any:
    """``law: neo-hooke`` is short for a section with that name."""
    return {"name": value} if isinstance(value, str) else value


def short_form_too(schema: dict[str, Any]) -> None:
    """Let the JSON Schema of a law allow the short form of the law without coefficients."""
    section = {key: schema.pop(key) for key in ("oneOf", "discriminator") if key in schema}
    schema["anyOf"] = [{"const": "neo-hooke"}, section]


LawSettings = Annotated[
    NeoHookeSettings | MooneyRivlinSettings | YeohSettings | OgdenSettings,
    BeforeValidator(_named),
    Field(discriminator="name"),
]
