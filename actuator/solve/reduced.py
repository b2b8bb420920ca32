"""The reduced objective: a design's value and its exact gradient by the adjoint.

Both follow from the Lagrangian of Eq. (10), C + Λ·R, whose derivatives :func:`lagrangian_gradient` gives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.equations.assembly import scatter_vector
from actuator.equations.kernels import lagrangian_gradient, strain_energy_excess
from actuator.equations.kinematics import Kinematics
from actuator.equations.scheme import DEFAULT, Scheme
from actuator.linear import SolverName
from actuator.parameters import Load, Material, Objective
from actuator.solve.equilibrium import Equilibrium, State
from actuator.terms.design_terms import DesignObjective, DesignTerms

TERMS = ("C0", "C_chi", "C_A", "C_i", "C_p", "C_psi")


@dataclass(frozen=True)
class Evaluation:
    """A design, its state and its objective.

    Attributes:
        chi: (n_vertices,).
        state: converged state.
        terms: value of each of :data:`TERMS`.
        design: χ-only terms with gradient and Hessian.
        energy_ratio: largest Ψ(χ + 4/L_i, u) / Ψ_lim.
    """

    chi: Floats
    state: State
    terms: dict[str, float]
    design: DesignTerms
    energy_ratio: float

    @property
    def value(self) -> float:
        """Total objective C, without C_t."""
        return sum(self.terms.values())


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
    """C(χ) = C_0 + C_χ + C_A + C_i + C_p + C_Ψ with the state eliminated (Eqs. 9 to 14)."""

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
    ) -> None:
        self.domain, self.load, self.objective = domain, load, objective
        self.equilibrium = Equilibrium(
            domain, material, load, objective, tolerance=state_tolerance, solver=solver, threads=threads, scheme=scheme
        )
        self.discretisation = self.equilibrium.discretisation
        self.design = DesignObjective(self.discretisation, objective, self.equilibrium.tangent.darcy)
        self.adjoint_tolerance = adjoint_tolerance
        # A case without pressure has no leak to measure.
        scale = objective.leak_weight / load.pressure**2 if load.pressure > 0.0 else 0.0
        #: C_p = pᵀ W p / 2
        self.leak = scale * self.discretisation.wall_mass

    # --------------------------------------------------------------------- value

    def evaluate(self, chi: Floats, start: tuple[Floats, Floats] | None = None) -> Evaluation:
        """State and value of a design; ``start`` is (x, p) to begin Newton's method with.

        Raises:
            actuator.solve.equilibrium.NoState: if the design has no state that Newton's method reaches.
        """
        state = self.equilibrium.solve(chi, start)
        design = self.design(chi)
        energy, ratio = strain_energy_excess(
            self.equilibrium.geometry, self.equilibrium.coefficients, chi, state.displacement
        )
        values = (
            main_objective(state.x, self.load),
            design.passive,
            design.area,
            design.slope,
            0.5 * float(state.p @ (self.leak @ state.p)),
            float(energy),
        )
        return Evaluation(chi, state, dict(zip(TERMS, values, strict=True)), design, float(ratio))

    # ------------------------------------------------------------------ gradient

    def gradient(self, at: Evaluation, guess: tuple[Floats, Floats] | None = None) -> Gradient:
        """Exact gradient of the total objective by the adjoint (Eq. 16)."""
        state, equilibrium = at.state, self.equilibrium
        if equilibrium.coefficients.pressure == 0.0 and not state.x.any():
            # At rest there is neither stress nor flow that χ could change, whatever the multipliers.
            return Gradient(at.design.gradient, (np.zeros_like(state.x), np.zeros_like(state.p)))
        zero = np.zeros_like(state.x), np.zeros_like(state.p)
        _, gx, gp = self.derivatives(state.chi, state.x, state.p, *zero, state.nodal)
        lx, lp = equilibrium.solve_adjoint(state, -gx, -gp, self.adjoint_tolerance, guess)
        equilibrium.work.adjoints += 1
        g_chi, _, _ = self.derivatives(state.chi, state.x, state.p, lx, lp, state.nodal)
        return Gradient(g_chi + at.design.gradient, (lx, lp))

    def derivatives(
        self, chi: Floats, x: Floats, p: Floats, lx: Floats, lp: Floats, nodal: Floats, energy: float = 1.0
    ) -> tuple[Floats, Floats, Floats]:
        """Derivatives of C_0 + C_p + C_Ψ + Λ·R with respect to χ, x and p; real or complex.

        ``nodal`` are the nodal residual forces at the state. ``energy`` = 0 leaves out everything but Λ·R.
        """
        equilibrium, kinematics = self.equilibrium, self.equilibrium.kinematics
        geometry = equilibrium.geometry
        kind = np.result_type(chi, x, p, lx, lp)
        n_cells = len(geometry.cells)
        g_chi, g_u, g_p = np.empty((n_cells, 8), kind), np.empty((n_cells, 20, 3), kind), np.empty((n_cells, 8), kind)
        lagrangian_gradient(
            geometry,
            equilibrium.source,
            equilibrium.coefficients,
            chi.astype(kind),
            kinematics.displacement(x).astype(kind),
            p.astype(kind),
            kinematics.variation(x, lx).astype(kind),
            lp.astype(kind),
            energy if self.objective.strain_energy_weight else 0.0,
            bool(np.any(lx)),
            g_chi,
            g_u,
            g_p,
        )
        n = len(chi)
        gx = kinematics.force(x, scatter_vector(g_u, geometry.node_cells, len(self.domain.nodes)))
        gx[-3:] += kinematics.spring_tangent(x) @ lx[-3:]
        gx[-1] += kinematics.second_variation(x, nodal) * lx[-1]
        gp = scatter_vector(g_p, geometry.cells, n)
        if energy != 0.0:
            gx[-3:] += main_objective_gradient(x, self.load)
            gp += self.leak @ p
        return scatter_vector(g_chi, geometry.cells, n), gx, gp


def main_objective(x: Floats, load: Load) -> float:
    """C_0 of Eq. (9), dimensionless."""
    lift = x[-2] / load.arm_length
    return float(lift - np.sin(x[-1]) + 500.0 * max(lift, 0.0) ** 2)


def main_objective_gradient(x: Floats, load: Load) -> Floats:
    """Derivative of C_0 with respect to T, (3,)."""
    lift = x[-2] / load.arm_length
    positive = lift if lift.real > 0.0 else 0.0 * lift
    return np.array([0.0 * lift, (1.0 + 1000.0 * positive) / load.arm_length, -np.cos(x[-1])])


def spring_elongation(kinematics: Kinematics, state: State) -> float:
    """Travel of the spring's end, mm; positive downwards, as the paper reports it."""
    return -float(kinematics.elongation(state.x))


def wall_leak(domain: Domain, p: Floats, pressure: float) -> float:
    """Largest p on the outside over the source pressure p_in; 0 without pressure."""
    return float(p[domain.outside.vertices].max()) / pressure if pressure > 0.0 else 0.0
