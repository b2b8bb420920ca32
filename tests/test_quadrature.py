"""The 14-point rule on the cube."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from actuator.quadrature import hexahedron_14

MONOMIALS = [powers for powers in product(range(7), repeat=3) if sum(powers) <= 6]


def error(powers: tuple[int, int, int]) -> float:
    """Rule minus integral of the monomial in coordinates from -1 to 1, both divided by the volume."""
    points, weights = hexahedron_14()
    value = weights @ np.prod((2.0 * points.T - 1.0) ** np.array(powers), axis=1)
    exact = 0.0 if any(power % 2 for power in powers) else 1.0 / np.prod([power + 1 for power in powers])
    return float(value - exact)


def test_rule_has_14_points_inside_the_cube_and_positive_weights() -> None:
    points, weights = hexahedron_14()
    assert points.shape == (3, 14)
    assert weights.shape == (14,)
    assert points.min() > 0.0
    assert points.max() < 1.0
    assert weights.min() > 0.0
    assert len(np.unique(points.round(12), axis=1).T) == 14


@pytest.mark.parametrize("degree", range(6))
def test_exact_through_degree_five(degree: int) -> None:
    assert max(abs(error(powers)) for powers in MONOMIALS if sum(powers) == degree) < 1e-15


def test_not_exact_in_degree_six() -> None:
    assert max(abs(error(powers)) for powers in MONOMIALS if sum(powers) == 6) > 1e-2
