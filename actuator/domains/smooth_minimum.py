"""The smooth minimum of Appendix B."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats


def smooth_minimum(a: Floats, b: Floats, interface_width: float) -> Floats:
    """min_LSE of Eq. (20): -4/L_i log(exp(-a L_i/4) + exp(-b L_i/4)), with the paper's scaling of the arguments."""
    s = interface_width / 4.0
    return -np.logaddexp(-s * a, -s * b) / s
