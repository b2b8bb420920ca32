"""Least squares of hyperelastic laws to a uniaxial test of an incompressible solid (beside the chain of stages)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field, field_validator

from actuator.failure import Failure
from stages.laws import LAWS, MOST_TERMS, Terms
from stages.section import Section

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from actuator.parameters import Law

#: Stands for every law that is registered.
ALL = "all"
#: Points along each standard test at which stability is asked for.
CHECKED = 400
#: Share of the width of a search within which a number is said to be at its bound.
AT_BOUND = 5e-4


class Settings(Section):
    """What to fit."""

    law: str = Field(ALL, description="law to fit, or all")
    terms: int = Field(2, ge=1, le=MOST_TERMS, description="most terms of the Ogden law [-]")
    strain_limit: float = Field(0.14, gt=0, le=100, description="strain up to which a law must be stable at least [-]")

    @field_validator("law")
    @classmethod
    def _registered(cls, value: str) -> str:
        known = [ALL, *LAWS]
        if value not in known:
            raise ValueError(f"'{value}' is not one of {', '.join(map(repr, known))}")
        return value


class NoFit(Failure):
    """The data determine no law."""


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
        stretch, stress: the data, (n,) each, stress in N/mm².
        fits: in the order of :data:`stages.laws.LAWS`.
        left_out: laws that could not be fitted, and why.
    """

    stretch: Floats
    stress: Floats
    fits: list[Fit]
    left_out: dict[str, str]

    @property
    def best(self) -> Fit:
        """The fit with the smallest AICc, without one that with the smallest residuals; one without warnings if any."""

        def rank(fit: Fit) -> tuple[bool, float, float]:
            return bool(fit.warnings), np.inf if fit.aicc is None else fit.aicc, fit.root_mean_square

        return min(self.fits, key=rank)


def run(stretch: Floats, stress: Floats, settings: Settings) -> Result:
    """Fit one law or all to a uniaxial test.

    The sum of squared differences of engineering stress is least, with G > 0 and, for a law that is a sum of terms, no
    negative modulus. A law that does not say how it is fitted is left out.

    Args:
        stretch: λ, (n,), positive.
        stress: engineering stress, force over initial area, (n,), N/mm².

    Raises:
        NoFit: if no law that was asked for can be fitted.
    """
    fits: list[Fit] = []
    left_out: dict[str, str] = {}
    names = tuple(LAWS) if settings.law == ALL else (settings.law,)
    for name in names:
        try:
            fits.append(_fit(name, stretch, stress, settings))
        except NoFit as failure:
            left_out[name] = str(failure)
    if not fits:
        raise NoFit(next(iter(left_out.values())))
    return Result(stretch, stress, fits, left_out)


def _fit(name: str, stretch: Floats, stress: Floats, settings: Settings) -> Fit:
    how = LAWS[name].fitted_by()
    if how is None:
        raise NoFit(f"{name} does not say how it is fitted: write its coefficients into the case file yourself.")
    kind = LAWS[name].coefficients()
    terms = min(settings.terms, how.most) if isinstance(how, Terms) else 1
    wanted = terms * (1 + len(how.lower)) if isinstance(how, Terms) else 1 + len(kind._fields)
    strained = len(np.unique(stretch[stretch != 1.0]))
    if strained < wanted:
        raise NoFit(
            f"{name} has {wanted} numbers to fit, but there are only {strained} different stretches other than 1: "
            "measure more points or choose a law with fewer numbers."
        )
    if isinstance(how, Terms):
        return _judged(name, *_searched(how, terms, stretch, stress), stretch, stress, settings)
    shear, law = _linear(kind, stretch, stress)
    return _judged(name, shear, law, wanted, [], stretch, stress, settings)


def _linear(kind: type[Any], stretch: Floats, stress: Floats) -> tuple[float, Law]:
    """G and a law whose stress is linear in G and in G times its ratios."""
    from scipy.optimize import lsq_linear

    from actuator.material.homogeneous import uniaxial_stress

    units = np.eye(len(kind._fields))
    base = uniaxial_stress(kind(*np.zeros(len(units))), stretch)
    columns = np.column_stack([base, *(uniaxial_stress(kind(*unit), stretch) - base for unit in units)])
    size = np.linalg.norm(columns, axis=0)
    lower = np.full(len(size), -np.inf)
    lower[0] = 0.0
    found = lsq_linear(columns / size, stress, (lower, np.inf), tol=1e-14).x / size
    _require_positive(found[0], stretch, stress)
    return float(found[0]), kind(*(found[1:] / found[0]).tolist())


