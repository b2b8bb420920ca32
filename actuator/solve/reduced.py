"""The reduced objective: a design's value and its exact gradient by the adjoint.

Both follow from the Lagrangian of Eq. (10), C + Λ·R, whose derivatives :func:`lagrangian_gradient` gives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.equations.assembly import scatter_vector
from actuator.equations.kinematics import ARM, THETA2, Kinematics
from actuator.equations.scheme import DEFAULT, Scheme
from actuator.linear import SolverName
from actuator.parameters import Load, Material, Objective
from actuator.regions.bounds import Regions
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.state import State
from actuator.terms import total_objective
from actuator.terms.design import DesignTerms
from actuator.terms.interface import Derivatives, Fields, Problem, Value
from actuator.terms.lagrangian import lagrangian_gradient


@dataclass(frozen=True)
class Evaluation:
    """A design, its state and its objective.

    Attributes:
        chi: (n_vertices,).
        state: converged state.
        values: of each term, and what it measures, by name.
        design: χ-only terms with gradient and Hessian.
    """

    chi: Floats
    state: State
    values: dict[str, Value]
    design: DesignTerms

    @property
    def value(self) -> float:
        """Total objective C, without C_t."""
        return sum(self.terms.values())

    @property
    def terms(self) -> dict[str, float]:
        """Value of each term, by name."""
        return {name: term.value for name, term in self.values.items()}

    @property
    def measures(self) -> dict[str, float]:
        """What the terms measure beside their values, by name."""
        return {name: value for term in self.values.values() for name, value in term.measures.items()}


@dataclass(frozen=True)
class Gradient:
    """Derivative of the total objective with respect to χ, and what it was made of.

    Attributes:
        total: dC/dχ, (n_vertices,).
        adjoint: (Λ_x, Λ_p), (n_x,) and (n_p,).
    """

    total: Floats
    adjoint: tuple[Floats, Floats]


class ReducedObjective:
    """C(χ) with the state eliminated: the terms of :mod:`actuator.terms` along the solutions of Eqs. (5) to (8)."""

    def __init__(
        self,
        domain: Domain,
        material: Material,
        load: Load,
        objective: Objective,
        *,
        state_tolerance: float = 1e-8,
        adjoint_tolerance: float = 1e-11,
        solver: SolverName = "auto",
        threads: int = 2,
        scheme: Scheme = DEFAULT,
        regions: Regions | None = None,
    ) -> None:
        self.domain, self.load, self.objective = domain, load, objective
        self.equilibrium = Equilibrium(
            domain, material, load, objective, tolerance=state_tolerance, solver=solver, threads=threads, scheme=scheme
        )
        self.discretisation = self.equilibrium.discretisation
        self.adjoint_tolerance = adjoint_tolerance
        self.problem = Problem(self.discretisation, self.equilibrium.coefficients, load, objective, regions)
        self.total = total_objective(self.problem, self.equilibrium.tangent.darcy)
        self.design = self.total.design

    # --------------------------------------------------------------------- value

    def evaluate(self, chi: Floats, start: tuple[Floats, Floats] | None = None) -> Evaluation:
        """State and value of a design; ``start`` is (x, p) to begin Newton's method with.

        Raises:
            actuator.solve.equilibrium.NoState: if the design has no state that Newton's method reaches.
        """
        state = self.equilibrium.solve(chi, start)
        design = self.design(chi)
        values = self.total.values(design, self.fields(chi, state.x, state.p))
        return Evaluation(chi, state, values, design)

    def fields(self, chi: Floats, x: Floats, p: Floats) -> Fields:
        """What terms are evaluated at; real or complex, all of one type."""
        kind = np.result_type(chi, x, p)
        u = self.equilibrium.kinematics.displacement(x)
        return Fields(*(field.astype(kind, copy=False) for field in (chi, u, p, x[ARM])))

    # ------------------------------------------------------------------ gradient

    def gradient(self, at: Evaluation, guess: tuple[Floats, Floats] | None = None) -> Gradient:
        """Exact gradient of the total objective by the adjoint (Eq. 16)."""
        state, equilibrium = at.state, self.equilibrium
        if equilibrium.coefficients.pressure == 0.0 and not state.x.any():
            # At rest there is neither stress nor flow that χ could change, whatever the multipliers.
            return Gradient(at.design.gradient, (np.zeros_like(state.x), np.zeros_like(state.p)))
        zero = np.zeros_like(state.x), np.zeros_like(state.p)
        _, gx, gp = self.derivatives(state.chi, state.x, state.p, *zero, state.nodal)
        lx, lp = equilibrium.linearise(state).solve(-gx, -gp, self.adjoint_tolerance, guess, transposed=True)
        equilibrium.work.adjoints += 1
        g_chi, _, _ = self.derivatives(state.chi, state.x, state.p, lx, lp, state.nodal)
        return Gradient(g_chi + at.design.gradient, (lx, lp))

    def derivatives(
        self, chi: Floats, x: Floats, p: Floats, lx: Floats, lp: Floats, nodal: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Derivatives of the state's terms + Λ·R with respect to χ, x and p; real or complex.

        Args:
            chi, x, p: design and state.
            lx, lp: Λ.
            nodal: nodal residual forces at the state, (n_nodes, 3), N.
        """
        equilibrium, kinematics = self.equilibrium, self.equilibrium.kinematics
        geometry, n = equilibrium.geometry, len(chi)
        kind = np.result_type(chi, x, p, lx, lp)
        at = Fields(*(field.astype(kind, copy=False) for field in self.fields(chi, x, p)))
        into = Derivatives.empty(geometry, n, kind)
        lagrangian_gradient(
            geometry,
            equilibrium.source,
            equilibrium.coefficients,
            at.chi,
            at.u,
            at.p,
            kinematics.variation(x, lx).astype(kind, copy=False),
            lp.astype(kind, copy=False),
            1.0 if self.total.strain_energy.weighs else 0.0,
            bool(np.any(lx)),
            into.chi,
            into.u,
            into.p,
        )
        self.total.add_gradient(at, into)
        gx = kinematics.force(x, scatter_vector(into.u, geometry.node_cells, len(self.domain.nodes)))
        gx[ARM] += kinematics.spring_tangent(x) @ lx[ARM]
        gx[THETA2] += kinematics.second_variation(x, nodal) * lx[THETA2]
        gx[ARM] += into.arm
        gp = scatter_vector(into.p, geometry.cells, n) + into.vertex_p
        return scatter_vector(into.chi, geometry.cells, n), gx, gp


def spring_elongation(kinematics: Kinematics, state: State) -> float:
    """Travel of the spring's end, mm; positive downwards, as the paper reports it."""
    return -float(kinematics.elongation(state.x))


def wall_leak(domain: Domain, p: Floats, pressure: float) -> float:
    """Largest p on the outside over the source pressure p_in; 0 without pressure."""
    return float(p[domain.outside.vertices].max()) / pressure if pressure > 0.0 else 0.0
