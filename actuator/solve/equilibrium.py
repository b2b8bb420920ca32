"""The pressurised state: residuals of Eqs. (5) to (8), and Newton's method on them."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.equations.assembly import scatter_vector
from actuator.equations.discretisation import Discretisation
from actuator.equations.kernels import residual
from actuator.equations.kinematics import Kinematics
from actuator.equations.scheme import DEFAULT, Scheme
from actuator.equations.tangent import Tangent
from actuator.equations.tangent_kernels import darcy_metric, darcy_tangent
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver, SolverName, Statistics, make_solver
from actuator.material.constants import constants_of
from actuator.parameters import Load, Material, Objective
from actuator.solve.flow import Flow, FlowWorkspace, Inverted
from actuator.solve.linearisation import Linearisation, Work, Workspace
from actuator.solve.state import State

MAX_NEWTON = 25
#: What helps where there is no state, from rest at the full pressure and from the state of another design.
AT_REST = "raise material.hessian_regularisation, {}or begin with a design whose walls hold the air"
LOWER = "lower load.pressure_ratio, "
#: A pressure below this share of G strains the solid by less than a thousandth or so: it is not what hinders.
GENTLE = 1e-3
#: What is stored of factors: the design and state that they belong to, and how much they have been used.
FACTORS = ("chi", "x", "p", "uses")
NEARBY = "take a smaller design step, or raise material.hessian_regularisation"


class NoState(SolveFailure):
    """Newton's method found no state for this design from the given start."""


