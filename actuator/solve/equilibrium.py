"""The pressurised state: Newton's method on Eqs. (5) to (8), and linear solves with its tangent.

One factorisation of the symmetric mechanical block preconditions GMRES on the coupled tangent; it serves several
Newton steps, the adjoint and later designs, until the iteration count says that a fresh one is cheaper.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

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
from actuator.linear import SolverName, gmres, make_solver
from actuator.material.ersatz import Coefficients
from actuator.parameters import Load, Material, Objective
from actuator.solve.coupled import CoupledSystem
from actuator.solve.weights import Lever, adjoint_balance

#: Iterations of one coupled solve after which the mechanical block is factorised anew: on the paper's mesh a
#: factorisation costs about as much as this many triangular solves.
STALE_ITERATIONS = 25
MAX_NEWTON = 25
MAX_KRYLOV = 120
#: Residual that serves where rounding lets a solve get no lower: adjoints far beyond the strain limit, all C_Ψ's.
ROUNDING = 1e-9
#: What helps where there is no state, from rest at the full pressure and from the state of another design.
AT_REST = (
    "raise material.hessian_regularisation, lower load.pressure_ratio, or begin with a design whose walls hold the air"
)
NEARBY = "take a smaller design step, or raise material.hessian_regularisation"


@dataclass
class Work:
    """Counts of what has been done, for the history and for benchmarks."""

    newton: int = 0
    krylov: int = 0
    factorisations: int = 0
    darcy_factorisations: int = 0
    states: int = 0
    adjoints: int = 0
    products: int = 0


@dataclass(frozen=True)
class State:
    """A converged state.

    Attributes:
        chi: the design it belongs to, (n_vertices,).
        x: reduced displacements and T, (n_x,); see :class:`actuator.equations.kinematics.Kinematics`.
        p: pressure, (n_vertices,), N/mm².
        displacement: u, (n_nodes, 3), mm.
        nodal: nodal residual forces, (n_nodes, 3), N; on Γ they are the reactions that replace q.
        residual: relative residual reached.
        lowest_jacobian: smallest det F at the quadrature points.
    """

    chi: Floats
    x: Floats
    p: Floats
    displacement: Floats
    nodal: Floats
    residual: float
    lowest_jacobian: float

    @property
    def arm(self) -> Floats:
        """T = [T1, T3 (mm), θ2 (rad)]."""
        return self.x[-3:]


class NoState(SolveFailure):
    """Newton's method found no state for this design from the given start."""


