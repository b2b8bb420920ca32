"""Build directions: from the platform to the part."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Direction = Literal["x", "y", "z", "-x", "-y", "-z"]


def unit(direction: Direction) -> NDArray[np.float64]:
    """The unit vector of a direction, (3,)."""
    vector = np.zeros(3)
    vector["xyz".index(direction[-1])] = -1.0 if direction.startswith("-") else 1.0
    return vector
