"""Cubature rules for hexahedra: the paper's with 14 points, and Gauss's with 8 and 27 to compare with.

Stroud (1971), Approximate Calculation of Multiple Integrals, C3: 5-2; the paper's rule (Section 2.3).
"""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats


def hexahedron_rule(points: int) -> tuple[Floats, Floats]:
    """Points (3, n) and weights (n,) on the reference cube [0, 1]³ of the rule with n = 8, 14 or 27 points.

    Raises:
        ValueError: if there is no rule with so many points.
    """
    if points == 14:
        return hexahedron_14()
    orders = {8: 2, 27: 3}
    if points not in orders:
        raise ValueError(f"there is no quadrature rule of {points} points: take 8, 14 or 27")
    return hexahedron_gauss(orders[points])


def hexahedron_14() -> tuple[Floats, Floats]:
    """Points (3, 14) and weights (14,) on the reference cube [0, 1]³; exact through degree 5."""
    a, b = np.sqrt(19.0 / 30.0), np.sqrt(19.0 / 33.0)
    axes = a * np.concatenate([np.eye(3), -np.eye(3)])
    corners = b * np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    points = 0.5 * (1.0 + np.concatenate([axes, corners]))
    weights = np.concatenate([np.full(6, 320.0 / 361.0), np.full(8, 121.0 / 361.0)]) / 8.0
    return points.T, weights


def hexahedron_gauss(order: int) -> tuple[Floats, Floats]:
    """Gauss's rule with ``order`` points along each edge of [0, 1]³; exact to degree 2 order - 1 in each variable."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    points = np.stack(np.meshgrid(nodes, nodes, nodes, indexing="ij")).reshape(3, -1)
    return 0.5 * (1.0 + points), np.einsum("i,j,k->ijk", weights, weights, weights).ravel() / 8.0
