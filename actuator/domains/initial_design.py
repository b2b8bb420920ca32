"""The initial design of Appendix C."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats


def smooth_minimum(a: Floats, b: Floats, interface_width: float) -> Floats:
    """min_LSE of Eq. (B.1): -4/L_i log(exp(-a L_i/4) + exp(-b L_i/4)), with the paper's scaling of the arguments."""
    s = interface_width / 4.0
    return -np.logaddexp(-s * a, -s * b) / s


def initial_design(points: Floats, radius: float, interface_width: float, length_unit: float = 1.0) -> Floats:
    """χ at t = 0, Eq. (C.1): a tube from 0.45 R to 0.95 R, a little thinner for X3 > 0.

    Args:
        points: (n, 3), mm.
        radius: R, mm.
        interface_width: L_i, mm.
        length_unit: what the paper calls 1 mm; the equation's numbers have units, mm.

    Returns:
        χ at the points, (n,).
    """
    points, radius, interface_width = points / length_unit, radius / length_unit, interface_width / length_unit
    r, upper = np.hypot(points[:, 1], points[:, 2]), np.maximum(points[:, 2], 0.0)
    tube = smooth_minimum(0.95 * radius - r, r - 0.45 * radius, interface_width)
    passive = smooth_minimum(radius - r, r - 0.3 * radius, interface_width)
    return smooth_minimum(
        8.0 / (3.0 * interface_width) * tube - 0.1 * upper, 8.0 / interface_width * passive, interface_width
    )
