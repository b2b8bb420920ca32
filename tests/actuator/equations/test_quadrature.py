"""The rules on the cube."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from actuator.equations.quadrature import hexahedron_14, hexahedron_rule

MONOMIALS = [powers for powers in product(range(7), repeat=3) if sum(powers) <= 6]

#: Degree through which each rule is exact, over all three variables together.
DEGREES = {8: 3, 14: 5, 27: 5}


def error(points: int, powers: tuple[int, int, int]) -> float:
    """Rule minus integral of the monomial in coordinates from -1 to 1, both divided by the volume."""
    places, weights = hexahedron_rule(points)
    value = weights @ np.prod((2.0 * places.T - 1.0) ** np.array(powers), axis=1)
    exact = 0.0 if any(power % 2 for power in powers) else 1.0 / np.prod([power + 1 for power in powers])
    return float(value - exact)


@pytest.mark.parametrize("count", DEGREES)
def test_points_lie_inside_the_cube_and_weights_are_positive(count: int) -> None:
    points, weights = hexahedron_rule(count)
    assert points.shape == (3, count)
    assert weights.shape == (count,)
    assert points.min() > 0.0
    assert points.max() < 1.0
    assert weights.min() > 0.0
    assert len(np.unique(points.round(12), axis=1).T) == count


@pytest.mark.parametrize(("count", "degree"), [(count, d) for count, last in DEGREES.items() for d in range(last + 1)])
def test_exact_through_its_degree(count: int, degree: int) -> None:
    assert max(abs(error(count, powers)) for powers in MONOMIALS if sum(powers) == degree) < 1e-15


@pytest.mark.parametrize(("count", "degree"), [(count, last + 1) for count, last in DEGREES.items()])
def test_not_exact_beyond(count: int, degree: int) -> None:
    assert max(abs(error(count, powers)) for powers in MONOMIALS if sum(powers) == degree) > 1e-3


@pytest.mark.parametrize(("count", "highest"), [(8, 3), (27, 5)])
def test_gauss_is_exact_in_each_variable(count: int, highest: int) -> None:
    found = [error(count, powers) for powers in product(range(highest + 1), repeat=3)]
    assert np.abs(found).max() < 1e-15


def test_the_rule_of_14_points_is_the_paper_s() -> None:
    assert all(np.array_equal(a, b) for a, b in zip(hexahedron_rule(14), hexahedron_14(), strict=True))


def test_other_rules_are_refused() -> None:
    with pytest.raises(ValueError, match="no quadrature rule of 15 points: take 8, 14 or 27"):
        hexahedron_rule(15)