@dataclass
class _Residual:
    x: Floats
    p: Floats
    nodal: Floats
    lowest: float
    norm: float = field(default=np.inf)


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
    ) -> None:
        self.domain, self.scheme = domain, scheme
        self.discretisation = Discretisation(domain, scheme)
        self.geometry = self.discretisation.geometry
        self.kinematics = Kinematics(domain, load, scheme.element)
        self.coefficients = Coefficients.of(material, load, objective)
        self.source = self.discretisation.source(material.drainage)
        self.tangent = Tangent(self.discretisation, self.kinematics)
        self.tolerance, self.solver, self.threads = tolerance, solver, threads
        self.work = Work()
        mechanics, darcy = self.tangent.mechanics, self.tangent.darcy
        self.mechanical_solver = make_solver(
            mechanics.indptr,
            mechanics.indices,
            symmetric=True,
            precision=scheme.precision,
            name=solver,
            threads=threads,
        )
        self.darcy_solver = make_solver(
            darcy.indptr, darcy.indices, symmetric=True, positive_definite=True, name=solver, threads=threads
        )
        # Two more solvers on the vertices' pattern, for the optimiser: Darcy with u frozen, and the design's Hessian.
        self.frozen_darcy_solver, self.design_solver = (
            make_solver(
                darcy.indptr, darcy.indices, symmetric=True, positive_definite=True, name=solver, threads=threads
            )
            for _ in range(2)
        )
        self.lever = Lever(domain)
        self._moments = mechanics.indices == self.kinematics.size - 1
        self._balance = adjoint_balance(domain, material)
        self._stale = self._fresh = True
        self._scales: tuple[float, float] | None = None
        self._linearised_at: State | None = None
        self._frozen_at: tuple[Floats, Floats] | None = None  # χ and x whose Darcy matrix is factorised

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
        rx[-3:] += self.kinematics.spring_force(x)
        return rx, scatter_vector(Rp, self.geometry.cells, len(p)), nodal, float(lowest)

    def flow_residual(self, chi: Floats, x: Floats, p: Floats) -> Floats:
        """Residual of Eq. (5) alone, (n_vertices,), mm³/s; real or complex, at a fraction of the price."""
        kind = np.result_type(chi, x, p)
        Ru, Rp = np.empty((0, 20, 3), kind), np.empty((len(self.geometry.cells), 8), kind)
        u = self.kinematics.displacement(x).astype(kind, copy=False)
        fields = chi.astype(kind, copy=False), u, p.astype(kind, copy=False)
        residual(self.geometry, self.source, self.coefficients, *fields, False, Ru, Rp)
        return scatter_vector(Rp, self.geometry.cells, len(p))

    def tip_forces(self, chi: Floats, x: Floats, p: Floats) -> Floats:
        """Nodal residual forces (n_nodes, 3) from the cells at the tip alone, which is all that acts on Γ; N."""
        geometry, kind, tip = self.geometry, np.result_type(chi, x, p), self.domain.tip_cells
        part = geometry._replace(
            cells=geometry.cells[tip], node_cells=geometry.node_cells[tip], cell_class=geometry.cell_class[tip]
        )
        Ru, Rp = np.empty((len(part.cells), 20, 3), kind), np.empty((len(part.cells), 8), kind)
        u = self.kinematics.displacement(x).astype(kind, copy=False)
        fields = chi.astype(kind, copy=False), u, p.astype(kind, copy=False)
        residual(part, self.source, self.coefficients, *fields, True, Ru, Rp)
        return scatter_vector(Ru, part.node_cells, len(u))

    def _evaluate(self, chi: Floats, x: Floats, p: Floats) -> _Residual:
        rx, rp, nodal, lowest = self.residual(chi, x, p)
        norm = np.inf if lowest <= 0.0 else self.norm(rx, rp)
        return _Residual(rx, rp, nodal, lowest, norm if np.isfinite(norm) else np.inf)

    def norm(self, rx: Floats, rp: Floats) -> float:
        """Relative size of residuals in x and p; see :attr:`scales`."""
        force, flow = self.scales
        return float(np.hypot(self.lever.norm(rx) / force, np.linalg.norm(rp) / flow))

    @property
    def scales(self) -> tuple[float, float]:
        """Forces (N) and flows (mm³/s) that residuals are measured against: those of the load itself."""
        if self.coefficients.pressure == 0.0:  # no load: measuring against it would be measuring against rounding
            return 1.0, 1.0
        if self._scales is None:
            p = np.full(self.domain.mesh.nvertices, self.coefficients.pressure)
            zero, void = np.zeros(self.kinematics.size), np.full_like(p, -30.0)
            # Forces of the pressure on the boundary of a fully pressurised void; inflow from the source at p = 0.
            rx, _, _, _ = self.residual(void, zero, p)
            _, rp, _, _ = self.residual(void, zero, 0.0 * p)
            self._scales = (self.lever.norm(rx) or 1.0, float(np.linalg.norm(rp)) or 1.0)
        return self._scales

    # -------------------------------------------------------------------- Newton

    def pressure(self, chi: Floats, x: Floats) -> Floats:
        """Solve Eq. (5) for p at given displacements, (n_vertices,), N/mm².

        Its matrix stays factorised in :attr:`frozen_darcy_solver`.
        """
        self.freeze(chi, x)
        return self.frozen_darcy_solver.solve(-self.flow_residual(chi, x, np.zeros(len(chi))))

    def freeze(self, chi: Floats, x: Floats) -> None:
        """Have the matrix of Eq. (5) at given displacements factorised in :attr:`frozen_darcy_solver`, if it is not."""
        if self._frozen_at is not None and all(map(np.array_equal, self._frozen_at, (chi, x))):
            return
        self._frozen_at = None
        geometry, u = self.geometry, self.kinematics.displacement(x)
        metric = np.empty((len(geometry.cells), geometry.shape.shape[0], 6))
        elements = np.empty((len(geometry.cells), 8, 8))
        darcy_metric(geometry, u, metric)
        darcy_tangent(geometry, self.source, self.coefficients, chi, metric, elements)
        self.frozen_darcy_solver.factorise(self.tangent.darcy.data(elements.ravel()))
        self.work.darcy_factorisations += 1
        self._frozen_at = chi.copy(), x.copy()

    def solve(self, chi: Floats, start: tuple[Floats, Floats] | None = None) -> State:
        """The state of a design by Newton's method; rest, without solving anything, where p_in is zero.

        Args:
            chi: design, (n_vertices,).
            start: x and p to start from; at rest if None.

        Raises:
            NoState: if Newton's method does not converge.
        """
        if self.coefficients.pressure == 0.0:
            return self._rest(chi)
        if start is None:
            x = np.zeros(self.kinematics.size)
            p = self.pressure(chi, x)
            self._stale = True
        else:
            x, p = start
        remedy = AT_REST if start is None else NEARBY
        now = self._evaluate(chi, x, p)
        if now.lowest <= 0.0:
            raise NoState("The start of Newton's method has an inverted element: take a smaller design step.")
        for _ in range(MAX_NEWTON):
            if now.norm <= self.tolerance:
                # The leak through a wall is far smaller than the inflow that residuals are measured against: solve
                # for p once more, to rounding.
                p = self.pressure(chi, x)
                now = self._evaluate(chi, x, p)
                self.work.states += 1
                return State(chi, x, p, self.kinematics.displacement(x), now.nodal, now.norm, now.lowest)
            self._linearise(chi, x, p, now.nodal)
            # Inexact Newton: no more digits than the next iterate can use (Eisenstat & Walker 1996).
            tolerance = max(min(self.scheme.forcing, now.norm), 0.1 * self.tolerance / now.norm)
            dx, dp = self._krylov(-now.x, -now.p, tolerance, transposed=False)
            self.work.newton += 1
            step = 1.0
            while True:
                trial = self._evaluate(chi, x + step * dx, p + step * dp)
                if trial.norm <= (1.0 - 1e-4 * step) * now.norm:
                    break
                step *= 0.5
                if step < 1e-3:
                    raise NoState(f"Newton's method stalled at a relative residual of {now.norm:.1e}: {remedy}.")
            x, p, now = x + step * dx, p + step * dp, trial
        raise NoState(
            f"Newton's method did not converge in {MAX_NEWTON} steps (relative residual {now.norm:.1e}): {remedy}."
        )

    def _rest(self, chi: Floats) -> State:
        self.work.states += 1
        x, u = np.zeros(self.kinematics.size), np.zeros((len(self.domain.nodes), 3))
        return State(chi, x, np.zeros(len(chi)), u, np.zeros_like(u), residual=0.0, lowest_jacobian=1.0)

    # ------------------------------------------------------------- linear solves

    def refresh(self) -> None:
        """Let the next linearisation factorise the mechanical block anew."""
        self._stale = True

    def linearise(self, state: State) -> None:
        """Assemble the tangent at a state, unless it is there already, and factorise it if that is due."""
        if self._linearised_at is not state:
            self._linearise(state.chi, state.x, state.p, state.nodal)
            self._linearised_at = state
        elif self._stale:
            self._factorise()

    def negative_eigenvalues(self, state: State) -> int | None:
        """Of the mechanical tangent at a state, factorised anew; None if the solver does not tell (SuperLU).

        A state that has any is not stable, not even with the pressure held.
        """
        self.refresh()
        self.linearise(state)
        return self.mechanical_solver.statistics.negative_eigenvalues

    def solve_tangent(
        self, state: State, rx: Floats, rp: Floats, tolerance: float, guess: tuple[Floats, Floats] | None = None
    ) -> tuple[Floats, Floats]:
        """Solve tangent · (dx, dp) = (rx, rp) at a state to a relative residual."""
        self.linearise(state)
        return self._krylov(rx, rp, tolerance, transposed=False, guess=guess)

    def solve_adjoint(
        self, state: State, gx: Floats, gp: Floats, tolerance: float, guess: tuple[Floats, Floats] | None = None
    ) -> tuple[Floats, Floats]:
        """Solve tangentᵀ · (Λx, Λp) = (gx, gp) at a state to a relative residual."""
        self.linearise(state)
        return self._krylov(gx, gp, tolerance, transposed=True, guess=guess)

    def _linearise(self, chi: Floats, x: Floats, p: Floats, nodal: Floats) -> None:
        self._linearised_at = None
        self.tangent.assemble(self.source, self.coefficients, chi, x, p, nodal)
        self.darcy_solver.factorise(self.tangent.pp.data)
        self.work.darcy_factorisations += 1
        if self._stale:
            self._factorise()

    def _factorise(self) -> None:
        data = self.tangent.xx.data.copy()
        data[self._moments] /= self.lever.length
        data[-1] /= self.lever.length
        self.mechanical_solver.factorise(data)
        self.work.factorisations += 1
        self._stale, self._fresh = False, True

    def solve_mechanics(self, rx: Floats) -> Floats:
        """K_xx⁻¹ rx, (n_x,), with the factors at hand, to the precision of the scheme."""
        return self.lever.off(self.mechanical_solver.solve(self.lever.off(rx), check=None))

    def _krylov(
        self,
        bx: Floats,
        bp: Floats,
        tolerance: float,
        *,
        transposed: bool,
        guess: tuple[Floats, Floats] | None = None,
    ) -> tuple[Floats, Floats]:
        """GMRES with the factors at hand, and once more with new ones if they are too old."""
        force, flow = self.scales
        if transposed:
            force, flow = 1.0 / force, 1.0 / flow / self._balance
        system = CoupledSystem(
            self.tangent, self.solve_mechanics, self.darcy_solver, self.lever, force, flow, transposed
        )
        n, right = len(bx), system.scaled(bx, bp)
        solved = partial(gmres, system.multiply, right, precondition=system.precondition, tolerance=0.5 * tolerance)
        x0 = None if guess is None else np.concatenate(guess)
        limit = MAX_KRYLOV if self._fresh else STALE_ITERATIONS
        result = solved(x0=x0, max_iterations=limit, restart=limit)
        self.work.krylov += result.iterations
        if result.relative_residual > tolerance and not self._fresh:
            self._factorise()
            result = solved(x0=result.x, max_iterations=MAX_KRYLOV, restart=MAX_KRYLOV)
            self.work.krylov += result.iterations
        self._fresh = False
        if result.relative_residual > (max(tolerance, ROUNDING) if result.stagnated else tolerance):
            raise SolveFailure(
                f"A coupled linear solve stopped at a relative residual of {result.relative_residual:.1e} instead of "
                f"{tolerance:.1e}: the state is close to a limit point or the tolerance beyond what double precision "
                "can reach; take smaller steps or loosen the tolerance."
            )
        x = result.x[:n]
        # The flow equations are met to rounding, for the same reason as in the state. That moves the residual of the
        # others a little, which half the tolerance made room for.
        coupled = self.tangent.xp.T @ x if transposed else self.tangent.px @ x
        return x, self.darcy_solver.solve(bp - coupled)
