"""Least squares of one hyperelastic law to engineering stresses, and how far the law found is stable."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator.failure import Failure
from stages.laws import LAWS, Terms

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from actuator.parameters import Law

#: Points along each standard test at which stability is asked for.
CHECKED = 400
#: Share of the width of a search within which a number is said to be at its bound.
AT_BOUND = 5e-4


class NoFit(Failure):
    """The data determine no law."""


@dataclass(frozen=True)
class Solution:
    """What was found.

    Attributes:
        law: its coefficients over G.
        shear: G, initial shear modulus, N/mm².
        parameters: how many numbers were fitted.
        doubts: sentences on the search for them.
    """

    law: Law
    shear: float
    parameters: int
    doubts: list[str]


def solve(name: str, most_terms: int, stretch: Floats, stress: Floats) -> Solution:
    """Fit a registered law.

    Args:
        name: of the law.
        most_terms: of a law that is a sum of terms.
        stretch, stress: of the data, (n,); N/mm².

    Raises:
        NoFit: if the law or the data do not allow it.
    """
    how = LAWS[name].fitted_by()
    if how is None:
        raise NoFit(f"{name} does not say how it is fitted: write its coefficients into the case file yourself.")
    kind = LAWS[name].coefficients()
    terms = min(most_terms, how.most) if isinstance(how, Terms) else 1
    wanted = terms * (1 + len(how.lower)) if isinstance(how, Terms) else 1 + len(kind._fields)
    strained = len(np.unique(stretch[stretch != 1.0]))
    if strained < wanted:
        raise NoFit(
            f"{name} has {wanted} numbers to fit, but there are only {strained} different stretches other than 1: "
            "measure more points or choose a law with fewer numbers."
        )
    if isinstance(how, Terms):
        return _searched(how, terms, stretch, stress)
    shear, law = _linear(kind, stretch, stress)
    return Solution(law, shear, wanted, [])


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


def _searched(how: Terms, terms: int, stretch: Floats, stress: Floats) -> Solution:
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
    return Solution(how.all(mu[kept] / shear, numbers), shear, len(kept) * (1 + len(lower)), doubts)


def unstable(law: Law, farthest: float) -> list[str]:
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
