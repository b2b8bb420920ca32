"""The sum of the terms: the one place where the objective is put together.

Both the reduced objective (:mod:`actuator.solve.reduced`) and the optimiser's model of it take it from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.equations.assembly import Gather, scatter_vector
from actuator.equations.points import PointFields
from actuator.terms.interface import Derivatives, DesignTerm, Fields, Problem, StateTerm, Value
from actuator.terms.passive_region import PassiveRegion


@dataclass(frozen=True)
class DesignTerms:
    """The terms that depend on χ alone, evaluated.

    Attributes:
        terms: by name.
        gradient: of their sum, (n_vertices,).
        hessian: of their sum: data of the upper triangle, on the pattern of :attr:`DesignObjective.gather`.
    """

    terms: Mapping[str, Value]
    gradient: Floats
    hessian: Floats

    @property
    def value(self) -> float:
        """Sum of the terms."""
        return sum(term.value for term in self.terms.values())


class DesignObjective:
    """The sum of the terms that depend on χ alone.

    Args:
        problem: what the terms were built from.
        terms: by name.
        gather: pattern of upper triangles on vertices.

    Attributes:
        passive: C_χ.
        points: fields at the quadrature points.
    """

    def __init__(self, problem: Problem, terms: Mapping[str, DesignTerm], gather: Gather) -> None:
        self._terms, self.gather = terms, gather
        self._geometry = problem.discretisation.geometry
        self._n = problem.discretisation.domain.mesh.nvertices
        self.points = PointFields(self._geometry)
        self.passive = next(term for term in terms.values() if isinstance(term, PassiveRegion))
        n_cells = len(self._geometry.cells)
        self._g, self._h = np.empty((n_cells, 8)), np.empty((n_cells, 8, 8))

    @property
    def bound(self) -> PassiveRegion | None:
        """C_χ, which the optimiser takes for a bound, or None if it weighs nothing."""
        return self.passive if self.passive.weight > 0.0 else None

    def value(self, chi: Floats) -> float:
        """Sum of the terms alone, to the last bit that of a whole evaluation, at a fraction of the price."""
        return sum(term.value(chi) for term in self._terms.values())

    def __call__(self, chi: Floats) -> DesignTerms:
        """Evaluate at a design (n_vertices,)."""
        return self._evaluated(chi, self._terms)

    def smooth(self, chi: Floats) -> DesignTerms:
        """The same without the bound."""
        return self._evaluated(chi, {name: term for name, term in self._terms.items() if term is not self.bound})

    def _evaluated(self, chi: Floats, terms: Mapping[str, DesignTerm]) -> DesignTerms:
        self._g[:] = 0.0
        self._h[:] = 0.0
        values = {name: term.add(chi, self._g, self._h) for name, term in terms.items()}
        gradient = scatter_vector(self._g, self._geometry.cells, self._n)
        return DesignTerms(values, gradient, self.gather.data(self._h.ravel()))

    def from_points(self, values: Floats) -> Floats:
        """:meth:`PointFields.integral` of values (n_cells, n_q), (n_vertices,)."""
        return self.points.integral(values, self._n)

    def point_stiffness(self, values: Floats) -> Floats:
        """:meth:`PointFields.stiffness` of values (n_cells, n_q) on the pattern of :attr:`gather`."""
        return self.points.stiffness(values, self.gather)


class TotalObjective:
    """C = C_0 + C_χ + C_A + C_i + C_p + C_Ψ and whatever other terms a problem has.

    Args:
        problem: what the terms are built from.
        terms: by name, in the order in which they are reported.
        gather: pattern of upper triangles on vertices.

    Attributes:
        design: the sum of the terms that depend on χ alone.
        state: the others, by name.
    """

    def __init__(self, problem: Problem, terms: Mapping[str, DesignTerm | StateTerm], gather: Gather) -> None:
        self._names = tuple(terms)
        design = {name: term for name, term in terms.items() if isinstance(term, DesignTerm)}
        self.design = DesignObjective(problem, design, gather)
        self.state = {name: term for name, term in terms.items() if isinstance(term, StateTerm)}

    def state_terms(self, at: Fields) -> dict[str, Value]:
        """The terms that depend on the state."""
        return {name: term.value(at) for name, term in self.state.items()}

    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add the derivatives of the terms that depend on the state, at real or complex fields."""
        for term in self.state.values():
            term.add_gradient(at, into)

    def pressure_roots(self) -> Floats | None:
        """w with w² the sum of :meth:`StateTerm.pressure_roots` squared, (n_vertices,); None if no term has any."""
        roots = [found for term in self.state.values() if (found := term.pressure_roots()) is not None]
        return np.sqrt(sum(root**2 for root in roots)) if len(roots) > 1 else roots[0] if roots else None

    def in_order(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """Values by name in the order in which they are reported."""
        return {name: values[name] for name in self._names}
