"""The metric of design steps."""

from __future__ import annotations

import numpy as np
import pytest
from physics import half_cylinder, parameters

from actuator.equations.discretisation import Discretisation
from actuator.equations.tangent import darcy_gather
from actuator.terms.step import Metric

DIFFUSIVITY_LENGTH = 15.0


def metric_with(length_unit: float = 1.0) -> Metric:
    discretisation, objective = Discretisation(half_cylinder(1, 1, 1)), parameters(length_unit=length_unit)[2]
    return Metric(discretisation, objective, darcy_gather(discretisation), threads=1)


@pytest.fixture(scope="module")
def metric() -> Metric:
    return metric_with()


def test_metric_of_a_linear_step(metric: Metric) -> None:
    """∫ δ² + L_t² ‖∇δ‖² for δ = s X1 is s² |Ω| (L²/3 + L_t²)."""
    domain = half_cylinder(1, 1, 1)
    delta = 0.3 * domain.points[:, 0]
    expected = 0.09 * metric.volume * (domain.length**2 / 3.0 + DIFFUSIVITY_LENGTH**2)
    assert delta @ (metric @ delta) == pytest.approx(expected, rel=1e-12)
    assert metric.norm(delta) == pytest.approx(np.sqrt(expected), rel=1e-12)
    assert metric.norm(np.ones(metric.size)) == pytest.approx(np.sqrt(metric.volume), rel=1e-12)


def test_dual_norm_is_the_largest_work_of_unit_steps(metric: Metric) -> None:
    rng = np.random.default_rng(1)
    g = rng.normal(size=metric.size)
    best = metric.solve(g)
    assert metric @ best == pytest.approx(g, rel=1e-10, abs=1e-12)
    assert metric.dual_norm(g) == pytest.approx(g @ best / metric.norm(best), rel=1e-10)
    for d in rng.normal(size=(20, metric.size)):
        assert g @ d / metric.norm(d) < metric.dual_norm(g)


def test_the_length_unit_is_what_its_integrals_are_counted_in(metric: Metric) -> None:
    other, delta = metric_with(length_unit=2.0), np.arange(metric.size, dtype=float)
    assert other.volume == metric.volume
    assert other.measure == pytest.approx(metric.measure / 8.0, rel=1e-14)
    assert other @ delta == pytest.approx(metric @ delta / 8.0, rel=1e-14)