class Equilibrium:
    """State equations of one case: residuals, tangents, Newton's method, tangent and adjoint solves.

    Args:
        domain: the meshed design domain.
        material, load, objective: parameters of the model.
        tolerance: relative residual of a converged state.
        solver: name of the direct solver.
        threads: used by the direct solver.
        scheme: numerical choices. By default the mechanical block is factorised in single precision: it only
            preconditions, and costs half.
        beside: the equations of the same case under another load, to share the discretisation and the counts with.
    """

    def __init__(
        self,
        domain: Domain,
        material: Material,
        load: Load,
        objective: Objective,
        *,
        tolerance: float = 1e-8,
        solver: SolverName = "auto",
        threads: int = 2,
        scheme: Scheme = DEFAULT,
        beside: Equilibrium | None = None,
    ) -> None:
        self.domain, self.scheme = domain, scheme
        self.discretisation: Discretisation = beside.discretisation if beside else Discretisation(domain, scheme)
        self.geometry = self.discretisation.geometry
        self.kinematics = Kinematics(domain, load, scheme.element)
        self.coefficients = constants_of(material, load, objective)
        self._at_rest = AT_REST.format(LOWER if load.pressure > GENTLE * material.shear else "")
        self.source = self.discretisation.source(material.drainage)
        #: Q_in by what it brings in, at the quadrature points: chambers below p_in count by their share of it.
        self.fed = self.source
        self._lacking: Floats | None = None
        if load.chambers and load.pressure > 0.0:
            self.fed = self.discretisation.fed(material.drainage, [own / load.pressure for own in load.chambers])
            # The residual's elements have p_in everywhere.
            self._lacking = load.pressure * self.discretisation.integral(self.source - self.fed)
        self.tangent = Tangent(self.discretisation, self.kinematics)
        self.tolerance, self.solver, self.threads = tolerance, solver, threads
        self.work: Work = beside.work if beside else Work()
        mechanics = self.tangent.mechanics
        self._workspace = Workspace(
            self.tangent,
            make_solver(
                mechanics.indptr,
                mechanics.indices,
                symmetric=True,
                precision=scheme.precision,
                name=solver,
                threads=threads,
            ),
            self.vertex_solver(),
            self.work,
        )
        self._flow = FlowWorkspace(self.vertex_solver())
        self._scales: tuple[float, float] | None = None

    def vertex_solver(self) -> DirectSolver:
        """A new solver for symmetric positive definite matrices on the pattern of the vertices."""
        darcy = self.tangent.darcy
        return make_solver(
            darcy.indptr,
            darcy.indices,
            symmetric=True,
            positive_definite=True,
            name=self.solver,
            threads=self.threads,
        )

    # ------------------------------------------------------------------ residual

    def residual(self, chi: Floats, x: Floats, p: Floats) -> tuple[Floats, Floats, Floats, float]:
        """Residuals in x (N, N mm) and p (mm³/s), nodal forces (n_nodes, 3) and smallest det F; real or complex."""
        kind = np.result_type(chi, x, p)
        n_cells = len(self.geometry.cells)
        Ru, Rp = np.empty((n_cells, 20, 3), kind), np.empty((n_cells, 8), kind)
        u = self.kinematics.displacement(x).astype(kind, copy=False)
        lowest = residual(
            self.geometry,
            self.source,
            self.coefficients,
            chi.astype(kind, copy=False),
            u,
            p.astype(kind, copy=False),
            True,
            Ru,
            Rp,
        )
        nodal = scatter_vector(Ru, self.geometry.node_cells, len(u))
        rx = self.kinematics.force(x, nodal)
        rx[self.kinematics.of_arm] += self.kinematics.spring_force(x)
        return rx, self._flows(Rp, len(p)), nodal, float(lowest)

    def flow_residual(self, chi: Floats, x: Floats, p: Floats) -> Floats:
        """Residual of Eq. (5) alone, (n_vertices,), mm³/s; real or complex, at a fraction of the price."""
        kind = np.result_type(chi, x, p)
        Ru, Rp = np.empty((0, 20, 3), kind), np.empty((len(self.geometry.cells), 8), kind)
        u = self.kinematics.displacement(x).astype(kind, copy=False)
        fields = chi.astype(kind, copy=False), u, p.astype(kind, copy=False)
        residual(self.geometry, self.source, self.coefficients, *fields, False, Ru, Rp)
        return self._flows(Rp, len(p))

    def _flows(self, Rp: Floats, n_vertices: int) -> Floats:
        flows = scatter_vector(Rp, self.geometry.cells, n_vertices)
        return flows if self._lacking is None else flows + self._lacking

    def at(self, chi: Floats, x: Floats, p: Floats) -> State:
        """The state at any displacements and pressure, with its relative residual."""
        rx, rp, nodal, lowest = self.residual(chi, x, p)
        return self._state(chi, x, p, rx, rp, nodal, lowest)

    def _state(self, chi: Floats, x: Floats, p: Floats, rx: Floats, rp: Floats, nodal: Floats, lowest: float) -> State:
        norm = np.inf if lowest <= 0.0 else self.norm(rx, rp)
        u, motion = self.kinematics.displacement(x), self.kinematics.motion(x)
        return State(chi, x, p, u, nodal, motion, norm if np.isfinite(norm) else np.inf, lowest)

    def norm(self, rx: Floats, rp: Floats) -> float:
        """Relative size of residuals in x and p; see :attr:`scales`."""
        force, flow = self.scales
        return float(np.hypot(np.linalg.norm(rx) / force, np.linalg.norm(rp) / flow))

    @property
    def scales(self) -> tuple[float, float]:
        """Forces (N) and flows (mm³/s) that residuals are measured against: those of the load itself."""
        if self.kinematics.load.none:  # measuring against it would be measuring against rounding
            return 1.0, 1.0
        if self._scales is None:
            p = np.full(self.domain.mesh.nvertices, self.coefficients.pressure)
            zero, void = np.zeros(self.kinematics.size), np.full_like(p, -30.0)
            # Forces of the pressure on the boundary of a fully pressurised void; inflow from the source at p = 0.
            rx, _, _, _ = self.residual(void, zero, p)
            _, rp, _, _ = self.residual(void, zero, 0.0 * p)
            self._scales = (float(np.linalg.norm(rx)) or 1.0, float(np.linalg.norm(rp)) or 1.0)
        return self._scales

    # ---------------------------------------------------------- pressure, Eq. (5)

    def flow(self, chi: Floats, x: Floats) -> Flow:
        """The factorised matrix of Eq. (5) at given displacements; that at hand if it is theirs.

        Raises:
            actuator.solve.flow.Inverted: if an element is turned inside out.
        """
        at_hand = self._flow.owner
        if at_hand is not None and at_hand.belongs_to(chi, x):
            return at_hand
        geometry, u = self.geometry, self.kinematics.displacement(x)
        metric = np.empty((len(geometry.cells), geometry.shape.shape[0], 6))
        elements = np.empty((len(geometry.cells), 8, 8))
        if darcy_metric(geometry, u, metric) <= 0.0:
            raise Inverted("An element is turned inside out: take a smaller step.")
        darcy_tangent(geometry, self.source, self.coefficients, chi, metric, elements)
        self.work.darcy_factorisations += 1
        return Flow(self._flow, self.tangent.darcy.data(elements.ravel()), chi, x)

    def pressure(self, chi: Floats, x: Floats) -> Floats:
        """Solve Eq. (5) for p at given displacements, (n_vertices,), N/mm².

        Raises:
            actuator.solve.flow.Inverted: if an element is turned inside out.
        """
        return self.flow(chi, x).solve(-self.flow_residual(chi, x, np.zeros(len(chi))))

    # -------------------------------------------------------------------- Newton

    def solve(self, chi: Floats, start: tuple[Floats, Floats] | None = None) -> State:
        """The state of a design by Newton's method; rest, without solving anything, where there is no load.

        The factors at hand serve, or where they have become too dear those of the tangent at the start.

        Args:
            chi: design, (n_vertices,).
            start: x and p to start from; at rest if None.

        Raises:
            NoState: if Newton's method does not converge.
        """
        if self.kinematics.load.none:
            return self._rest(chi)
        fresh, remedy = start is None or self._workspace.worn, self._at_rest if start is None else NEARBY
        self._workspace.uses.append(0)
        if start is None:
            x = np.zeros(self.kinematics.size)
            start = x, self.pressure(chi, x)
        x, p = start
        rx, rp, nodal, lowest = self.residual(chi, x, p)
        now = self._state(chi, x, p, rx, rp, nodal, lowest)
        if lowest <= 0.0:
            raise NoState("The start of Newton's method has an inverted element: take a smaller design step.")
        for _ in range(MAX_NEWTON):
            if now.residual <= self.tolerance:
                # The leak through a wall is far smaller than the inflow that residuals are measured against: solve
                # for p once more, to rounding.
                self.work.states += 1
                return self.at(chi, now.x, self.pressure(chi, now.x))
            tangent, fresh = self.linearise(now, fresh=fresh), False
            # Inexact Newton: no more digits than the next iterate can use (Eisenstat & Walker 1996).
            tolerance = max(min(self.scheme.forcing, now.residual), 0.1 * self.tolerance / now.residual)
            dx, dp = tangent.solve(-rx, -rp, tolerance)
            self.work.newton += 1
            step = 1.0
            while True:
                x, p = now.x + step * dx, now.p + step * dp
                rx, rp, nodal, lowest = self.residual(chi, x, p)
                trial = self._state(chi, x, p, rx, rp, nodal, lowest)
                if trial.residual <= (1.0 - 1e-4 * step) * now.residual:
                    break
                step *= 0.5
                if step < 1e-3:
                    raise NoState(f"Newton's method stalled at a relative residual of {now.residual:.1e}: {remedy}.")
            now = trial
        raise NoState(
            f"Newton's method did not converge in {MAX_NEWTON} steps (relative residual {now.residual:.1e}): {remedy}."
        )

    def _rest(self, chi: Floats) -> State:
        self.work.states += 1
        x, u = np.zeros(self.kinematics.size), np.zeros((len(self.domain.nodes), 3))
        motion = self.kinematics.motion(x)
        return State(chi, x, np.zeros(len(chi)), u, np.zeros_like(u), motion, residual=0.0, lowest_jacobian=1.0)

    # ------------------------------------------------------------- linear solves

    def linearise(self, state: State, *, fresh: bool = False) -> Linearisation:
        """The tangent at a state; that at hand if it is the state's. Those before can no longer be used.

        Args:
            state: converged or not.
            fresh: whether the mechanical block has to be factorised at this state.

        Raises:
            actuator.failure.SolveFailure: if a block cannot be factorised.
        """
        at_hand = self._workspace.owner
        if at_hand is None or at_hand.at is not state:
            return Linearisation(self._workspace, state, self.source, self.coefficients, self.scales, fresh=fresh)
        if fresh:
            at_hand.factorise()
        return at_hand

    def forget_factors(self) -> None:
        """Let the next linearisation factorise anew, whatever came before."""
        self._workspace.owner, self._workspace.factors_of = None, None

    @property
    def factors(self) -> dict[str, Floats]:
        """Where the factors at hand come from and what they have cost, for :meth:`restore_factors`; empty if none."""
        workspace = self._workspace
        if (of := workspace.factors_of) is None:
            return {}
        return dict(zip(FACTORS, (of.chi, of.x, of.p, np.array(workspace.uses, dtype=np.float64)), strict=True))

    def restore_factors(self, factors: dict[str, Floats]) -> None:
        """Factorise where the stored :attr:`factors` come from, so that all goes on as it did there."""
        if factors:
            self.linearise(self.at(factors["chi"], factors["x"], factors["p"]), fresh=True)
            self._workspace.uses, self._workspace.untried = [int(n) for n in factors["uses"]], False

    @property
    def statistics(self) -> Statistics:
        """What the direct solver of the mechanical block has done so far."""
        return self._workspace.mechanics.statistics
