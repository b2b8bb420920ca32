"""Where a solid lies between its plates."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats

#: The solid's own axis is kept if it passes this near the middle of the bounding box, over the box's width.
NEAR_THE_MIDDLE = 0.25


def placed(vertices: Floats) -> Floats:
    """Vertices (n, 3) moved so that the solid begins at X1 = 0 and its axis is at X2 = X3 = 0, mm."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    middle, width = 0.5 * (low + high), high - low
    origin = np.where(np.abs(middle) <= NEAR_THE_MIDDLE * width, 0.0, middle)
    origin[0] = low[0]
    return np.asarray(vertices - origin)
