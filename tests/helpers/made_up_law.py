"""A law from outside the product: Gent's (Gent 1996, doi:10.5254/1.3538357), whose chains end at Ī1 - 3 = J_m.

w = -J_m/2 ln(1 - (Ī1 - 3)/J_m), so that S = b̄ / (1 - (Ī1 - 3)/J_m). Mechanics and settings stand in one file; the
product is not told of it but by ``LAWS.register("gent", GentSettings)``.
"""

from __future__ import annotations

from math import exp
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from stages.laws import STRESS, LawSettings, Terms


class Gent(NamedTuple):
    """Gent's law.

    Attributes:
        limit: J_m, the limit of Ī1 - 3.
    """

    limit: float


#: Of a rubber in Gent's paper.
EXAMPLE = Gent(97.2)


def energy(law, b):
    x = (b[0, 0] + b[1, 1] + b[2, 2] - 3.0) / law.limit
    return -0.5 * law.limit * np.log(1.0 - x)


def stress(law, b, S):
    x = (b[0, 0] + b[1, 1] + b[2, 2] - 3.0) / law.limit
    for i in range(3):
        for j in range(3):
            S[i, j] = b[i, j] / (1.0 - x)


def tangent(law, b, X, dS):
    x = (b[0, 0] + b[1, 1] + b[2, 2] - 3.0) / law.limit
    for m in range(len(X)):
        slope = (X[m, 0, 0] + X[m, 1, 1] + X[m, 2, 2]) / (law.limit * (1.0 - x) * (1.0 - x))
        for i in range(3):
            for j in range(3):
                dS[m, i, j] = X[m, i, j] / (1.0 - x) + slope * b[i, j]


class GentSettings(LawSettings):
    """Ψ = -G J_m / 2 ln(1 - (Ī1 - 3) / J_m)."""

    name: Literal["gent"]
    limit: float = Field(gt=0, description="J_m [-], the limit of Ī1 - 3")

    @classmethod
    def coefficients(cls) -> type[Gent]:
        return Gent

    @classmethod
    def literature(cls, law: Any, shear: float) -> dict[str, tuple[float, str]]:
        return {"mu": (shear, STRESS), "J_m": (law.limit, "")}

    @classmethod
    def fitted_by(cls) -> Terms:
        """By μ and ln J_m."""
        return Terms(
            one=lambda x: Gent(exp(x[0])),
            all=lambda _, x: Gent(exp(x[0, 0])),
            starts=((2.5,), (4.0,), (6.0,)),
            lower=(0.0,),
            upper=(12.0,),
            at_bound="J_m is at the bound of its search: the data have no upturn, or less than the law must have.",
        )


class SilentSettings(GentSettings):
    """The same under another name, by one who did not say how it is fitted."""

    name: Literal["silent"]  # type: ignore[assignment]

    @classmethod
    def fitted_by(cls) -> None:  # type: ignore[override]
        return None
