"""The state of the actuator as an independent finite-element package sees it, and what is said where there is none."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from physics import half_cylinder, parameters
from small_case import start_of

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.failure import SolveFailure
from actuator.parameters import Material
from actuator.solve.equilibrium import Equilibrium, State

LOADS = np.array([0.5, 1.0])


def case_of(material: dict[str, float]) -> tuple[Equilibrium, Material, State]:
    domain = half_cylinder()
    constants, load, limits = parameters(material=material)
    equilibrium = Equilibrium(domain, constants, load, limits, tolerance=1e-11, threads=1)
    return equilibrium, constants, equilibrium.solve(start_of(domain))


def of_felupe(domain: HalfCylinder, constants: Material, state: State, motion, rule: tuple[Floats, Floats]):
    from scipy.sparse.linalg import spsolve

    from benchmarks.felupe_problem import FelupeProblem

    problem = FelupeProblem(domain, constants, state.chi, state.p, rule)
    return problem, problem.solve(motion, LOADS, 1e-12, spsolve)


@pytest.mark.parametrize("material", [{}, {"hessian_regularisation": 0.0, "stiffness_contrast": 1e-3}])
def test_felupe_finds_the_same_displacements_and_reactions(material: dict[str, float]) -> None:
    pytest.importorskip("felupe")
    from benchmarks.given_pressure import GivenPressure
    from benchmarks.peer import compare

    case, constants, state = case_of(material)
    poro = GivenPressure(case, state)
    ours = poro.solve(LOADS, 1e-12)
    problem, theirs = of_felupe(case.domain, constants, state, poro.motion, case.discretisation.rule)
    for name, difference in compare(ours, theirs, case, state).items():
        assert difference < 1e-8, name
    assert np.abs(theirs.displacement - state.displacement).max() < 1e-8 * np.abs(state.displacement).max()
    # Another state than the solution, where the free forces are not zero: residual and tangent, entry by entry.
    x = state.x + 1e-2 * np.cos(np.arange(len(state.x)))
    x[-3:] = state.x[-3:]
    u = case.kinematics.displacement(x)
    nodal = poro.forces(x)
    np.testing.assert_allclose(problem.forces(u), nodal, atol=1e-12 * np.abs(nodal).max())
    upper = poro.linearise(x, nodal)[:-3, :-3]
    free = np.flatnonzero(poro.free)
    matrix = problem.matrix()[free][:, free]
    apart = abs(upper + upper.T - np.diag(upper.diagonal()) - matrix.toarray()).max()
    assert apart < 1e-11 * abs(matrix).max()


def test_a_difference_in_the_model_shows() -> None:
    pytest.importorskip("felupe")
    from benchmarks.given_pressure import GivenPressure
    from benchmarks.peer import compare

    case, constants, state = case_of({})
    poro = GivenPressure(case, state)
    ours = poro.solve(LOADS, 1e-12)
    softer = replace(constants, shear=0.999 * constants.shear)
    _, theirs = of_felupe(case.domain, softer, state, poro.motion, case.discretisation.rule)
    assert min(compare(ours, theirs, case, state).values()) > 1e-6


def test_a_load_that_cannot_be_reached_is_said() -> None:
    from benchmarks.given_pressure import GivenPressure

    case, _, state = case_of({})
    with pytest.raises(SolveFailure, match="load steps"):
        GivenPressure(case, replace(state, p=1e4 * state.p)).solve(np.ones(1), 1e-12)


def test_the_benchmark_says_what_is_missing() -> None:
    hidden = "import sys, runpy; sys.modules['felupe'] = None; sys.argv = ['peer'];"
    ended = subprocess.run(
        [sys.executable, "-c", f"{hidden} runpy.run_module('benchmarks.peer', run_name='__main__')"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode != 0
    assert "pip install 'poro[bench]'" in ended.stderr
    assert "Traceback" not in ended.stderr
