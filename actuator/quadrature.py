"""The 14-point cubature rule of degree 5 for hexahedra.

Stroud (1971), Approximate Calculation of Multiple Integrals, C3: 5-2; the paper's rule (Section 2.3).
"""

from __future__ import annotations

import numpy as np

from actuator.domain import Floats


def hexahedron_14() -> tuple[Floats, Floats]:
    """Points (3, 14) and weights (14,) on the reference cube [0, 1]³; exact through degree 5."""
    a, b = np.sqrt(19.0 / 30.0), np.sqrt(19.0 / 33.0)
    axes = a * np.concatenate([np.eye(3), -np.eye(3)])
    corners = b * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    points = 0.5 * (1.0 + np.concatenate([axes, corners]))
    weights = np.concatenate([np.full(6, 320.0 / 361.0), np.full(8, 121.0 / 361.0)]) / 8.0
    return points.T, weights