def _require_positive(shear: float, stretch: Floats, stress: Floats) -> None:
    # The bound is met from inside, so that "at the bound" is a small number beside neo-Hooke's modulus.
    if not shear > 1e-6 * np.linalg.norm(stress) / np.linalg.norm(stretch - stretch**-2.0):
        raise NoFit(
            "No law of this kind with a positive initial shear modulus fits these data: leave out the largest "
            "stretches, add points at small strain, or check the signs."
        )


def _searched(how: Terms, terms: int, stretch: Floats, stress: Floats) -> tuple[float, Law, int, list[str]]:
    """G, the law, how many numbers it has, and what is doubtful about the search for them."""
    from scipy.optimize import least_squares, nnls

    from actuator.material.homogeneous import uniaxial_stress

    def moduli(x: Floats) -> tuple[Floats, Floats]:
        shapes = np.column_stack([uniaxial_stress(how.one(each), stretch) for each in x.reshape(terms, -1)])
        size = np.linalg.norm(shapes, axis=0)
        mu = nnls(shapes / size, stress)[0] / size
        return mu, shapes @ mu - stress

    def residual(x: Floats) -> Floats:
        return moduli(x)[1]

    lower, upper = np.array(how.lower), np.array(how.upper)
    bounds = np.tile(lower, terms), np.tile(upper, terms)
    best: Any = None
    for start in combinations(how.starts, terms):
        found = least_squares(residual, np.ravel(start), bounds=bounds, xtol=1e-12, ftol=1e-12)
        best = found if best is None or found.cost < best.cost else best
    mu, _ = moduli(best.x)
    shear = float(mu.sum())
    _require_positive(shear, stretch, stress)
    kept = [k for k in np.argsort(-mu) if mu[k] > 0.0]
    numbers = best.x.reshape(terms, -1)[kept]
    near = AT_BOUND * (upper - lower)
    doubts = [how.at_bound] if ((numbers < lower + near) | (numbers > upper - near)).any() else []
    return shear, how.all(mu[kept] / shear, numbers), len(kept) * (1 + len(lower)), doubts


def _judged(
    name: str,
    shear: float,
    law: Law,
    parameters: int,
    doubts: list[str],
    stretch: Floats,
    stress: Floats,
    settings: Settings,
) -> Fit:
    from actuator.material.homogeneous import uniaxial_stress

    residual = shear * uniaxial_stress(law, stretch) - stress
    n, k = len(stress), parameters + 1
    # Residuals below rounding say nothing: without a floor a perfect fit would have no AICc.
    squares = max(float(residual @ residual), n * (np.finfo(float).eps * float(np.abs(stress).max())) ** 2)
    worst = int(np.abs(residual).argmax())
    farthest = max(float(stretch.max()), 1.0 / float(stretch.min()), 1.0 + settings.strain_limit)
    spread = float(np.sum((stress - stress.mean()) ** 2))
    return Fit(
        name=name,
        law=law,
        shear=shear,
        parameters=parameters,
        r_squared=1.0 - float(residual @ residual) / spread if spread > 0.0 else 0.0,
        root_mean_square=float(np.sqrt(residual @ residual / n)),
        largest_error=float(np.abs(residual[worst])),
        largest_at=float(stretch[worst]),
        aicc=n * np.log(squares / n) + 2 * k + 2 * k * (k + 1) / (n - k - 1) if n - k - 1 > 0 else None,
        warnings=doubts + _unstable(law, farthest),
    )


def _unstable(law: Law, farthest: float) -> list[str]:
    """Where stability is lost on the standard tests up to a stretch of ``farthest``."""
    from actuator.material.homogeneous import TESTS, stability, stretches_of, uniaxial_stress

    warnings = []
    driven = np.geomspace(1.0, farthest, CHECKED)
    falling = np.flatnonzero(np.diff(uniaxial_stress(law, driven)) <= 0.0)
    if len(falling):
        warnings.append(f"The engineering stress falls beyond a stretch of {driven[falling[0]]:.3f} in tension.")
    for test in TESTS:
        lost = np.flatnonzero(stability(law, test, driven) <= 0.0)
        if len(lost):
            at = stretches_of(test, driven[lost[:1]])[0, 0]
            warnings.append(f"Not stable (Drucker) in {test} beyond a stretch of {at:.3f}.")
    return warnings
