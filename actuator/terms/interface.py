"""What a term of the objective is: value, gradient and curvature side by side.

There are two kinds. A :class:`DesignTerm` depends on χ alone and gives its exact Hessian, which the optimiser's
subproblem takes as it is. A :class:`StateTerm` also depends on displacements, pressure and the arm; its gradient takes
complex fields, so that the complex step (Squire & Trapp 1998, doi:10.1137/S003614459631241X) on it is its exact
curvature along any direction. A class of either kind is registered in :data:`actuator.terms.TERMS`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from actuator.arrays import Floats
from actuator.equations.arm import COORDINATES
from actuator.equations.discretisation import Discretisation, Geometry
from actuator.material.constants import Constants
from actuator.parameters import Load, Objective
from actuator.regions.bounds import Regions
from actuator.terms.goals.bending import PAPER_GOAL
from actuator.terms.goals.interface import Goal


@dataclass(frozen=True)
class Problem:
    """What terms are built from.

    Attributes:
        discretisation: spaces on the domain.
        coefficients: of the material's laws, as compiled code takes them.
        load: pressure, arm and spring.
        objective: weights and limits.
        goal: what C_0 is.
        regions: of the domain that stay void or solid; none if None.
    """

    discretisation: Discretisation
    coefficients: Constants
    load: Load
    objective: Objective
    goal: Goal = PAPER_GOAL
    regions: Regions | None = None


class Fields(NamedTuple):
    """A design and a state, real or complex.

    Attributes:
        chi: χ at the vertices, (n_vertices,).
        u: displacements at the nodes, (n_nodes, 3), mm.
        p: pressure at the vertices, (n_vertices,), N/mm².
        arm: all six coordinates of the arm, mm and rad, (6,); see :data:`actuator.equations.arm.COORDINATES`.
    """

    chi: NDArray[Any]
    u: NDArray[Any]
    p: NDArray[Any]
    arm: NDArray[Any]


@dataclass(frozen=True)
class Derivatives:
    """Derivatives with respect to :class:`Fields`, as terms add to them: per element, and where that is shorter whole.

    Attributes:
        chi, u, p: per element, (n_cells, 8), (n_cells, 20, 3) and (n_cells, 8).
        vertex_p: with respect to p at the vertices, (n_vertices,).
        arm: with respect to the arm's coordinates, (6,); of a half those that it lacks do not count.
    """

    chi: NDArray[Any]
    u: NDArray[Any]
    p: NDArray[Any]
    vertex_p: NDArray[Any]
    arm: NDArray[Any]

    @classmethod
    def empty(cls, geometry: Geometry, n_vertices: int, kind: Any) -> Derivatives:
        """Room for the elements' derivatives, not yet set, and zeros for the others."""
        n = len(geometry.cells)
        element = np.empty((n, 8), kind), np.empty((n, 20, 3), kind), np.empty((n, 8), kind)
        return cls(*element, np.zeros(n_vertices, kind), np.zeros(len(COORDINATES), kind))

    def blank(self) -> Derivatives:
        """Zeros of the same shapes and type."""
        return Derivatives(*map(np.zeros_like, vars(self).values()))


@dataclass(frozen=True)
class Value:
    """A term's value, and what else was measured on the way, by name, for the history.

    Attributes:
        value: dimensionless.
        measures: dimensionless, such as the largest strain energy over its limit.
    """

    value: float
    measures: Mapping[str, float] = field(default_factory=dict)


class DesignTerm(ABC):
    """A term that depends on the design alone."""

    @abstractmethod
    def value(self, chi: Floats) -> float:
        """The term at χ, (n_vertices,); to the last bit that of :meth:`add`, at a fraction of the price."""

    @abstractmethod
    def add(self, chi: Floats, gradient: Floats, hessian: Floats) -> Value:
        """Add the derivatives of every element to (n_cells, 8) and (n_cells, 8, 8), and return the value."""


class StateTerm(ABC):
    """A term that depends on the state, and perhaps on the design."""

    @abstractmethod
    def value(self, at: Fields) -> Value:
        """The term at real fields; infinite where it is not defined."""

    @abstractmethod
    def add_gradient(self, at: Fields, into: Derivatives) -> None:
        """Add the derivatives at real or complex fields."""

    def pressure_roots(self) -> Floats | None:
        """w, (n_vertices,), if the term's curvature in p is about diag(w²); None if it has none.

        The optimiser's estimate of the Hessian's diagonal uses it.
        """
        return None
