"""The reduced objective: a design's value and its exact gradient by the adjoint.

Both follow from the Lagrangian of Eq. (10), C + Λ·R, whose derivatives :func:`lagrangian_gradient` gives.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.equations.assembly import scatter_vector
from actuator.equations.kinematics import Kinematics
from actuator.equations.scheme import DEFAULT, Scheme
from actuator.linear import SolverName
from actuator.load_case import LoadCase
from actuator.parameters import Load, Material, Objective
from actuator.regions.bounds import Regions
from actuator.solve.equilibrium import FACTORS, Equilibrium, NoState
from actuator.solve.stacking import split, stacked, summed
from actuator.solve.state import State
from actuator.terms import total_objective
from actuator.terms.design import DesignTerms
from actuator.terms.interface import Derivatives, Fields, Problem, Value
from actuator.terms.lagrangian import lagrangian_gradient
from actuator.terms.total import StateObjective


@dataclass(frozen=True)
class Evaluation:
    """A design, its state under every load case and its objective.

    Attributes:
        chi: (n_vertices,).
        states: converged states, one for each load case.
        values: of each term, summed over the load cases, and what it measures, by name.
        of_cases: the terms that depend on the state, for each load case.
        design: χ-only terms with gradient and Hessian.
    """

    chi: Floats
    states: tuple[State, ...]
    values: Mapping[str, Value]
    of_cases: tuple[Mapping[str, Value], ...]
    design: DesignTerms

    @property
    def state(self) -> State:
        """That of the first load case."""
        return self.states[0]

    @property
    def x(self) -> Floats:
        """Reduced coordinates of all load cases, one after the other."""
        return stacked([state.x for state in self.states])

    @property
    def p(self) -> Floats:
        """Pressure of all load cases, one after the other, N/mm²."""
        return stacked([state.p for state in self.states])

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
        adjoint: (Λ_x, Λ_p) of all load cases, one after the other: (n_cases n_x,) and (n_cases n_p,).
    """

    total: Floats
    adjoint: tuple[Floats, Floats]


