"""The pressure source of Appendix A."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats


def pressure_source(radii: Floats, radius: float, drainage: float) -> Floats:
    """Q_in of Eq. (A.1) in mm²/(N s): 100 Q_s within r < 0.15 R, falling to zero at 0.25 R.

    Args:
        radii: r at any points, mm.
        radius: R, mm.
        drainage: Q_s, mm²/(N s).
    """
    ramp = np.minimum(1.0, np.maximum(0.0, 10.0 * radii / radius - 1.5))
    return 100.0 * drainage * (1.0 - np.sin(0.5 * np.pi * ramp) ** 2)
