"""Least squares of hyperelastic laws to a uniaxial test of an incompressible solid (beside the chain of stages).

By default the rows near rest are fitted, where an actuator works, and not all of a test to failure: the initial modulus
scales the pressure of a case.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field, field_validator

from stages.laws import LAWS, MOST_TERMS
from stages.least_squares import NoFit, Solution, solve, unstable
from stages.near_rest import REACH, Start, near_rest, nearest
from stages.section import Section
from stages.settings import ObjectiveSettings
from stages.tension import Curve, loading_curve

if TYPE_CHECKING:
    from actuator.arrays import Bools, Floats
    from actuator.parameters import Law

#: Stands for every law that is registered.
ALL = "all"
#: R² below which a law is not recommended: its residuals then have a third of the scatter of the stresses or more.
LEAST_R_SQUARED = 0.9
#: Difference from the rows, in initial modulus or in stress at the strain limit, past which a law is warned of.
FAR = 0.1
#: Young's moduli of elastomers, N/mm²: soft matter begins at 1e4 Pa (Rus & Tolley 2015, doi:10.1038/nature14543), and
#: Shore A ends near 50 N/mm² (Gent 1958, doi:10.5254/1.3542351: 44 at 95 Shore A).
SOFTEST, STIFFEST = 0.01, 50.0


class Settings(Section):
    """What to fit."""

    law: str = Field(ALL, description="law to fit, or all")
    terms: int = Field(2, ge=1, le=MOST_TERMS, description="most terms of the Ogden law [-]")
    strain_limit: float = Field(
        ObjectiveSettings.model_fields["strain_limit"].default,
        gt=0,
        le=100,
        description="strain up to which errors are stated and a law must be stable at least [-]",
    )
    up_to: float | None = Field(
        None, gt=1, le=100, description="largest stretch that is fitted [-]; by default of twice the strain limit"
    )
    whole: bool = Field(False, description="fit all stretches, whatever up_to is")

    @field_validator("law")
    @classmethod
    def _registered(cls, value: str) -> str:
        known = [ALL, *LAWS]
        if value not in known:
            raise ValueError(f"'{value}' is not one of {', '.join(map(repr, known))}")
        return value


@dataclass(frozen=True)
class Fit:
    """One law fitted.

    Attributes:
        name: of the law, as the case file writes it.
        law: its coefficients over G.
        shear: G, initial shear modulus, N/mm².
        parameters: how many numbers were fitted.
        r_squared: 1 - Σ(residual²)/Σ(stress - mean)².
        root_mean_square: of the residuals, N/mm².
        largest_error, largest_at: largest |residual|, N/mm², and its stretch.
        aicc: n ln(Σ residual²/n) + 2 k + 2 k (k + 1)/(n - k - 1) with k = parameters + 1 (Hurvich & Tsai 1989,
            doi:10.1093/biomet/76.2.297), to compare laws: the smallest is best. None with too few points.
        modulus_error, limit_error: of E and of the stress at the strain limit, relative to what the rows near rest say;
            None where these say nothing.
        warnings: sentences on what is doubtful, such as where the law is not stable.
    """

    name: str
    law: Law
    shear: float
    parameters: int
    r_squared: float
    root_mean_square: float
    largest_error: float
    largest_at: float
    aicc: float | None
    modulus_error: float | None
    limit_error: float | None
    warnings: list[str]

    @property
    def youngs_modulus(self) -> float:
        """E = 3 G of the incompressible solid, N/mm²."""
        return 3.0 * self.shear

    def stress(self, stretch: Floats) -> Floats:
        """Engineering stress of the law at stretches (n,), N/mm²."""
        from actuator.material.homogeneous import uniaxial_stress  # compiled code: only where it is used

        return self.shear * uniaxial_stress(self.law, stretch)

    @property
    def ratios(self) -> dict[str, Any]:
        """The keys of the case file's section ``material.law``, but for its name; dimensionless."""
        return LAWS[self.name].ratios(self.law)

    @property
    def literature(self) -> dict[str, tuple[float, str]]:
        """The constants as the literature writes them, each with its unit."""
        return LAWS[self.name].literature(self.law, self.shear)

    @property
    def coefficients(self) -> dict[str, float]:
        """The same without the units."""
        return {name: value for name, (value, _) in self.literature.items()}


