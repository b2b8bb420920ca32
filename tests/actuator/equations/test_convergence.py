"""Manufactured solutions: displacements of both elements and the trilinear pressure, with every quadrature rule.

The problems and their solutions are those of :mod:`benchmarks.manufactured`, which tabulates what is asserted here.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from physics import Floats

from actuator.domains.half_cylinder import HalfCylinder
from actuator.equations.scheme import Scheme
from benchmarks.manufactured import (
    displacement,
    displacement_errors,
    meshes,
    orders,
    pressure,
    pressure_errors,
    solve_darcy,
    solve_mechanics,
)

MESHES = meshes(3)


def study(
    fields: Callable[[HalfCylinder], Floats], errors: Callable[[HalfCylinder, Floats], Floats], levels: int = 3
) -> Floats:
    """Errors of a field on each mesh, (n_meshes, 2)."""
    return np.array([errors(domain, fields(domain)) for domain in MESHES[-levels:]])


def test_displacements_converge_with_order_three_in_l2_and_two_in_h1() -> None:
    found = study(solve_mechanics, displacement_errors)
    l2, h1 = orders(found)
    assert l2 > 2.8
    assert h1 > 1.9
    # Galerkin's solution is near the best there is; the bulk modulus, 25 times the shear modulus, costs a little.
    interpolant = study(lambda domain: displacement(domain.nodes), displacement_errors)
    assert np.all(found[-1] < 2.0 * interpolant[-1])
    assert np.all(found[-1] < [2e-4, 4e-3])


@pytest.mark.parametrize("points", [8, 27])
def test_other_rules_keep_the_orders_of_the_displacements(points: int) -> None:
    scheme = Scheme(quadrature=points)
    l2, h1 = orders(study(lambda domain: solve_mechanics(domain, scheme), displacement_errors, 2))
    assert l2 > 2.8
    assert h1 > 1.9


def test_8_node_displacements_converge_with_order_two_in_l2_and_one_in_h1() -> None:
    scheme = Scheme("hex8")
    found = study(lambda domain: solve_mechanics(domain, scheme), displacement_errors)
    l2, h1 = orders(found)
    assert 1.6 < l2 < 2.2
    assert 0.9 < h1 < 1.2
    # Nearly incompressible: the trilinear element is stiff beside its own interpolant, but not by much here.
    interpolant = study(lambda domain: displacement(domain.points), displacement_errors)
    assert np.all(found[-1] < 4.0 * interpolant[-1])


def test_pressure_converges_with_order_two_in_l2_and_one_in_h1() -> None:
    found = study(solve_darcy, pressure_errors)
    l2, h1 = orders(found)
    assert l2 > 1.8  # rises to 2: the factor on k is 1 + O(h²)
    assert h1 > 0.95
    interpolant = study(lambda domain: pressure(domain.points)[:, None], pressure_errors)
    assert np.all(found[-1] < 2.0 * interpolant[-1])
    assert np.all(found[-1] < [4e-3, 8e-2])
