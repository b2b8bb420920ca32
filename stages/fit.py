"""Least squares of hyperelastic laws to a uniaxial test of an incompressible solid (beside the chain of stages)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from actuator.failure import Failure
from actuator.material.laws.coefficients import MOST_TERMS, Law, MooneyRivlin, NeoHooke, Ogden, Yeoh
from stages.laws import LEAST_EXPONENT
from stages.section import Section

if TYPE_CHECKING:
    from actuator.arrays import Floats

LawName = Literal["neo-hooke", "mooney-rivlin", "yeoh", "ogden"]
NAMES: tuple[LawName, ...] = ("neo-hooke", "mooney-rivlin", "yeoh", "ogden")

#: Bounds of an Ogden law's exponents, and those that its search starts from, taken in all combinations.
EXPONENTS = (-10.0, 10.0)
STARTS = (-5.0, -2.0, 1.3, 2.0, 4.0, 8.0)
#: Points along each standard test at which stability is asked for.
CHECKED = 400


class Settings(Section):
    """What to fit."""

    law: Literal[LawName, "all"] = Field("all", description="law to fit, or all")
    terms: int = Field(2, ge=1, le=MOST_TERMS, description="most terms of the Ogden law [-]")
    strain_limit: float = Field(0.14, gt=0, le=100, description="strain up to which a law must be stable at least [-]")


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
        warnings: sentences on where the law is not stable.
    """

    name: LawName
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
        from actuator.material.laws.homogeneous import uniaxial_stress  # compiled code: only where it is used

        return self.shear * uniaxial_stress(self.law, stretch)

    @property
    def ratios(self) -> dict[str, Any]:
        """The keys of the case file's section ``material.law``, but for its name; dimensionless."""
        if isinstance(self.law, Ogden):
            return {"mu": [mu for mu, _ in self.law.terms], "alpha": [alpha for _, alpha in self.law.terms]}
        return self.law._asdict()

    @property
    def coefficients(self) -> dict[str, float]:
        """The constants as the literature writes them, N/mm²; α_k dimensionless."""
        G, law = self.shear, self.law
        if isinstance(law, MooneyRivlin):
            return {"C10": G * (0.5 - law.c01), "C01": G * law.c01}
        if isinstance(law, Yeoh):
            return {"C1": 0.5 * G, "C2": G * law.c2, "C3": G * law.c3}
        if isinstance(law, Ogden):
            pairs = enumerate(law.terms, 1)
            return {name: value for k, (mu, a) in pairs for name, value in ((f"mu{k}", G * mu), (f"alpha{k}", a))}
        return {"G": G}


@dataclass(frozen=True)
class Result:
    """What was fitted to a test.

    Attributes:
        stretch, stress: the data, (n,) each, stress in N/mm².
        fits: in the order of :data:`NAMES`.
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

    The sum of squared differences of engineering stress is least, with G > 0 and, for Ogden's law, all μ_k >= 0, which
    makes every term stable.

    Args:
        stretch: λ, (n,), positive.
        stress: engineering stress, force over initial area, (n,), N/mm².

    Raises:
        NoFit: if no law that was asked for can be fitted.
    """
    fits: list[Fit] = []
    left_out: dict[str, str] = {}
    names = NAMES if settings.law == "all" else (settings.law,)
    for name in names:
        try:
            fits.append(_fit(name, stretch, stress, settings))
        except NoFit as failure:
            left_out[name] = str(failure)
    if not fits:
        raise NoFit(next(iter(left_out.values())))
    return Result(stretch, stress, fits, left_out)


def _fit(name: LawName, stretch: Floats, stress: Floats, settings: Settings) -> Fit:
    strained = len(np.unique(stretch[stretch != 1.0]))
    wanted = {"neo-hooke": 1, "mooney-rivlin": 2, "yeoh": 3, "ogden": 2 * settings.terms}[name]
    if strained < wanted:
        raise NoFit(
            f"{name} has {wanted} numbers to fit, but there are only {strained} different stretches other than 1: "
            "measure more points or choose a law with fewer numbers."
        )
    if name == "ogden":
        shear, law, parameters = _ogden(stretch, stress, settings.terms)
    else:
        kinds: dict[str, type[NeoHooke | MooneyRivlin | Yeoh]] = {"mooney-rivlin": MooneyRivlin, "yeoh": Yeoh}
        shear, law = _linear(kinds.get(name, NeoHooke), stretch, stress)
        parameters = wanted
    return _judged(name, law, shear, parameters, stretch, stress, settings)


