"""The section ``material.law``: the hyperelastic law of the solid, its coefficients over G, and how they are fitted.

A law is known to cases and to ``poro fit`` by its class here, registered in :data:`LAWS`; another program registers its
own. The mechanics is in the law's file, :mod:`actuator.material.laws`, which is imported when a law is built.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from actuator.parameters import Law
from actuator.registry import Registry
from stages.section import Kinds, Section

if TYPE_CHECKING:
    from actuator.arrays import Floats

#: How far the terms of an Ogden law may be from adding up to the initial shear modulus; they are then scaled to it.
ROUNDING = 1e-6
#: Smallest |α| of an Ogden term; its energy is a difference of terms of size 1/α².
LEAST_EXPONENT = 0.01
#: Largest |α| of an Ogden term that is searched for, and those that its search starts from.
LARGEST_EXPONENT = 10.0
EXPONENTS = (-5.0, -2.0, 1.3, 2.0, 4.0, 8.0)
#: Terms that the compiled Ogden law holds.
MOST_TERMS = 3
#: Unit of the constants that are stresses.
STRESS = "N/mm²"


@dataclass(frozen=True)
class Linear:
    """How a law is fitted whose stress is linear in G and in G times each of its coefficients."""


@dataclass(frozen=True)
class Terms:
    """How a law is fitted that is a sum of like terms, Σ μ_k σ(x_k), or a single one.

    The moduli μ_k >= 0 follow by linear least squares, for whatever numbers x_k a search tries.

    Attributes:
        one: the law of a single term with μ = G, of its numbers (n,).
        all: the law of several, of μ_k / G (m,), which add up to 1, and x (m, n).
        starts: numbers of a term, (n,) each, that the search starts from, different ones for each term.
        lower, upper: bounds of the search, (n,).
        at_bound: what to say of a fit with a number at its bound.
        most: most terms.
    """

    one: Callable[[Floats], Law]
    all: Callable[[Floats, Floats], Law]
    starts: tuple[tuple[float, ...], ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    at_bound: str
    most: int = 1


class LawSettings(Section):
    """What the sections of all laws have; the other fields of one are its keys in the case file."""

    name: str

    @classmethod
    @abstractmethod
    def coefficients(cls) -> type[Any]:
        """The named tuple of the law's coefficients, imported from the law's file."""

    def build(self) -> Law:
        """The law's coefficients."""
        built: Law = self.coefficients()(**self.model_dump(exclude={"name"}))
        return built

    @classmethod
    def ratios(cls, law: Any) -> dict[str, Any]:
        """The keys of this section but for its name, of a law that has been fitted; dimensionless."""
        found: dict[str, Any] = law._asdict()
        return found

    @classmethod
    def literature(cls, law: Any, shear: float) -> dict[str, tuple[float, str]]:
        """The constants as the literature writes them, each with its unit, for G = ``shear`` in N/mm²."""
        return {"G": (shear, STRESS)} | {name: (value, "") for name, value in law._asdict().items()}

    @classmethod
    def fitted_by(cls) -> Linear | Terms | None:
        """How the law is fitted to a uniaxial test; None if it cannot be."""
        return None


#: The laws that a case may name, in the order in which they are listed.
LAWS: Registry[type[LawSettings]] = Registry("material law")


class NeoHookeSettings(LawSettings):
    """Ψ = G/2 (Ī1 - 3), the paper's law."""

    name: Literal["neo-hooke"] = "neo-hooke"

    @classmethod
    def coefficients(cls) -> type[Any]:
        """The law's named tuple, without entries."""
        from actuator.material.laws.neo_hooke import NeoHooke

        return NeoHooke

    @classmethod
    def fitted_by(cls) -> Linear:
        """By G alone."""
        return Linear()


class MooneyRivlinSettings(LawSettings):
    """Ψ = C10 (Ī1 - 3) + C01 (Ī2 - 3), with C10 = G/2 - C01."""

    name: Literal["mooney-rivlin"]
    c01: float = Field(description="C01 / G [-]; C10 / G is 0.5 - c01")

    @classmethod
    def coefficients(cls) -> type[Any]:
        """The law's named tuple."""
        from actuator.material.laws.mooney_rivlin import MooneyRivlin

        return MooneyRivlin

    @classmethod
    def literature(cls, law: Any, shear: float) -> dict[str, tuple[float, str]]:
        """C10 and C01, N/mm²."""
        return {"C10": (shear * (0.5 - law.c01), STRESS), "C01": (shear * law.c01, STRESS)}

    @classmethod
    def fitted_by(cls) -> Linear:
        """By C10 and C01."""
        return Linear()


