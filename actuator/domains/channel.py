"""What all domains with an inlet channel along X1 have in common: Eqs. (18), (21) and (22) by two distances.

The paper states them for the radius r in a cylinder. Here r is the distance from the channel's axis, and R - r, the
distance from the wall, is given beside it: in a cylinder the two add up to R.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.domains.smooth_minimum import smooth_minimum

#: Shares of R: the source falls from 1 to 0 between the first two, Eq. (18); nothing is solid within the third,
#: Eq. (21); the initial design is a wall between the last two, Eq. (22).
FULL, NONE, FREE, INNER, OUTER = 0.15, 0.25, 0.3, 0.45, 0.95


def inlet(radii: Floats, size: float) -> Floats:
    """Profile of Eq. (18): 1 within r < 0.15 R, falling to zero at 0.25 R; (...)."""
    ramp = np.minimum(1.0, np.maximum(0.0, 10.0 * radii / size - 10.0 * FULL))
    return np.asarray(1.0 - np.sin(0.5 * np.pi * ramp) ** 2)


def passive_bound(radii: Floats, depth: Floats, size: float, width: float) -> Floats:
    """The bound on χ in C_χ of Eq. (21): 8/L_i min(R - r, |r| smoothed - 0.3 R); (...).

    Args:
        radii: r, distance from the channel's axis, (...).
        depth: R - r, distance from the wall, (...).
        size: R.
        width: L_i; all four in what the paper calls 1 mm.
    """
    smooth_radius = -smooth_minimum(radii, -radii, width)
    return 8.0 / width * np.minimum(depth, smooth_radius - FREE * size)


def initial_design(
    radii: Floats, depth: Floats, wall: tuple[Floats, Floats], height: Floats, size: float, width: float
) -> Floats:
    """χ at t = 0, Eq. (22): a tube of solid, a little thinner for X3 > 0; (...).

    Args:
        radii, depth, size, width: as for :func:`passive_bound`.
        wall: 0.95 R - r and r - 0.45 R: how far inside the wall's outer and inner surface, (...) each.
        height: X3, (...).
    """
    tube = smooth_minimum(*wall, width)
    passive = smooth_minimum(depth, radii - FREE * size, width)
    return smooth_minimum(8.0 / (3.0 * width) * tube - 0.1 * np.maximum(height, 0.0), 8.0 / width * passive, width)


class ByDepth(Domain):
    """A domain with a wall of any shape around the channel, below which the initial design lies."""

    @abstractmethod
    def _distances(self, points: Floats, unit: float) -> tuple[Floats, Floats, float]:
        """r, R - r, (...) each, and R, in a length unit of so many mm."""

    def passive_bound(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """The bound on χ in C_χ of Eq. (21), (...)."""
        radii, depth, reach = self._distances(points, length_unit)
        return passive_bound(radii, depth, reach, interface_width / length_unit)

    def initial_design(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """χ at t = 0, Eq. (22): a wall from 0.05 R to 0.55 R below the outside, a little thinner for X3 > 0; (...)."""
        radii, depth, reach = self._distances(points, length_unit)
        wall = depth - (1.0 - OUTER) * reach, (1.0 - INNER) * reach - depth
        height, width = points[..., 2] / length_unit, interface_width / length_unit
        return initial_design(radii, depth, wall, height, reach, width)
