"""Build directions, from the platform to the part, and axes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:  # the command line knows the directions without NumPy
    import numpy as np
    from numpy.typing import NDArray

Axis = Literal["x", "y", "z"]
Direction = Literal["x", "y", "z", "-x", "-y", "-z"]


def unit(direction: Direction) -> NDArray[np.float64]:
    """The unit vector of a direction, (3,)."""
    import numpy as np

    vector = np.zeros(3)
    vector["xyz".index(direction[-1])] = -1.0 if direction.startswith("-") else 1.0
    return vector
