"""The sum of the terms: the one place where the objective is put together.

Both the reduced objective (:mod:`actuator.solve.reduced`) and the optimiser's model of it take it from here.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from actuator.arrays import Floats
from actuator.equations.assembly import Gather
from actuator.terms.design import DesignObjective, DesignTerms
from actuator.terms.interface import Derivatives, DesignTerm, Fields, Problem, StateTerm, Value
from actuator.terms.leak import Leak
from actuator.terms.main_objective import MainObjective
from actuator.terms.strain_energy import StrainEnergy

#: Names of the paper's terms, in the order in which they are reported.
PAPER = ("C0", "C_chi", "C_A", "C_i", "C_p", "C_psi")


class TotalObjective:
    """C = C_0 + C_χ + C_A + C_i + C_p + C_Ψ and whatever other terms a problem has.

    Args:
        problem: what the terms are built from.
        others: terms that the paper does not have, by name.
        gather: pattern of upper triangles on vertices.

    Attributes:
        design: the sum of the terms that depend on χ alone.
        main, leak, strain_energy: C_0, C_p and C_Ψ.
    """

    def __init__(self, problem: Problem, others: Mapping[str, DesignTerm | StateTerm], gather: Gather) -> None:
        design = {name: term for name, term in others.items() if isinstance(term, DesignTerm)}
        self.design = DesignObjective(problem, design, gather)
        self.main, self.leak, self.strain_energy = MainObjective(problem), Leak(problem), StrainEnergy(problem)
        self._state: dict[str, StateTerm] = {"C0": self.main, "C_p": self.leak, "C_psi": self.strain_energy}
        self._state |= {name: term for name, term in others.items() if isinstance(term, StateTerm)}
        self._names = (*PAPER, *others)

    def values(self, design: DesignTerms, at: Fields) -> dict[str, Value]:
        """All terms at a design, evaluated, and its state, by name in the order in which they are reported."""
        found = {name: term.value(at) for name, term in self._state.items()} | dict(design.terms)
        return {name: found[name] for name in self._names}

    def value(self, design: DesignTerms, at: Fields) -> float:
        """The sum of all terms: C_0, those of the design, and the others that depend on the state."""
        first, *rest = (term.value(at).value for term in self._state.values())
        return sum(rest, first + design.value)

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add the derivatives of the terms that depend on the state, at real or complex fields, but for C_Ψ's."""
        for term in self._state.values():
            term.add_gradient(at, into)

    def pressure_roots(self) -> Floats | None:
        """w with w² the sum of :meth:`StateTerm.pressure_roots` squared, (n_vertices,); None if no term has any."""
        roots = [found for term in self._state.values() if (found := term.pressure_roots()) is not None]
        return np.sqrt(sum(root**2 for root in roots)) if len(roots) > 1 else roots[0] if roots else None
