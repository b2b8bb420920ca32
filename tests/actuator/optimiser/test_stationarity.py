"""The measure of stationarity: without units, and the same on every mesh."""

from __future__ import annotations

import numpy as np
import pytest
from physics import Floats, half_cylinder
from small_case import metric_of, small_domain, small_objective, start_of

from actuator.domains.half_cylinder import HalfCylinder
from actuator.optimiser.stationarity import stationarity
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from stages.domains import HalfCylinderSettings
from stages.settings import LoadSettings, MaterialSettings, ObjectiveSettings, ProblemSettings


def measured(objective: ReducedObjective, chi: Floats) -> tuple[Evaluation, float]:
    at = objective.evaluate(chi)
    return at, stationarity(at, objective.gradient(at), metric_of(objective))


def problem(lengths: float = 1.0, stiffness: float = 1.0, **weights: float) -> ReducedObjective:
    """The small case scaled in length and stiffness."""
    settings = ProblemSettings(
        domain=HalfCylinderSettings(radius=15.0 * lengths, length=15.0 * lengths, core_cells=3, rings=2, layers=4),
        material=MaterialSettings(youngs_modulus=2.736 * stiffness),
        load=LoadSettings(),
        objective=ObjectiveSettings(
            strain_limit=0.04,
            strain_energy_shift="4/L_i",
            interface_width=3.0 * lengths,
            diffusivity_length=15.0 * lengths,
            **weights,
        ),
    )
    tolerances = {"state_tolerance": 1e-11, "adjoint_tolerance": 1e-11}
    return ReducedObjective(settings.domain.build(), *settings.parameters(), **tolerances, threads=1)


def assert_alike(scaled: ReducedObjective, original: ReducedObjective, lengths: float, unused: set[str]) -> None:
    chi = start_of(small_domain())
    at, measure = measured(scaled, chi)
    before, measure_before = measured(original, chi)
    for term, value in before.terms.items():
        assert at.terms[term] == pytest.approx(value, rel=1e-6), term
        assert (term in unused) or abs(value) > 1e-9
    assert measure == pytest.approx(measure_before, rel=1e-6)
    assert at.state.arm == pytest.approx(before.state.arm * [lengths, lengths, 1.0], rel=1e-6)


def test_unit_of_force_does_not_matter() -> None:
    assert_alike(problem(stiffness=10.0), problem(), 1.0, set())


def test_unit_of_length_does_not_matter() -> None:
    """Without C_χ and C_Ψ: the paper multiplies lengths by L_i in Eq. (20) and adds 4/L_i to χ in C_Ψ.

    c_i multiplies the integral of a gradient to the sixth, so that it is not a number in itself.
    """
    unused = {"passive_weight": 0.0, "strain_energy_weight": 0.0}
    scaled = problem(lengths=10.0, stiffness=10.0, slope_weight=1e3, **unused)
    assert_alike(scaled, problem(**unused), 10.0, {"C_chi", "C_psi"})


def smooth_design(domain: HalfCylinder) -> Floats:
    """A field that the coarsest mesh resolves; the pressure too, with interfaces as wide as below."""
    x = domain.points / domain.radius
    return 1.0 + 0.5 * np.cos(np.pi * x[:, 0]) + 0.5 * x[:, 2]


def test_measure_hardly_depends_on_the_mesh() -> None:
    measures, bends, nodal = [], [], []
    for cells in ((4, 2, 6), (6, 3, 9)):
        domain = half_cylinder(*cells)
        # Wide interfaces make the pressure decay over millimetres rather than hundredths.
        objective = small_objective(
            domain, interface_width=300.0, passive_weight=0.0, slope_weight=0.0, leak_weight=10.0
        )
        at = objective.evaluate(smooth_design(domain))
        gradient = objective.gradient(at)
        measures.append(stationarity(at, gradient, metric_of(objective)))
        nodal.append(np.abs(gradient.total).max())
        bends.append(at.terms["C0"])
    assert measures[1] == pytest.approx(measures[0], rel=0.03)
    assert bends[1] == pytest.approx(bends[0], rel=0.03)
    # Nodal values shrink with the cells, as a measure made of them would.
    assert nodal[1] < 0.7 * nodal[0]


def test_no_gradient_no_measure() -> None:
    objective = small_objective()
    at = objective.evaluate(start_of(objective.domain))
    zero = Gradient(np.zeros_like(at.chi), (np.zeros_like(at.state.x), np.zeros_like(at.state.p)))
    metric = metric_of(objective)
    assert stationarity(at, zero, metric) == 0.0
    gradient = objective.gradient(at)
    doubled = Gradient(2.0 * gradient.total, gradient.adjoint)
    assert stationarity(at, doubled, metric) == pytest.approx(2.0 * stationarity(at, gradient, metric), rel=1e-12)


def test_measure_of_an_objective_that_a_uniform_change_doubles() -> None:
    """By hand: dC/dχ such that a uniform change by one raises C by Σ|C_k|, and nothing else does better."""
    objective = small_objective()
    at = objective.evaluate(start_of(objective.domain))
    metric = metric_of(objective)
    scale = sum(abs(value) for value in at.terms.values())
    uniform = metric @ np.ones(metric.size) / metric.volume * scale
    gradient = Gradient(uniform, (np.zeros_like(at.state.x), np.zeros_like(at.state.p)))
    assert uniform.sum() == pytest.approx(scale, rel=1e-12)
    assert stationarity(at, gradient, metric) == pytest.approx(1.0, rel=1e-10)