@dataclass(frozen=True)
class Result:
    """What was fitted to a test.

    Attributes:
        stretch, stress: the loading curve, (n,) each, in order of stretch; stress in N/mm².
        fitted: which of its rows the laws are fitted to, (n,).
        excluded: stretch and stress of rows that are no part of the curve, (m, 2).
        start: of the curve, by the rows near rest; None if they do not determine it.
        strain_limit: up to which errors are stated.
        fits: in the order of :data:`stages.laws.LAWS`.
        left_out: laws that could not be fitted, and why.
        warnings: sentences on what is doubtful about the test.
    """

    stretch: Floats
    stress: Floats
    fitted: Bools
    excluded: Floats
    start: Start | None
    strain_limit: float
    fits: list[Fit]
    left_out: dict[str, str]
    warnings: list[str]

    @property
    def best(self) -> Fit | None:
        """The fit to recommend: of R² >= :data:`LEAST_R_SQUARED`, without warnings if any, with the smallest AICc.

        Without one that with the smallest residuals; None if R² is smaller everywhere.
        """

        def rank(fit: Fit) -> tuple[bool, float, float]:
            return bool(fit.warnings), np.inf if fit.aicc is None else fit.aicc, fit.root_mean_square

        good = [fit for fit in self.fits if fit.r_squared >= LEAST_R_SQUARED]
        return min(good, key=rank) if good else None

    @property
    def strained(self) -> int:
        """How many rows, but those at rest, are within the strain limit."""
        return _strained(self.stretch, self.strain_limit)

    @property
    def youngs_modulus(self) -> float:
        """E of the best fit, else of the rows near rest, else of the first law, N/mm²."""
        if self.best:
            return self.best.youngs_modulus
        return self.start.slope if self.start else self.fits[0].youngs_modulus


def run(stretch: Floats, stress: Floats, settings: Settings, lines: Sequence[int] | None = None) -> Result:
    """Fit one law or all to a uniaxial test.

    Rows that are no part of a loading curve are left out first (:mod:`stages.tension`). The sum of squared differences
    of engineering stress is least, with G > 0 and, for a law that is a sum of terms, no negative modulus. A law that
    does not say how it is fitted is left out.

    Args:
        stretch: λ, (n,), positive.
        stress: engineering stress, force over initial area, (n,), N/mm².
        lines: of the file in which the rows stand, for warnings.

    Raises:
        NoFit: if no law that was asked for can be fitted.
    """
    curve = loading_curve(stretch, stress, settings.strain_limit, lines)
    near = nearest(curve.stretch, REACH * settings.strain_limit)
    start = near_rest(curve.stretch[near], curve.stress[near])
    if start is not None and not (start.slope > 0.0 and start.stress(1.0 + settings.strain_limit) > 0.0):
        start = None
    fitted = near
    if settings.whole or settings.up_to:
        largest = np.inf if settings.whole or not settings.up_to else np.log(settings.up_to)
        fitted = np.abs(np.log(curve.stretch)) <= largest
    x, y = curve.stretch[fitted], curve.stress[fitted]
    fits: list[Fit] = []
    left_out: dict[str, str] = {}
    names = tuple(LAWS) if settings.law == ALL else (settings.law,)
    for name in names:
        try:
            fits.append(_judged(name, solve(name, settings.terms, x, y), x, y, start, settings.strain_limit))
        except NoFit as failure:
            left_out[name] = str(failure)
    if not fits:
        raise NoFit(" ".join([next(iter(left_out.values())), *curve.warnings]))
    warnings = [*curve.warnings, *_doubts(curve, start, settings.strain_limit)]
    result = Result(
        curve.stretch, curve.stress, fitted, curve.left_out, start, settings.strain_limit, fits, left_out, warnings
    )
    return replace(result, warnings=[*warnings, *_foreign(result)])


