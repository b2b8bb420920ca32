"""A state of the actuator: what the equations are solved for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.equations.arm import PAPER_COORDINATES


@dataclass(frozen=True)
class State:
    """A design with displacements and pressure, converged or on the way.

    Attributes:
        chi: the design it belongs to, (n_vertices,).
        x: free displacements and T, (n_x,); see :class:`actuator.equations.kinematics.Kinematics`.
        p: pressure, (n_vertices,), N/mm².
        displacement: u, (n_nodes, 3), mm.
        nodal: nodal residual forces, (n_nodes, 3), N; on Γ they are the reactions that replace q.
        motion: of the arm, (6,), mm and rad, in the order of :data:`actuator.equations.arm.COORDINATES`.
        residual: relative residual; infinite where an element is inverted.
        lowest_jacobian: smallest det F at the quadrature points.
    """

    chi: Floats
    x: Floats
    p: Floats
    displacement: Floats
    nodal: Floats
    motion: Floats
    residual: float = np.inf
    lowest_jacobian: float = np.nan

    @property
    def arm(self) -> Floats:
        """T1, T3 (mm) and θ2 (rad), the paper's T, (3,)."""
        return self.motion[PAPER_COORDINATES]
