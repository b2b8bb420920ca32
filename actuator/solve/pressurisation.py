"""The actuator under a growing source pressure λ p_in, as a problem that :mod:`actuator.solve.path` follows.

The source enters Eq. (5) linearly: R(z, λ) = R(z, 1) + (λ - 1) ∂R/∂λ with a constant ∂R/∂λ, and the tangent ∂R/∂z does
not depend on λ. One :class:`~actuator.solve.equilibrium.Equilibrium` at λ = 1 therefore serves all loads.
"""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats
from actuator.equations.arm import is_angle
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.linearisation import Linearisation
from actuator.solve.state import State

#: Root mean square of the displacements, in sizes R of the domain, that counts as much as the whole load.
LARGE_DISPLACEMENT = 0.1


class Pressurisation:
    """States of one design at all load factors.

    z is (x, p) of :class:`~actuator.solve.equilibrium.Equilibrium`. Its length is that of x alone: for given
    displacements Eq. (5) is linear and positive definite in p, so that x and λ determine the pressure.

    Args:
        equilibrium: state equations at the full pressure p_in, which must not be zero.
        chi: design, (n_vertices,).
    """

    def __init__(self, equilibrium: Equilibrium, chi: Floats) -> None:
        self.equilibrium, self.chi = equilibrium, chi
        self.size = equilibrium.kinematics.size
        rest, no_pressure = np.zeros(self.size), np.zeros(len(chi))
        # The inflow at p = 0 is the source's, and it is all that scales with the load.
        inflow = equilibrium.flow_residual(chi, rest, no_pressure)
        self.load_derivative: Floats = np.concatenate([rest, inflow])
        size = equilibrium.domain.size
        weights = np.ones(self.size)
        kinematics = equilibrium.kinematics
        # The arm's rotations, by the displacements that they make at the wall.
        weights[kinematics.of_arm] = np.where([is_angle(name) for name in kinematics.arm.names], size**2, 1.0)
        self._weights = weights / (self.size * (LARGE_DISPLACEMENT * size) ** 2)
        self._seen: tuple[Floats, float, State] | None = None
        self._linearisation: Linearisation | None = None

    @property
    def rest(self) -> Floats:
        """z at λ = 0."""
        return np.zeros(len(self.load_derivative))

    def state(self, z: Floats, load: float) -> State:
        """The state at z, converged or not."""
        if self._seen is None or self._seen[0] is not z or self._seen[1] != load:
            self.residual(z, load)
        assert self._seen is not None
        return self._seen[2]

    def residual(self, z: Floats, load: float) -> Floats:
        """Forces (N, N mm) and flows (mm³/s) that are left; infinite if an element is inverted."""
        x, p = z[: self.size], z[self.size :]
        rx, rp, nodal, lowest = self.equilibrium.residual(self.chi, x, p)
        rp += (load - 1.0) * self.load_derivative[self.size :]
        u, motion = (map_(x) for map_ in (self.equilibrium.kinematics.displacement, self.equilibrium.kinematics.motion))
        self._seen = z, load, State(self.chi, x, p, u, nodal, motion, self.equilibrium.norm(rx, rp), lowest)
        return np.concatenate([rx, rp]) if lowest > 0.0 else np.full(len(z), np.inf)

    def norm(self, residual: Floats) -> float:
        """Relative residual, measured against the forces and flows of the full load."""
        if not np.isfinite(residual).all():
            return np.inf
        return self.equilibrium.norm(residual[: self.size], residual[self.size :])

    def linearise(self, z: Floats, load: float, *, fresh: bool) -> None:
        """Assemble the tangent at z; ``fresh`` factorises the mechanical block there, else an older one may do."""
        self._linearisation = self.equilibrium.linearise(self.state(z, load), fresh=fresh)

    def solve(self, right: Floats, tolerance: float, guess: Floats | None = None) -> Floats:
        """Solve with the tangent assembled last.

        Raises:
            actuator.failure.SolveFailure: if the relative residual is not reached.
        """
        start = None if guess is None else (guess[: self.size], guess[self.size :])
        dx, dp = self._linearised.solve(right[: self.size], right[self.size :], tolerance, guess=start)
        return np.concatenate([dx, dp])

    def inner(self, a: Floats, b: Floats) -> float:
        """Mean product of displacements over :data:`LARGE_DISPLACEMENT` squared."""
        return float(np.dot(self._weights * a[: self.size], b[: self.size]))

    def settled(self, z: Floats, load: float) -> Floats:
        """z with the pressure solved for once more, to rounding, as in :meth:`Equilibrium.solve`."""
        x = z[: self.size]
        return np.concatenate([x, load * self.equilibrium.pressure(self.chi, x)])

    def negative_eigenvalues(self) -> int | None:
        """Of the mechanical block, that is with the pressure held; None if the solver does not tell (SuperLU)."""
        return self._linearised.negative_eigenvalues

    @property
    def _linearised(self) -> Linearisation:
        assert self._linearisation is not None, "linearise first"
        return self._linearisation