def _judged(
    name: str, found: Solution, stretch: Floats, stress: Floats, start: Start | None, strain_limit: float
) -> Fit:
    from actuator.material.homogeneous import uniaxial_stress

    residual = found.shear * uniaxial_stress(found.law, stretch) - stress
    n, k = len(stress), found.parameters + 1
    # Residuals below rounding say nothing: without a floor a perfect fit would have no AICc.
    squares = max(float(residual @ residual), n * (np.finfo(float).eps * float(np.abs(stress).max())) ** 2)
    worst = int(np.abs(residual).argmax())
    farthest = max(float(stretch.max()), 1.0 / float(stretch.min()), 1.0 + REACH * strain_limit)
    spread = float(np.sum((stress - stress.mean()) ** 2))
    errors: tuple[float, float] | None = None
    off = []
    if start:
        at_limit = found.shear * float(uniaxial_stress(found.law, np.array([1.0 + strain_limit]))[0])
        errors = 3.0 * found.shear / start.slope - 1.0, at_limit / start.stress(1.0 + strain_limit) - 1.0
        doubt = 2.0 * start.uncertainty / start.slope
        for what, error in zip(("E", f"The stress at a strain of {100.0 * strain_limit:g} %"), errors, strict=True):
            if abs(error) > max(FAR, doubt if what == "E" else 0.0):
                side = "above" if error > 0.0 else "below"
                off.append(f"{what} is {100.0 * abs(error):.0f} % {side} what the rows near rest say.")
    return Fit(
        name=name,
        law=found.law,
        shear=found.shear,
        parameters=found.parameters,
        r_squared=1.0 - float(residual @ residual) / spread if spread > 0.0 else 0.0,
        root_mean_square=float(np.sqrt(residual @ residual / n)),
        largest_error=float(np.abs(residual[worst])),
        largest_at=float(stretch[worst]),
        aicc=n * np.log(squares / n) + 2 * k + 2 * k * (k + 1) / (n - k - 1) if n - k - 1 > 0 else None,
        modulus_error=errors[0] if errors else None,
        limit_error=errors[1] if errors else None,
        warnings=[*off, *found.doubts, *unstable(found.law, farthest)],
    )


def _doubts(curve: Curve, start: Start | None, strain_limit: float) -> list[str]:
    """How well the rows near rest say what E is."""
    if start is None:
        return ["The rows near rest do not say how stiff the solid is at first: E is that of the law alone."]
    if not _strained(curve.stretch, strain_limit):
        return [f"No row but at rest is within the strain limit of {100.0 * strain_limit:g} %: E is extrapolated."]
    if 2.0 * start.uncertainty > FAR * start.slope:
        share = 200.0 * start.uncertainty / start.slope
        return [
            f"The rows near rest scatter or are few: they say E within ±{share:.2g} % only (two standard deviations). "
            "Record more rows at small strain."
            if np.isfinite(share)
            else "The rows near rest are too few to say how well they say E. Record more rows at small strain."
        ]
    return []


def _strained(stretch: Floats, strain_limit: float) -> int:
    return int(np.count_nonzero((np.abs(np.log(stretch)) <= np.log1p(strain_limit)) & (stretch != 1.0)))


def _foreign(result: Result) -> list[str]:
    """Whether E is one of an elastomer."""
    modulus = result.youngs_modulus
    if SOFTEST <= modulus <= STIFFEST:
        return []
    return [
        f"E of {modulus:.3g} N/mm² is no elastomer's, which is between {SOFTEST:g} and {STIFFEST:g}: check the units "
        "of stress and strain, and the area that the force was divided by."
    ]
