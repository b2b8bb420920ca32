"""Darcy's problem where the pressure dies out within a cell: fitted elements against what is known exactly."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from physics import coefficients, density, fitted_permeability, half_cylinder, no_source, parameters, permeability
from skfem import MeshHex

from actuator.domains.half_cylinder import HalfCylinder
from actuator.equations.discretisation import Discretisation
from actuator.equations.kernels import residual
from actuator.solve.equilibrium import Equilibrium, State
from actuator.solve.leak_check import second_order_leak

C = coefficients()


def line_of_cubes(n: int, size: float) -> Any:
    """What :class:`Discretisation` needs of a domain, for n cubes along X1."""
    cube = MeshHex()
    corners = cube.p[:, cube.t[:, 0]].astype(int)  # (3, 8) in the element's order
    within = 2 * corners[1] + corners[2]
    t = np.stack([4 * (i + corners[0]) + within for i in range(n)], axis=1)
    layer, yz = np.divmod(np.arange(4 * (n + 1)), 4)
    mesh = MeshHex(size * np.array([layer, yz // 2, yz % 2], dtype=float), t)
    return SimpleNamespace(
        mesh=mesh,
        representatives=np.arange(1),
        cell_class=np.zeros(n, dtype=int),
        cells=t.T,
        node_cells=np.zeros((n, 20), dtype=int),
    )


@pytest.mark.parametrize("chi", [-8.0, -4.0, -1.0, 2.0, 6.0])
@pytest.mark.parametrize("size", [0.1, 0.8])
def test_decay_along_equal_cubes_is_exact_at_the_vertices(chi: float, size: float) -> None:
    """exp(-x sqrt(Q/k)) solves Eq. (5), in cells from far less than a decay length to twenty of them."""
    domain = line_of_cubes(5, size)
    discretisation = Discretisation(domain)
    level = np.full(domain.mesh.nvertices, chi)
    drainage = C.drainage * density(level)
    p = np.exp(-domain.mesh.p[0] * np.sqrt(drainage / permeability(level, C)))
    flows = np.empty((5, 8))
    residual(
        discretisation.geometry,
        no_source(discretisation),
        C,
        level,
        np.zeros((1, 3)),
        p,
        False,
        np.empty((5, 20, 3)),
        flows,
    )
    flow = np.bincount(domain.cells.ravel(), flows.ravel())
    k = fitted_permeability(level[:1, None], C, np.full((1, 1), size**3))[0, 0]
    exchanged = (0.25 * size**3 * drainage + 4.0 * size * k) * p
    inside = slice(4, -4)
    assert np.abs(flow[inside] / exchanged[inside]).max() < 1e-8


def leaking(shift: float) -> tuple[Equilibrium, State]:
    """A rough tube, steeper than a cell, in the undeformed actuator."""
    domain = HalfCylinder(15.0, 15.0, 4, 3, 4)
    equilibrium = Equilibrium(domain, *parameters(), threads=1)
    rough = np.random.default_rng(0).normal(scale=3.0, size=domain.mesh.nvertices)
    chi = 4.0 * domain.initial_design(domain.points, 3.0) + rough + shift
    x = np.zeros(equilibrium.kinematics.size)
    u = equilibrium.kinematics.displacement(x)
    return equilibrium, State(chi, x, equilibrium.pressure(chi, x), u, np.zeros_like(u), 0.0, 1.0)


@pytest.mark.parametrize("shift", [-8.0, -4.0, 0.0])
def test_pressure_stays_between_nothing_and_the_source(shift: float) -> None:
    """The maximum principle, which elements that are not fitted violate by several percent of p_in."""
    _, state = leaking(shift)
    assert state.p.min() > -1e-4 * C.pressure
    assert state.p.max() < (1.0 + 1e-6) * C.pressure


def test_a_tight_tube_is_seen_to_be_tight() -> None:
    """Through three cells of solid nothing comes; second-order elements alternate and leave a little."""
    domain = half_cylinder(4, 3, 4)
    equilibrium = Equilibrium(domain, *parameters(), threads=1)
    chi = 2.0 * domain.initial_design(domain.points, 3.0)
    x = np.zeros(equilibrium.kinematics.size)
    p = equilibrium.pressure(chi, x)
    u = equilibrium.kinematics.displacement(x)
    wall = np.unique(domain.mesh.facets[:, domain.outside.facets])
    fitted = p[wall].max() / C.pressure
    state = State(chi, x, p, u, np.zeros_like(u), 0.0, 1.0)
    assert 0.0 <= fitted < 1e-3
    assert second_order_leak(equilibrium, state).largest < 1e-2