def _linear(kind: type[NeoHooke | MooneyRivlin | Yeoh], stretch: Floats, stress: Floats) -> tuple[float, Law]:
    """G and a law whose stress is linear in G and in G times its ratios."""
    from scipy.optimize import lsq_linear

    from actuator.material.laws.homogeneous import uniaxial_stress

    build: Callable[..., Law] = kind
    units = np.eye(len(kind._fields))
    base = uniaxial_stress(build(*np.zeros(len(units))), stretch)
    columns = np.column_stack([base, *(uniaxial_stress(build(*unit), stretch) - base for unit in units)])
    size = np.linalg.norm(columns, axis=0)
    lower = np.full(len(size), -np.inf)
    lower[0] = 0.0
    found = lsq_linear(columns / size, stress, (lower, np.inf), tol=1e-14).x / size
    _require_positive(found[0], base, stress)
    return float(found[0]), build(*(found[1:] / found[0]).tolist())


def _require_positive(shear: float, base: Floats, stress: Floats) -> None:
    # The bound is met from inside, so that "at the bound" is a small number beside neo-Hooke's modulus.
    if not shear > 1e-6 * np.linalg.norm(stress) / np.linalg.norm(base):
        raise NoFit(
            "No law of this kind with a positive initial shear modulus fits these data: leave out the largest "
            "stretches, add points at small strain, or check the signs."
        )


def _ogden(stretch: Floats, stress: Floats, terms: int) -> tuple[float, Law, int]:
    """G and the Ogden law: μ_k >= 0 by linear least squares within a search for α_k from several starts."""
    from scipy.optimize import least_squares, nnls

    from actuator.material.laws.homogeneous import uniaxial_stress

    def columns(alpha: Floats) -> Floats:
        away = np.copysign(np.maximum(np.abs(alpha), LEAST_EXPONENT), alpha)
        return np.column_stack([uniaxial_stress(Ogden.of([1.0], [float(a)]), stretch) for a in away])

    def moduli(alpha: Floats) -> tuple[Floats, Floats]:
        shapes = columns(alpha)
        size = np.linalg.norm(shapes, axis=0)
        mu = nnls(shapes / size, stress)[0] / size
        return mu, shapes @ mu - stress

    def residual(alpha: Floats) -> Floats:
        return moduli(alpha)[1]

    best: Any = None
    for start in combinations_with_replacement(STARTS, terms):
        if len(set(start)) == terms:
            found = least_squares(residual, start, bounds=EXPONENTS, xtol=1e-12, ftol=1e-12)
            best = found if best is None or found.cost < best.cost else best
    mu, _ = moduli(best.x)
    shear = float(mu.sum())
    _require_positive(shear, columns(np.array([2.0]))[:, 0], stress)
    alpha = np.copysign(np.maximum(np.abs(best.x), LEAST_EXPONENT), best.x)
    kept = [k for k in np.argsort(-mu) if mu[k] > 0.0]
    law = Ogden.of((mu[kept] / shear).tolist(), alpha[kept].tolist())
    return shear, law, 2 * len(kept)


def _judged(
    name: LawName, law: Law, shear: float, parameters: int, stretch: Floats, stress: Floats, settings: Settings
) -> Fit:
    from actuator.material.laws.homogeneous import uniaxial_stress

    residual = shear * uniaxial_stress(law, stretch) - stress
    n, k = len(stress), parameters + 1
    # Residuals below rounding say nothing: without a floor a perfect fit would have no AICc.
    squares = max(float(residual @ residual), n * (np.finfo(float).eps * float(np.abs(stress).max())) ** 2)
    worst = int(np.abs(residual).argmax())
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
        warnings=_warnings(law, max(float(stretch.max()), 1.0 / float(stretch.min()), 1.0 + settings.strain_limit)),
    )


def _warnings(law: Law, farthest: float) -> list[str]:
    """Exponents at their bound, and where stability is lost on the standard tests up to a stretch of ``farthest``."""
    from actuator.material.laws.homogeneous import TESTS, stability, stretches_of, uniaxial_stress

    warnings = []
    if isinstance(law, Ogden) and max(abs(alpha) for _, alpha in law.terms) > 0.999 * EXPONENTS[1]:
        warnings.append(f"An exponent is at the bound of its search, ±{EXPONENTS[1]:g}: fewer terms may do.")
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
