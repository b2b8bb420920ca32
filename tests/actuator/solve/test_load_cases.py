"""Several load cases: one objective and one model of states of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from physics import Floats, half_cylinder, halvings, parameters, rates

from actuator.load_case import LoadCase
from actuator.optimiser.loop import Optimiser, Progress
from actuator.optimiser.model import Model
from actuator.parameters import Objective
from actuator.solve import sensitivity as sensitivity_module
from actuator.solve.equilibrium import NoState
from actuator.solve.reduced import Evaluation, ReducedObjective

DOMAIN = half_cylinder(2, 2, 3)
MATERIAL, LOAD, LIMITS = parameters(strain_limit=0.055)

#: A light and a heavy one, which differ in all that a load has of its own.
TWO = (
    LoadCase(LOAD, 0.7, "free"),
    LoadCase(replace(LOAD, pressure=0.6 * LOAD.pressure, spring_stiffness=5.0 * LOAD.spring_stiffness), 0.4, "stiff"),
)


def objective_of(*cases: LoadCase, limits: Objective = LIMITS, state: float = 1e-12) -> ReducedObjective:
    tolerances = {"state_tolerance": state, "adjoint_tolerance": 3e-11}
    return ReducedObjective(DOMAIN, MATERIAL, cases, limits, **tolerances, threads=1)


def first_design() -> Floats:
    """The initial design, which leaks a little."""
    r = np.hypot(DOMAIN.points[:, 1], DOMAIN.points[:, 2])
    return DOMAIN.initial_design(DOMAIN.points, LIMITS.interface_width) - 1.2 * (r / 15.0) ** 2


@dataclass(frozen=True)
class Path:
    """An evaluated design, and its values along a direction."""

    objective: ReducedObjective
    at: Evaluation
    direction: Floats
    steps: Floats
    values: Floats


@pytest.fixture(scope="module")
def path() -> Path:
    objective, steps = objective_of(*TWO), halvings(0.04, 3)
    d = np.cos(DOMAIN.points @ np.array([0.25, -0.4, 0.3]))
    at = objective.evaluate(first_design())
    values = [objective.evaluate(at.chi + h * d, (at.x, at.p)).value for h in steps]
    return Path(objective, at, d, steps, np.array(values))


def test_design_counts_once_aims_by_weight_and_limits_whole(path: Path) -> None:
    alone = [objective_of(LoadCase(case.load)).evaluate(path.at.chi) for case in TWO]
    for name in ("C_chi", "C_A", "C_i"):
        assert path.at.terms[name] == alone[0].terms[name] == alone[1].terms[name]
    weighted = sum(case.weight * each.terms["C0"] for case, each in zip(TWO, alone, strict=True))
    assert path.at.terms["C0"] == pytest.approx(weighted, rel=1e-9)
    for name in ("C_p", "C_psi"):
        assert path.at.terms[name] == pytest.approx(sum(each.terms[name] for each in alone), rel=1e-6)
    assert path.at.measures["energy_ratio"] == pytest.approx(max(each.measures["energy_ratio"] for each in alone))
    assert path.at.state.arm == pytest.approx(alone[0].state.arm, rel=1e-9)


def test_taylor_rates_of_the_gradient(path: Path) -> None:
    slope = path.objective.gradient(path.at).total @ path.direction
    assert rates(path.values - path.at.value - slope * path.steps).min() > 1.9


def test_model_is_that_of_all_load_cases(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its value and gradient are exact at the centre, and along a direction it errs by the third order."""
    monkeypatch.setattr(sensitivity_module, "SWEEPS", 3)
    gradient = path.objective.gradient(path.at)
    model = Model(path.objective, path.at, gradient)
    start = model.start()
    assert start.value == pytest.approx(path.at.value, rel=1e-9)
    assert np.abs(model.gradient(start) - gradient.total).max() < 1e-6 * np.abs(gradient.total).max()
    dx = model.sensitivity @ path.direction
    points = [model(h * path.direction, h * dx) for h in path.steps]
    errors = [point.value - value for point, value in zip(points, path.values, strict=True) if point]
    assert len(errors) == 3
    assert rates(errors).min() > 2.5
    moved = points[-1]
    assert moved is not None
    slope = model.gradient(moved) @ path.direction
    ahead = [model(moved.delta + h * path.direction, moved.dx + h * dx) for h in path.steps]
    rest = [point.value - moved.value - h * slope for point, h in zip(ahead, path.steps, strict=True) if point]
    assert rates(rest).min() > 1.9


def optimised(objective: ReducedObjective, updates: int = 3) -> tuple[Optimiser, Progress]:
    optimiser = Optimiser(objective)
    progress = optimiser.begin(first_design())
    optimiser.run(progress, updates)
    assert len(progress.history) == updates + 1
    return optimiser, progress


@pytest.mark.parametrize(("updates", "error"), [(1, 1e-12), (3, 1e-3)])
def test_one_load_case_twice_with_half_its_weight_is_that_load_case_once(updates: int, error: float) -> None:
    """Leak and strain energy of both count whole, so that their weights have to be halved with those of the cases.

    From the second update on subproblems that are solved to some digits let rounding grow, to a tenth of what it takes
    to change the design as a state tolerance of 1e-11 does.
    """
    halved = replace(
        LIMITS, leak_weight=0.5 * LIMITS.leak_weight, strain_energy_weight=0.5 * LIMITS.strain_energy_weight
    )
    _, once = optimised(objective_of(LoadCase(LOAD)), updates)
    _, twice = optimised(objective_of(LoadCase(LOAD, 0.5, "a"), LoadCase(LOAD, 0.5, "b"), limits=halved), updates)
    change = np.abs(once.evaluation.chi - first_design()).max()
    assert change > 0.1
    assert np.abs(twice.evaluation.chi - once.evaluation.chi).max() < error * change
    last, expected = twice.history[-1], once.history[-1]
    assert last["C"] == pytest.approx(expected["C"], rel=max(error, 1e-9))
    for name in ("C0", "T1", "T3", "theta2", "energy_ratio"):
        assert last[f"{name}.b"] == pytest.approx(expected[name], rel=max(error, 1e-9))


def test_what_goes_on_from_a_checkpoint_is_what_would_have_been() -> None:
    whole, straight = optimised(objective_of(*TWO, state=1e-8))
    stopped, there = optimised(objective_of(*TWO, state=1e-8), updates=2)
    resumed = Optimiser(objective_of(*TWO, state=1e-8))
    progress = resumed.resume(stopped.checkpoint(there))
    resumed.run(progress, 3)
    expected, found = whole.checkpoint(straight), resumed.checkpoint(progress)
    assert found.keys() == expected.keys()
    for name in ("chi", "x", "p", "adjoint_x", "adjoint_p", "gradient"):
        np.testing.assert_array_equal(found[name], expected[name])


def test_the_load_case_without_a_state_is_named() -> None:
    hard = LoadCase(replace(LOAD, pressure=50.0 * LOAD.pressure), 1.0, "burst")
    with pytest.raises(NoState, match=r"^Load case 'burst': "):
        objective_of(TWO[0], hard).evaluate(first_design())
