"""The sum of the terms: the one place where the objective is put together.

Both the reduced objective (:mod:`actuator.solve.reduced`) and the optimiser's model of it take it from here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from actuator.arrays import Floats
from actuator.terms.design import DesignObjective, DesignTerms
from actuator.terms.interface import Derivatives, Fields, Problem, StateTerm, Value
from actuator.terms.leak import Leak
from actuator.terms.main_objective import MainObjective
from actuator.terms.strain_energy import StrainEnergy

#: Names of the paper's terms, in the order in which they are reported.
PAPER = ("C0", "C_chi", "C_A", "C_i", "C_p", "C_psi")


class StateObjective:
    """w (C_0 + further terms) + C_p + C_Ψ: the terms that depend on the state of one load case, of weight w.

    Args:
        problem: what the terms are built from.
        others: terms that the paper does not have, by name.
        weight: w.

    Attributes:
        main, leak, strain_energy: C_0, C_p and C_Ψ, unweighted.
    """

    def __init__(self, problem: Problem, others: Mapping[str, StateTerm], weight: float = 1.0) -> None:
        self.main, self.leak, self.strain_energy = MainObjective(problem), Leak(problem), StrainEnergy(problem)
        aims = {"C0": self.main, **others}
        if weight != 1.0:
            aims = {name: Weighted(term, weight) for name, term in aims.items()}
        self._terms = {"C0": aims.pop("C0"), "C_p": self.leak, "C_psi": self.strain_energy, **aims}

    def values(self, at: Fields) -> dict[str, Value]:
        """All terms by name."""
        return {name: term.value(at) for name, term in self._terms.items()}

    def value(self, at: Fields, before: float = 0.0) -> float:
        """The sum of all terms, added to what comes before."""
        first, *rest = (term.value(at).value for term in self._terms.values())
        return sum(rest, first + before)

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add the derivatives at real or complex fields, but for C_Ψ's."""
        for term in self._terms.values():
            term.add_gradient(at, into)

    def pressure_roots(self) -> Floats | None:
        """w with w² the sum of :meth:`StateTerm.pressure_roots` squared, (n_vertices,); None if no term has any."""
        roots = [found for term in self._terms.values() if (found := term.pressure_roots()) is not None]
        return np.sqrt(sum(root**2 for root in roots)) if len(roots) > 1 else roots[0] if roots else None


class TotalObjective:
    """C = C_0 + C_χ + C_A + C_i + C_p + C_Ψ and whatever other terms a problem has, summed over the load cases.

    Args:
        design: the sum of the terms that depend on χ alone, which count once.
        cases: the terms of each load case.
        names: of all terms, in the order in which they are reported.
    """

    def __init__(self, design: DesignObjective, cases: Sequence[StateObjective], names: Sequence[str]) -> None:
        self.design, self.cases, self._names = design, tuple(cases), tuple(names)

    def values(self, design: DesignTerms, at: Sequence[Fields]) -> dict[str, Value]:
        """All terms at a design, evaluated, and its states, by name in the order in which they are reported."""
        return self.summed(design, [case.values(fields) for case, fields in zip(self.cases, at, strict=True)])

    def summed(self, design: DesignTerms, of_cases: Sequence[Mapping[str, Value]]) -> dict[str, Value]:
        """The same from the values of every load case."""
        found = {name: _sum([values[name] for values in of_cases]) for name in of_cases[0]} | dict(design.terms)
        return {name: found[name] for name in self._names}

    def value(self, design: DesignTerms, at: Sequence[Fields]) -> float:
        """The sum of all terms."""
        total = design.value
        for case, fields in zip(self.cases, at, strict=True):
            total = case.value(fields, total)
        return total


class Weighted(StateTerm):
    """A term times a weight, which is positive; what it measures stays as it is."""

    def __init__(self, term: StateTerm, weight: float) -> None:
        self._term, self._weight = term, weight

    def value(self, at: Fields) -> Value:
        """The weighted term."""
        found = self._term.value(at)
        return Value(self._weight * found.value, found.measures)

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add the weighted derivatives."""
        own = into.blank()
        self._term.add_gradient(at, own)
        for total, part in zip(vars(into).values(), vars(own).values(), strict=True):
            total += self._weight * part

    def pressure_roots(self) -> Floats | None:
        """Those of the term, whose squares have the weight."""
        roots = self._term.pressure_roots()
        return None if roots is None else np.sqrt(self._weight) * roots


def _sum(found: Sequence[Value]) -> Value:
    """A term summed over load cases, with the largest of what it measures in any of them."""
    if len(found) == 1:
        return found[0]
    names = dict.fromkeys(name for each in found for name in each.measures)
    measures = {name: max(each.measures[name] for each in found if name in each.measures) for name in names}
    return Value(sum(each.value for each in found), measures)
