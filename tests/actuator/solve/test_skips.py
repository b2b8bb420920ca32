"""What the model leaves out because it cannot matter: the same results, and the work is not done."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest
from physics import Floats
from small_case import start_of

from actuator.optimiser.model import Model
from actuator.solve.reduced import Evaluation, ReducedObjective
from benchmarks.small_cases import SMALL, problem, reduced_objective

#: Not zero, and too small to change anything.
ALMOST = 1e-200


#: Ψ_lim, N/mm², so low that C_Ψ acts on the initial design.
LOW = 1e-3


def small_objective(**changes: float) -> ReducedObjective:
    return reduced_objective(problem(SMALL), **changes)


def evaluated(objective: ReducedObjective) -> Evaluation:
    return objective.evaluate(start_of(objective.domain))


@pytest.fixture(scope="module")
def objective() -> ReducedObjective:
    return small_objective(energy_limit=LOW)


@pytest.fixture(scope="module")
def at(objective: ReducedObjective) -> Evaluation:
    return evaluated(objective)


def second_derivatives(objective: ReducedObjective, at: Evaluation, adjoint: tuple[Floats, Floats]) -> list[Floats]:
    """Of the Lagrangian along a change of χ, by complex step."""
    chi = at.chi + 1e-40j * np.cos(objective.domain.points @ [0.25, -0.4, 0.3])
    found = objective.derivatives(chi, at.state.x, at.state.p, *adjoint, at.state.nodal)
    return [part for values in found for part in (values.real, values.imag)]


@pytest.mark.parametrize(
    "name", ["hessian_penalty", "strain_energy_weight", "area_weight", "slope_weight", "passive_weight"]
)
def test_zero_is_the_same_as_hardly_anything(name: str, objective: ReducedObjective, at: Evaluation) -> None:
    assert at.measures["energy_ratio"] > 1.0
    adjoint = objective.gradient(at).adjoint
    zero, almost = (small_objective(energy_limit=LOW, **{name: value}) for value in (0.0, ALMOST))
    for one, other in (
        (zero.equilibrium.residual(*fields(at))[:3], almost.equilibrium.residual(*fields(at))[:3]),
        (second_derivatives(zero, at, adjoint), second_derivatives(almost, at, adjoint)),
        ([zero.design(at.chi).gradient], [almost.design(at.chi).gradient]),
        ([zero.design(at.chi).hessian], [almost.design(at.chi).hessian]),
        ([np.array(zero.design.value(at.chi))], [np.array(almost.design.value(at.chi))]),
    ):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-190)


def fields(at: Evaluation) -> tuple[Floats, Floats, Floats]:
    return at.state.chi, at.state.x, at.state.p


def test_without_pressure_nothing_is_solved() -> None:
    resting = small_objective(pressure=0.0)
    found = evaluated(resting)
    gradient = resting.gradient(found)
    work = resting.equilibrium.work
    assert (work.newton, work.krylov, work.factorisations, work.darcy_factorisations) == (0, 0, 0, 0)
    assert resting.equilibrium.statistics.factorisations == 0
    assert not found.state.displacement.any()
    assert found.state.lowest_jacobian == 1.0
    np.testing.assert_array_equal(gradient.total, found.design.gradient)
    # As solved for: the multipliers of C_0 see neither stress nor flow.
    chi, x, p = fields(found)
    assert not resting.equilibrium.pressure(chi, x).any()
    _, gx, gp = resting.derivatives(chi, x, p, x, p, found.state.nodal)
    assert gx.any()
    adjoint = resting.equilibrium.linearise(found.state).solve(-gx, -gp, 1e-10, transposed=True)
    physics, _, _ = resting.derivatives(chi, x, p, *adjoint, found.state.nodal)
    assert np.abs(physics).max() < 1e-14 * np.abs(gradient.total).max()


def test_factors_of_the_same_state_need_no_assembly(
    objective: ReducedObjective, at: Evaluation, monkeypatch: pytest.MonkeyPatch
) -> None:
    equilibrium = objective.equilibrium
    equilibrium.forget_factors()
    equilibrium.linearise(equilibrium.at(at.chi, 0.9 * at.state.x, at.state.p))
    there = equilibrium.linearise(at.state)  # with factors of the state before
    before, matrix = asdict(equilibrium.work), equilibrium.tangent.xx.data.copy()
    monkeypatch.setattr(equilibrium.tangent, "assemble", None)  # to call it would fail
    assert equilibrium.linearise(at.state, fresh=True) is there
    assert equilibrium.linearise(at.state, fresh=True) is there, "once is enough"
    assert asdict(equilibrium.work) == before | {"factorisations": before["factorisations"] + 1}
    np.testing.assert_array_equal(equilibrium.tangent.xx.data, matrix)


def test_pressure_of_the_same_design_and_state_is_factorised_once(objective: ReducedObjective, at: Evaluation) -> None:
    equilibrium, chi = objective.equilibrium, at.chi.copy()
    first = equilibrium.pressure(chi, at.state.x)
    before = equilibrium.work.darcy_factorisations
    np.testing.assert_array_equal(equilibrium.pressure(at.chi, at.state.x.copy()), first)
    assert equilibrium.work.darcy_factorisations == before
    chi += 0.1  # the same array, another design
    assert np.abs(equilibrium.pressure(chi, at.state.x) - first).max() > 1e-6 * np.abs(first).max()
    equilibrium.pressure(chi, 0.5 * at.state.x)
    assert equilibrium.work.darcy_factorisations == before + 2


def test_leak_without_weight_is_not_probed() -> None:
    found = {}
    for weight in (0.0, ALMOST):
        objective = small_objective(leak_weight=weight)
        here = evaluated(objective)
        model = Model(objective, here, objective.gradient(here))
        start = model.start()
        model.gradient(start)
        solver = objective.equilibrium._flow.solver.statistics
        before = solver.solves
        found[weight] = model.diagonal(start)
        assert (solver.solves > before) == (weight > 0.0)
    np.testing.assert_array_equal(found[0.0], found[ALMOST])