class ReducedObjective:
    """C(χ) with the states eliminated: the terms of :mod:`actuator.terms` along the solutions of Eqs. (5) to (8).

    Load cases have states of their own. Taken together they are one state, whose x, p and multipliers are those of the
    load cases one after the other: its tangent is block diagonal, and whatever asks for a state need not know how many
    load cases there are.

    Args:
        load: the load, or several load cases.

    Attributes:
        cases: the equations and terms of every load case.
    """

    def __init__(
        self,
        domain: Domain,
        material: Material,
        load: Load | Sequence[LoadCase],
        objective: Objective,
        *,
        state_tolerance: float = 1e-8,
        adjoint_tolerance: float = 1e-11,
        solver: SolverName = "auto",
        threads: int = 2,
        scheme: Scheme = DEFAULT,
        regions: Regions | None = None,
    ) -> None:
        self.domain, self.objective = domain, objective
        self.adjoint_tolerance = adjoint_tolerance
        equilibria: list[Equilibrium] = []
        loads = [LoadCase(load)] if isinstance(load, Load) else load
        for case in loads:
            beside = equilibria[0] if equilibria else None
            made = Equilibrium(
                domain,
                material,
                case.load,
                objective,
                tolerance=state_tolerance,
                solver=solver,
                threads=threads,
                scheme=scheme,
                beside=beside,
            )
            equilibria.append(made)
        self.discretisation = equilibria[0].discretisation
        problems = [
            Problem(self.discretisation, equilibrium.coefficients, case.load, objective, case.goal, regions)
            for equilibrium, case in zip(equilibria, loads, strict=True)
        ]
        self.total = total_objective(problems, [case.weight for case in loads], equilibria[0].tangent.darcy)
        self.design = self.total.design
        self.cases = tuple(map(LoadedCase, loads, equilibria, problems, self.total.cases))

    @property
    def equilibrium(self) -> Equilibrium:
        """The equations of the first load case; all of them share discretisation, solver, threads and counts."""
        return self.cases[0].equilibrium

    @property
    def load(self) -> Load:
        """That of the first load case."""
        return self.cases[0].load

    def split(self, whole: Floats) -> list[Floats]:
        """What stands one after the other for all load cases, for each of them."""
        return split(whole, len(self.cases))

    # --------------------------------------------------------------------- value

    def evaluate(self, chi: Floats, start: tuple[Floats, Floats] | None = None) -> Evaluation:
        """States and value of a design; ``start`` is (x, p) of all load cases to begin Newton's method with.

        Raises:
            actuator.solve.equilibrium.NoState: if the design has no state that Newton's method reaches.
        """
        starts = [None] * len(self.cases) if start is None else list(zip(*map(self.split, start), strict=True))
        states = tuple(case.solve(chi, each) for case, each in zip(self.cases, starts, strict=True))
        design = self.design(chi)
        of_cases = tuple(
            case.terms.values(case.fields(chi, state.x, state.p))
            for case, state in zip(self.cases, states, strict=True)
        )
        return Evaluation(chi, states, self.total.summed(design, of_cases), of_cases, design)

    def fields(self, chi: Floats, x: Floats, p: Floats) -> list[Fields]:
        """What the terms of every load case are evaluated at; real or complex, all of one type."""
        return [case.fields(chi, *each) for case, *each in zip(self.cases, *map(self.split, (x, p)), strict=True)]

    # ------------------------------------------------------------------ gradient

    def gradient(self, at: Evaluation, guess: tuple[Floats, Floats] | None = None) -> Gradient:
        """Exact gradient of the total objective by the adjoint (Eq. 16)."""
        guesses = [None] * len(self.cases) if guess is None else list(zip(*map(self.split, guess), strict=True))
        found = [
            case.gradient(state, self.adjoint_tolerance, each)
            for case, state, each in zip(self.cases, at.states, guesses, strict=True)
        ]
        of_states, lx, lp = zip(*found, strict=True)
        return Gradient(summed(of_states) + at.design.gradient, (stacked(lx), stacked(lp)))

    def derivatives(
        self, chi: Floats, x: Floats, p: Floats, lx: Floats, lp: Floats, nodal: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """Derivatives of the state's terms + Λ·R with respect to χ, x and p; real or complex.

        Args:
            chi, x, p: design and state.
            lx, lp: Λ.
            nodal: nodal residual forces at the state, (n_cases n_nodes, 3), N.
        """
        parts = zip(self.cases, *map(self.split, (x, p, lx, lp, nodal)), strict=True)
        of_chi, of_x, of_p = zip(*(case.derivatives(chi, *each) for case, *each in parts), strict=True)
        return summed(of_chi), stacked(of_x), stacked(of_p)

    # ------------------------------------------------------------------- factors

    @property
    def factors(self) -> dict[str, Floats]:
        """Where the factors at hand of every load case come from, for :meth:`restore_factors`."""
        return {
            f"{_prefix(k)}{key}": value
            for k, case in enumerate(self.cases)
            for key, value in case.equilibrium.factors.items()
        }

    def restore_factors(self, factors: Mapping[str, Floats]) -> None:
        """Factorise where the stored :attr:`factors` come from, so that all goes on as it did there."""
        for k, case in enumerate(self.cases):
            stored = {key: factors[f"{_prefix(k)}{key}"] for key in FACTORS if f"{_prefix(k)}{key}" in factors}
            case.equilibrium.restore_factors(stored)


def _prefix(case: int) -> str:
    """Of the names of what is stored of a load case; the first one has none."""
    return f"{case}." if case else ""


class LoadedCase:
    """One load case of a reduced objective: its state equations, and the terms that depend on its state.

    Args:
        case: the load, its weight and its name.
        equilibrium: state equations under this load.
        problem: what the terms are made from.
        terms: their sum.
    """

    def __init__(self, case: LoadCase, equilibrium: Equilibrium, problem: Problem, terms: StateObjective) -> None:
        self.case, self.name, self.load, self.weight = case, case.name, case.load, case.weight
        self.equilibrium, self.problem, self.terms = equilibrium, problem, terms

    def solve(self, chi: Floats, start: tuple[Floats, Floats] | None) -> State:
        """The state of a design; ``start`` is (x, p) to begin with.

        Raises:
            actuator.solve.equilibrium.NoState: if there is none that Newton's method reaches.
        """
        try:
            return self.equilibrium.solve(chi, start)
        except NoState as failure:
            raise (NoState(f"Load case '{self.name}': {failure}") if self.name else failure) from None

    def fields(self, chi: Floats, x: Floats, p: Floats) -> Fields:
        """What terms are evaluated at; real or complex, all of one type."""
        kind = np.result_type(chi, x, p)
        kinematics = self.equilibrium.kinematics
        fields = chi, kinematics.displacement(x), p, kinematics.motion(x)
        return Fields(*(field.astype(kind, copy=False) for field in fields))

    def gradient(
        self, state: State, tolerance: float, guess: tuple[Floats, Floats] | None
    ) -> tuple[Floats, Floats, Floats]:
        """The part of dC/dχ that comes by way of the state, (n_vertices,), and Λ_x and Λ_p."""
        equilibrium, zero = self.equilibrium, (np.zeros_like(state.x), np.zeros_like(state.p))
        if self.load.none and not state.x.any():
            # At rest there is neither stress nor flow that χ could change, whatever the multipliers.
            return np.zeros_like(state.chi), *zero
        _, gx, gp = self.derivatives(state.chi, state.x, state.p, *zero, state.nodal)
        lx, lp = equilibrium.linearise(state).solve(-gx, -gp, tolerance, guess, transposed=True)
        equilibrium.work.adjoints += 1
        g_chi, _, _ = self.derivatives(state.chi, state.x, state.p, lx, lp, state.nodal)
        return g_chi, lx, lp

    def derivatives(
        self, chi: Floats, x: Floats, p: Floats, lx: Floats, lp: Floats, nodal: Floats
    ) -> tuple[Floats, Floats, Floats]:
        """As :meth:`ReducedObjective.derivatives`, of this load case alone."""
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
            1.0 if self.terms.strain_energy.weighs else 0.0,
            bool(np.any(lx)),
            into.chi,
            into.u,
            into.p,
        )
        self.terms.add_gradient(at, into)
        gx = kinematics.force(x, scatter_vector(into.u, geometry.node_cells, len(equilibrium.domain.nodes)))
        arm, turning = kinematics.of_arm, kinematics.second_variation(x, nodal)
        gx[arm] += (kinematics.spring_tangent(x) + turning) @ lx[arm] + kinematics.arm.free(into.arm)
        gp = scatter_vector(into.p, geometry.cells, n) + into.vertex_p
        return scatter_vector(into.chi, geometry.cells, n), gx, gp


def spring_elongation(kinematics: Kinematics, state: State) -> float:
    """Travel of the spring's end, mm; positive downwards, as the paper reports it."""
    return -float(kinematics.elongation(state.x))


def wall_leak(domain: Domain, p: Floats, pressure: float) -> float:
    """Largest p on the outside over the source pressure p_in; 0 without pressure."""
    return float(p[domain.outside.vertices].max()) / pressure if pressure > 0.0 else 0.0
