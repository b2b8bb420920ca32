"""Stability under stress: the cheap rows of `python -m benchmarks.stress`, and what was mended because of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from command_line import Poro

from actuator.linear import available
from actuator.solve.equilibrium import NoState
from actuator.solve.reduced import ReducedObjective
from benchmarks.stress_checks import bar_rotation, law_error, material_is_finite, patch_error, skewed_trial
from benchmarks.stress_rows import default, held, scaled, signs, tube, uniform
from benchmarks.stress_trial import Found, Trial, difference, gradient_error, run, settings
from pipeline.case.model import parse_case
from pipeline.exit_codes import ExitCode, Fault
from stages import optimize
from stages.domains import HalfCylinderSettings
from stages.events import Event, Message
from stages.settings import ObjectiveSettings, ProblemSettings


@pytest.fixture(scope="module")
def reference() -> Found:
    return run(default())


# -------------------------------------------------------------------------------------- a state and its gradient

EASY = {
    "ν 0.4999": {"material__poisson_ratio": 0.4999},
    "E0 1e-9": {"material__stiffness_contrast": 1e-9},
    "k_s / k_v 1e-3": {"material__permeability_contrast": 1e-3},
    "k_s / k_v 1e-9": {"material__permeability_contrast": 1e-9},
    "p_in a tenth": {"load__pressure_ratio": 2e-3},
    "no spring": {"load__spring_ratio": 0.0},
}


@pytest.mark.parametrize("changes", EASY.values(), ids=EASY.keys())
def test_extreme_parameters_have_a_stable_state_and_an_exact_gradient(changes: dict[str, float]) -> None:
    found = run(Trial("parameters", "", settings(**changes)))
    assert found.converged, found.reason
    assert found.newton <= 12
    assert found.objective.equilibrium.linearise(found.at.state, fresh=True).negative_eigenvalues in (0, None)
    assert gradient_error(found) < 1e-5


@pytest.mark.parametrize(
    "trial",
    [
        Trial("ν", "0.3", settings(material__poisson_ratio=0.3)),
        Trial("p_in", "10 ×", settings(load__pressure_ratio=0.2)),
        Trial("χ", "void", design=uniform(-30.0)),
    ],
    ids=lambda trial: f"{trial.what} {trial.value}",
)
def test_no_state_from_rest_is_said_with_what_helps(trial: Trial) -> None:
    found = run(trial)
    assert not found.converged
    assert found.newton <= 25
    assert found.reason.startswith("Newton's method ")
    for word in ("material.hessian_regularisation", "load.pressure_ratio", "walls"):
        assert word in found.reason
    assert "design step" not in found.reason  # there was none


def test_that_advice_helps() -> None:
    case = settings(material__poisson_ratio=0.3, material__hessian_regularisation=1e-5)
    assert run(Trial("ν", "0.3", case)).converged


@pytest.mark.parametrize(("changes", "said"), [({}, 0), ({"material__poisson_ratio": 0.4}, 1)], ids=["ν 0.48", "ν 0.4"])
def test_a_state_that_is_not_stable_is_said_to_be_none_to_stay_in(changes: dict[str, float], said: int) -> None:
    events: list[Event] = []
    chosen = optimize.Settings(**settings(**changes).model_dump(), optimizer=optimize.OptimizerSettings(max_updates=0))
    optimize.run(chosen, compute=optimize.Compute(threads=1, linear_solver=available()[0]), observer=events.append)
    texts = [event.text for event in events if isinstance(event, Message)]
    assert sum("not stable" in text for text in texts) == (said if available()[0] == "pardiso" else 0)


def test_no_state_near_another_design_asks_for_a_smaller_step(reference: Found) -> None:
    state, equilibrium = reference.at.state, reference.objective.equilibrium
    with pytest.raises(NoState, match="smaller design step"):
        equilibrium.solve(np.full_like(state.chi, -30.0), (state.x, state.p))


# ------------------------------------------------------------------------------------------- extreme fields

EXTREMES = (-1000.0, -100.0, -30.0, -8.0, 0.0, 30.0, 1000.0)


@pytest.mark.parametrize("chi", EXTREMES)
def test_laws_at_extreme_fields_against_exact_fractions(chi: float) -> None:
    assert law_error(chi) < 1e-14


@pytest.mark.parametrize("design", [uniform(1000.0), uniform(-1000.0), signs, tube(1000.0)])
def test_extreme_fields_give_finite_equations(reference: Found, design: object) -> None:
    assert callable(design)
    assert material_is_finite(reference.objective, design(reference.objective.domain))


def test_a_field_of_solid_alone_is_stiff() -> None:
    found = run(Trial("χ", "1000", design=uniform(1000.0)))
    assert found.converged, found.reason
    assert abs(found.at.state.arm[2]) < 1e-6


# ---------------------------------------------------------------------------------------------------- cells


def test_skewed_cells_hold_a_uniform_stress_and_give_an_exact_gradient(reference: Found) -> None:
    trial = skewed_trial()
    assert trial.domain is not None
    assert patch_error(trial.domain) < 1e-12
    found = run(trial)
    # The adjoint's tolerance is relative to a load that the wall's response to pressure makes large.
    assert gradient_error(found) < 2e-4
    # Another mesh, and not another actuator.
    assert found.at.state.arm[2] == pytest.approx(reference.at.state.arm[2], rel=0.2)


def test_cells_fifty_times_as_wide_as_thick() -> None:
    case = settings().model_copy(update={"domain": HalfCylinderSettings(core_cells=1, rings=1, layers=100)})
    found = run(Trial("aspect", "50", case))
    assert found.converged, found.reason
    assert gradient_error(found) < 1e-5


def test_a_nearly_incompressible_bar_does_not_lock() -> None:
    """Rotation under an end moment: what 20-node cells lose to the constraint stays within what the clamp takes."""
    soft, hard = bar_rotation(0.3), bar_rotation(0.4999)
    assert soft == pytest.approx(1.0, abs=0.02)
    assert 0.93 < hard < soft


# ---------------------------------------------------------------------------------------------- same answers


@pytest.mark.parametrize(("length", "stiffness"), [(1e3, 1.0), (1.0, 1e-3), (1e-3, 1e3)])
def test_a_scaled_case_has_the_same_answer(reference: Found, length: float, stiffness: float) -> None:
    found = run(Trial("scaled", "", scaled(length, stiffness)))
    assert found.krylov == reference.krylov
    assert difference(found, reference) < 1e-10


def updated_once(case: ProblemSettings) -> optimize.Result:
    """The case on a coarser mesh after one cheap design update, by the stage itself."""
    mesh = {"core_cells": 3, "layers": 4}
    problem = case.model_copy(update={"domain": case.domain.model_copy(update=mesh)})
    steps = optimize.OptimizerSettings(max_updates=1, max_inner_steps=6)
    return optimize.run(optimize.Settings(**problem.model_dump(), optimizer=steps), compute=optimize.Compute(threads=1))


def test_a_scaled_case_takes_the_same_design_update() -> None:
    ours, theirs = updated_once(scaled(1e3, 1e-3)), updated_once(settings())
    assert len(theirs.history["C"]) == 2
    assert ours.history["C"] == pytest.approx(theirs.history["C"], rel=1e-6)
    assert ours.chi == pytest.approx(theirs.chi, abs=1e-4)
    assert ours.domain.points == pytest.approx(1e3 * theirs.domain.points, rel=1e-12)
    assert ours.displacement == pytest.approx(1e3 * theirs.displacement, rel=1e-6, abs=1e-6)
    assert ours.pressure == pytest.approx(1e-3 * theirs.pressure, rel=1e-6, abs=1e-12)
    assert ours.arm == pytest.approx(theirs.arm * (1e3, 1e3, 1.0), rel=1e-6)
    assert ours.history["T3"] == pytest.approx(1e3 * theirs.history["T3"], rel=1e-6)
    assert ours.summary["spring_elongation"] == pytest.approx(1e3 * theirs.summary["spring_elongation"], rel=1e-6)


def test_a_case_of_another_size_is_the_one_that_its_own_units_give() -> None:
    """Solved in mm and N/mm² as they stand, and by the stage, which computes in units of its own."""
    case = settings(domain__radius=22.0, domain__length=31.0, objective__interface_width=5.0)
    case = case.model_copy(update={"material": case.material.model_copy(update={"youngs_modulus": 0.4})})
    domain, limits = case.domain.build(), case.objective
    plain = ReducedObjective(domain, *case.parameters(), threads=1)
    at = plain.evaluate(domain.initial_design(domain.points, limits.interface_width, limits.length_unit))
    none = optimize.OptimizerSettings(max_updates=0)
    ours = optimize.run(optimize.Settings(**case.model_dump(), optimizer=none), compute=optimize.Compute(threads=1))
    assert ours.arm == pytest.approx(at.state.arm, rel=1e-6)
    assert ours.displacement == pytest.approx(at.state.displacement, rel=1e-4, abs=1e-6)
    assert ours.pressure == pytest.approx(at.state.p, rel=1e-5, abs=1e-9)
    assert ours.summary["terms"] == pytest.approx(at.terms, rel=1e-5, abs=1e-12)


def test_threads_and_linear_solvers_give_the_same_answer(reference: Found) -> None:
    assert difference(run(Trial("threads", "2", threads=2)), reference) < 1e-10
    assert difference(run(Trial("solver", "superlu", solver="superlu")), reference) < 1e-10


# ------------------------------------------------------------------------------------------------- case files


def test_the_length_unit_scales_the_weights() -> None:
    case = parse_case(b"objective: {length_unit: 1000.0}\n", "case.yaml", "case")
    _, _, limits = case.parameters()
    assert (limits.slope_weight, limits.passive_weight) == pytest.approx((1e9, 1e-4))


def test_the_shift_of_the_strain_limit_is_a_number_or_as_printed() -> None:
    assert ObjectiveSettings().strain_energy_shift == 0.0
    for shift, found in (("0.0", 0.0), ("2.5", 2.5), ("4/L_i", 4.0 / 3.0), ("8/L_i", 8.0 / 3.0)):
        case = parse_case(f"objective: {{strain_energy_shift: {shift}}}\n".encode(), "case.yaml", "case")
        assert case.parameters()[2].energy_shift == pytest.approx(found, rel=1e-15)
    with pytest.raises(Fault, match="strain_energy_shift"):
        parse_case(b"objective: {strain_energy_shift: 6/L_i}\n", "case.yaml", "case")


def test_the_stiffest_spring_is_a_held_end(reference: Found) -> None:
    coarse = HalfCylinderSettings(core_cells=3, rings=2, layers=4)
    found = run(Trial("spring", "1e6", settings(load__spring_ratio=1e6).model_copy(update={"domain": coarse})))
    error, _ = held(found, reference)
    assert error < 1e-7


@pytest.mark.parametrize("ratio", [".inf", "+.INF", "1.0e+7"])
def test_a_stiffer_spring_is_refused_with_what_to_write(poro: Poro, tmp_path: Path, ratio: str) -> None:
    (tmp_path / "case.yaml").write_text(f"load:\n  spring_ratio: {ratio}\n")
    ended = poro("optimize", "case.yaml")
    assert ended.code == ExitCode.USAGE
    assert "case.yaml:2: load.spring_ratio: must be at most 1e+06; write 1.0e+6" in ended.err
