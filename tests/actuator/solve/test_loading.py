"""The pressure raised in steps: the state that Newton's method finds where it does, and one where it does not."""

from __future__ import annotations

import numpy as np
import pytest
from physics import half_cylinder, parameters
from small_case import start_of

from actuator.solve.equilibrium import Equilibrium, NoState
from actuator.solve.loading import loaded


def problem(pressure_ratio: float, core_cells: int = 3) -> Equilibrium:
    return Equilibrium(half_cylinder(core_cells, 1, 3), *parameters(load={"pressure_ratio": pressure_ratio}), threads=1)


def test_the_state_is_the_one_found_from_rest() -> None:
    equilibrium, loads = problem(0.02), list[float]()
    chi = start_of(equilibrium.domain)
    found, direct = loaded(equilibrium, chi, loads.append), equilibrium.solve(chi)
    assert loads == sorted(loads)
    assert loads[-1] == 1.0
    np.testing.assert_allclose(found.x, direct.x, atol=1e-6 * np.abs(direct.x).max())


def test_a_state_is_reached_that_is_not_found_from_rest() -> None:
    equilibrium = problem(0.11)
    chi = start_of(equilibrium.domain)
    with pytest.raises(NoState):
        equilibrium.solve(chi)
    found = loaded(equilibrium, chi, lambda load: None)
    assert found.residual <= 1e-8
    again = equilibrium.residual(chi, found.x, found.p)
    assert equilibrium.norm(*again[:2]) <= 1e-8  # of the full pressure
    assert found.lowest_jacobian > 0.0


def test_how_far_it_came_and_what_helps() -> None:
    equilibrium, loads = problem(0.3, core_cells=2), list[float]()
    with pytest.raises(NoState) as caught:
        loaded(equilibrium, start_of(equilibrium.domain), loads.append)
    assert 0.25 < loads[-1] < 0.4  # 0.1 E, as at other ratios
    sentence = str(caught.value)
    assert f"could be raised from zero to {loads[-1]:.0%} of it" in sentence
    for key in ("initial.wall", "initial.file", "material.hessian_regularisation", "load.pressure_ratio"):
        assert key in sentence