class YeohSettings(LawSettings):
    """Ψ = C1 (Ī1 - 3) + C2 (Ī1 - 3)² + C3 (Ī1 - 3)³, with C1 = G/2."""

    name: Literal["yeoh"]
    c2: float = Field(description="C2 / G [-]")
    c3: float = Field(description="C3 / G [-]")

    @classmethod
    def coefficients(cls) -> type[Any]:
        """The law's named tuple."""
        from actuator.material.laws.yeoh import Yeoh

        return Yeoh

    @classmethod
    def literature(cls, law: Any, shear: float) -> dict[str, tuple[float, str]]:
        """C1, C2 and C3, N/mm²."""
        return {"C1": (0.5 * shear, STRESS), "C2": (shear * law.c2, STRESS), "C3": (shear * law.c3, STRESS)}

    @classmethod
    def fitted_by(cls) -> Linear:
        """By C1, C2 and C3."""
        return Linear()


class OgdenSettings(LawSettings):
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

    @classmethod
    def coefficients(cls) -> type[Any]:
        """The law's named tuple."""
        from actuator.material.laws.ogden import Ogden

        return Ogden

    def build(self) -> Law:
        """The law's coefficients, adding up to 1 exactly."""
        built: Law = self.coefficients().of([mu / sum(self.mu) for mu in self.mu], self.alpha)
        return built

    @classmethod
    def ratios(cls, law: Any) -> dict[str, Any]:
        """The lists of the terms that count."""
        return {"mu": [mu for mu, _ in law.terms], "alpha": [alpha for _, alpha in law.terms]}

    @classmethod
    def literature(cls, law: Any, shear: float) -> dict[str, tuple[float, str]]:
        """μ_k in N/mm² and α_k of the terms that count."""
        pairs = [((f"mu{k}", (shear * mu, STRESS)), (f"alpha{k}", (a, ""))) for k, (mu, a) in enumerate(law.terms, 1)]
        return dict(entry for pair in pairs for entry in pair)

    @classmethod
    def fitted_by(cls) -> Terms:
        """By μ_k >= 0, which makes every term stable, and exponents within bounds."""
        import numpy as np

        def all_terms(mu: Floats, exponents: Floats) -> Law:
            alpha = np.copysign(np.maximum(np.abs(exponents[:, 0]), LEAST_EXPONENT), exponents[:, 0])
            law: Law = cls.coefficients().of(mu.tolist(), alpha.tolist())
            return law

        return Terms(
            one=lambda exponent: all_terms(np.ones(1), exponent[None, :]),
            all=all_terms,
            starts=tuple((exponent,) for exponent in EXPONENTS),
            lower=(-LARGEST_EXPONENT,),
            upper=(LARGEST_EXPONENT,),
            at_bound=f"An exponent is at the bound of its search, ±{LARGEST_EXPONENT:g}: fewer terms may do.",
            most=MOST_TERMS,
        )


LAWS.register("neo-hooke", NeoHookeSettings)
LAWS.register("mooney-rivlin", MooneyRivlinSettings)
LAWS.register("yeoh", YeohSettings)
LAWS.register("ogden", OgdenSettings)


def _named(value: Any) -> Any:
    """``law: neo-hooke`` is short for a section with that name."""
    return {"name": value} if isinstance(value, str) else value


def _short_form_too(schema: dict[str, Any]) -> None:
    """Let the JSON Schema of a law allow the short form of the law without coefficients."""
    section = {key: schema.pop(key) for key in ("oneOf", "discriminator") if key in schema}
    schema["anyOf"] = [{"const": "neo-hooke"}, section]


#: The section of any law that is registered when the case is read.
AnyLawSettings = Annotated[LawSettings, Kinds(LAWS), BeforeValidator(_named), Field(json_schema_extra=_short_form_too)]
