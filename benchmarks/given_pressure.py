"""poro's side of the comparison with another package: u for given pressure and given motion of the arm.

The program itself never solves this: p and the arm are unknowns there. Residual and tangent are the program's own, of
which the rows and columns of p and of the arm are left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver, SolverName, make_solver
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.state import State

MAX_NEWTON = 30


@dataclass(frozen=True)
class Solution:
    """What one of the programs finds.

    Attributes:
        displacement: (n_nodes, 3), mm.
        nodal: residual forces, (n_nodes, 3), N: rounding where u is free, else reactions.
        iterations: Newton steps.
        seconds: CPU time of all of the solution; ``linear_seconds`` of it in the linear solver.
    """

    displacement: Floats
    nodal: Floats
    iterations: int
    seconds: float
    linear_seconds: float


class GivenPressure:
    """u at the pressure and at the arm's motion of a state.

    Args:
        equilibrium: the case.
        state: whose χ, p and T are taken.
        solver: direct solver, in double precision.
    """

    def __init__(self, equilibrium: Equilibrium, state: State, solver: SolverName = "auto") -> None:
        self._equilibrium, self._state = equilibrium, state
        upper = equilibrium.tangent.mechanics
        places = sp.csr_array((np.arange(upper.nonzeros), upper.indices, upper.indptr), upper.shape)[:-3, :-3]
        self._stored = places.data  # where the rows and columns of u stand in the whole block
        self.solver: DirectSolver = make_solver(
            places.indptr, places.indices, symmetric=True, name=solver, threads=equilibrium.threads
        )
        self.free = equilibrium.kinematics.index.ravel() >= 0

    def motion(self, load: float) -> Floats:
        """Displacements (n_nodes, 3) by a part of the arm's motion alone, mm."""
        kinematics = self._equilibrium.kinematics
        return kinematics.displacement(np.concatenate([np.zeros(kinematics.size - 3), load * self._state.arm]))

    def forces(self, x: Floats, load: float = 1.0) -> Floats:
        """Nodal residual forces (n_nodes, 3), N, at reduced coordinates x.

        Raises:
            SolveFailure: if an element is inverted.
        """
        state = self._state
        _, _, nodal, lowest = self._equilibrium.residual(state.chi, x, load * state.p)
        if lowest <= 0.0:
            raise SolveFailure("An element is inverted: take more load steps.")
        return nodal

    def linearise(self, x: Floats, nodal: Floats, load: float = 1.0) -> sp.csr_array:
        """Derivative of the reduced forces, upper triangle, (n_x, n_x); the blocks of p are assembled as well."""
        equilibrium, state = self._equilibrium, self._state
        tangent = equilibrium.tangent
        tangent.assemble(equilibrium.source, equilibrium.coefficients, state.chi, x, load * state.p, nodal)
        return tangent.xx

    def linear(self, tangent: sp.csr_array, right: Floats) -> Floats:
        """Factorise the part of the free displacements and solve with it, (n_x - 3,)."""
        self.solver.factorise(tangent.data[self._stored])
        return self.solver.solve(right)

    def solve(self, loads: Floats, tolerance: float) -> Solution:
        """From rest through growing loads, each by Newton's method without a search.

        Args:
            loads: load factors; pressure and motion of the arm are multiplied by them.
            tolerance: norm of the residual over that of the reactions.

        Raises:
            SolveFailure: if a load is not reached.
        """
        began, linear, iterations = process_time(), 0.0, 0
        x = np.zeros(self._equilibrium.kinematics.size)
        nodal = self.forces(x, 0.0)
        for load in loads:
            nodal = self.forces(x, float(load))
            for _ in range(MAX_NEWTON):
                matrix = self.linearise(x, nodal, float(load))
                ahead = load * self._state.arm - x[-3:]
                right = -nodal.ravel()[self.free] - matrix[:-3, -3:] @ ahead
                start = process_time()
                step = self.linear(matrix, right)
                linear += process_time() - start
                x = x + np.concatenate([step, ahead])
                nodal = self.forces(x, float(load))
                iterations += 1
                if self._remaining(nodal) <= tolerance:
                    break
            else:
                raise SolveFailure(f"Newton's method did not reach the load {load:g}: take more load steps.")
        u = self._equilibrium.kinematics.displacement(x)
        return Solution(u, nodal, iterations, process_time() - began, linear)

    def _remaining(self, nodal: Floats) -> float:
        forces = nodal.ravel()
        return float(np.linalg.norm(forces[self.free]) / np.linalg.norm(forces[~self.free]))
