"""How unlike quantities weigh beside each other in one vector: forces and a moment, derivatives per mm and per N/mm².

Chosen so that similar cases of any size, stiffness and permeability, in whatever units, take the same way, and that the
paper's keeps its results to the last bit.
"""

from __future__ import annotations

from math import log

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.parameters import Material

#: A moment on the arm weighs as much as the force that makes it at a lever of R over this: 1 mm of the paper's 15 mm.
LEVERS = 15.0
#: E / (Q_s R²) of the paper's case, s, at which the adjoint's equations are balanced.
BALANCED = 2.736 / ((log(10.0) / (0.02 * 3.0)) ** 2 * 1e-3 * 15.0**2 / 2.736 * 15.0**2)


class Lever:
    """Vectors (n_x,) whose last entry is about θ2 and all others about displacements."""

    def __init__(self, domain: Domain) -> None:
        self.length = domain.size / LEVERS

    def off(self, v: Floats) -> Floats:
        """A copy with the last entry over the lever: a moment as a force, N; (n_x,)."""
        v = v.copy()
        v[-1] /= self.length
        return v

    def norm(self, rx: Floats) -> float:
        """Root of the sum of squares of forces and of the moment over the lever, N."""
        return float(np.linalg.norm(self.off(rx)))


def adjoint_balance(domain: Domain, material: Material) -> float:
    """Factor on the adjoint's flow equations that keeps their weight beside the others what it is in the paper's case.

    A derivative per N/mm² counts as much as E / R derivatives per mm; its weight, the inflow, is measured by Q_s R³.
    Without this factor GMRES stops at a worse gradient where the actuator is softer, larger or more permeable, or is
    given in other units. A power of two: exact, and 1 wherever a case is near the paper's.
    """
    bulk, shear = material.bulk, material.shear
    modulus = 9.0 * bulk * shear / (3.0 * bulk + shear)
    return float(np.exp2(np.rint(np.log2(modulus / (material.drainage * domain.size**2) / BALANCED))))
