"""The leak by second-order elements against a much finer mesh, and against what is known without one."""

from __future__ import annotations

import numpy as np
import pytest
from physics import Floats

from actuator.domains.half_cylinder import HalfCylinder
from actuator.solve.equilibrium import Equilibrium, State
from actuator.solve.leak_check import second_order_leak
from stages.settings import LoadSettings, ProblemSettings

WIDTH = 3.0


def at_rest(domain: HalfCylinder, chi: Floats, pressure_ratio: float = 2e-2) -> tuple[Equilibrium, State]:
    """Darcy's problem in the undeformed actuator."""
    settings = ProblemSettings(load=LoadSettings(pressure_ratio=pressure_ratio))
    equilibrium = Equilibrium(domain, *settings.parameters(), threads=1)
    x = np.zeros(equilibrium.kinematics.size)
    p = equilibrium.pressure(chi, x)
    u = equilibrium.kinematics.displacement(x)
    return equilibrium, State(chi, x, p, u, np.zeros_like(u), 0.0, 1.0)


def first_order(equilibrium: Equilibrium, state: State) -> float:
    p = state.p / equilibrium.coefficients.pressure
    return float(p @ (equilibrium.discretisation.wall_mass @ p))


@pytest.mark.parametrize(("steepness", "shift"), [(0.6, -1.5), (1.0, -3.0), (1.0, -4.0)])
def test_as_a_finer_mesh_says(steepness: float, shift: float) -> None:
    """Tubes that leak 0.5 %, 18 % and 59 % of p_in: three times as many cells in each direction are the reference."""
    coarse = HalfCylinder(15.0, 15.0, 4, 3, 4)
    fine = coarse.refined(3)
    chi = steepness * coarse.initial_design(coarse.points, WIDTH) + shift
    on_coarse, on_fine = at_rest(coarse, chi), at_rest(fine, coarse.prolongation(3) @ chi)
    reference = second_order_leak(*on_fine).mean_square
    assert first_order(*on_fine) == pytest.approx(reference, rel=0.08)
    assert second_order_leak(*on_coarse).mean_square == pytest.approx(reference, rel=0.05)


def test_open_void_has_the_source_pressure_on_the_wall() -> None:
    domain = HalfCylinder(15.0, 15.0, 2, 1, 2)
    leak = second_order_leak(*at_rest(domain, np.full(domain.mesh.nvertices, -20.0)))
    assert leak.largest == pytest.approx(1.0, abs=1e-4)
    assert leak.mean_square == pytest.approx(1.0, abs=1e-4)


def test_no_pressure_no_leak() -> None:
    domain = HalfCylinder(15.0, 15.0, 2, 1, 2)
    assert second_order_leak(*at_rest(domain, np.zeros(domain.mesh.nvertices), 0.0)) == (0.0, 0.0)
