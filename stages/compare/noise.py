"""Noise of a recorded signal."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats


def noise(values: Floats) -> float:
    """Standard deviation of white noise on a smooth signal (n,), from the median of its second differences.

    The median does not see turning points or single spikes; sqrt(6) is the norm of the stencil 1, -2, 1, and 1.4826
    makes the median absolute deviation of a normal distribution its standard deviation.
    """
    return float(1.4826 * np.median(np.abs(np.diff(values, 2))) / np.sqrt(6.0))
