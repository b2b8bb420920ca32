"""Pointwise laws against the paper's formulas in 60-digit arithmetic."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal, localcontext

import numpy as np
import pytest
from physics import (
    LENGTH,
    RADIUS,
    STRETCH,
    Floats,
    coefficients,
    first_piola,
    half_cylinder,
    parameters,
    ramp,
    strain_energy,
)

from actuator.domains.smooth_minimum import smooth_minimum
from actuator.material.constants import Constants
from actuator.material.elasticity import energy_density
from actuator.material.ersatz import (
    drainage,
    inverse,
    left_cauchy_green,
    log_fitted_permeability,
    permeability,
    sigmoid,
    stiffness,
)

C = coefficients()
DOMAIN = half_cylinder()
CHI = [-700.0, -60.0, -20.0, -8.0, -3.3, -0.7, 0.0, 0.1, 1.9, 5.0, 12.0, 30.0, 45.0, 700.0]
ONE = Decimal(1)


def rho(chi: Decimal) -> Decimal:
    return ONE / (ONE + (-chi).exp())


def exact_stiffness(chi: Decimal, c: Constants) -> Decimal:
    contrast, penalty = Decimal(c.stiffness_contrast), Decimal(c.ramp_penalty)
    return contrast + (ONE - contrast) * rho(chi) / (ONE + penalty * (ONE - rho(chi)))


def exact_permeability(chi: Decimal, c: Constants) -> Decimal:
    solid, void = Decimal(c.solid_permeability), Decimal(c.void_permeability)
    tail = (-chi - 8).exp()
    return (solid + void * tail) / (ONE + tail)


def exact_drainage(chi: Decimal, c: Constants) -> Decimal:
    return Decimal(c.drainage) * rho(chi)


def exact_fitted_permeability(chi: Decimal, c: Constants, size: Decimal) -> Decimal:
    k = exact_permeability(chi, c)
    twice = size * (exact_drainage(chi, c) / k).sqrt()
    return k * (twice / ((twice / 2).exp() - (-twice / 2).exp())) ** 2


LAWS = {
    "stiffness": (stiffness, exact_stiffness),
    "permeability": (permeability, exact_permeability),
    "drainage": (drainage, exact_drainage),
}
law = pytest.mark.parametrize(("ours", "paper"), LAWS.values(), ids=LAWS.keys())
Ours = Callable[[complex, Constants], tuple[complex, complex]]
Paper = Callable[[Decimal, Constants], Decimal]


@pytest.mark.parametrize("chi", CHI)
def test_density_is_the_sigmoid_to_full_precision(chi: float) -> None:
    with localcontext(prec=400):
        assert sigmoid(chi) == pytest.approx(float(rho(Decimal(chi))), rel=1e-15)


@pytest.mark.parametrize("size", [0.01, 0.8, 30.0])
@pytest.mark.parametrize("chi", CHI)
def test_fitted_permeability_and_its_derivative(chi: float, size: float) -> None:
    with localcontext(prec=900):
        step, centre, h = Decimal(10) ** -60, Decimal(chi), Decimal(size)
        value = float(exact_fitted_permeability(centre, C, h).ln())
        ahead, behind = (exact_fitted_permeability(centre + d, C, h).ln() for d in (step, -step))
        slope = float((ahead - behind) / (2 * step))
    ours = log_fitted_permeability(chi, C, size**2)
    assert ours[0] == pytest.approx(value, rel=1e-13, abs=1e-13)
    assert ours[1] == pytest.approx(slope, rel=1e-10, abs=1e-14)
    by_complex_step = log_fitted_permeability(chi + 1e-40j, C, size**2)[0].imag / 1e-40
    assert by_complex_step == pytest.approx(ours[1], rel=1e-10, abs=1e-14)


def test_fitted_permeability_is_continuous_where_its_series_ends() -> None:
    """On both sides of Q_out h² / k = 0.01 the factor is that of the closed form."""
    chi = -3.0
    k = permeability(chi, C)[0]
    for thickness in (0.01 * (1.0 - 1e-9), 0.01 * (1.0 + 1e-9)):
        s = Decimal(thickness).sqrt() / 2
        factor = (2 * s / (s.exp() - (-s).exp())) ** 2
        ours = log_fitted_permeability(chi, C, thickness * k / drainage(chi, C)[0])
        assert ours[0] - np.log(k) == pytest.approx(float(factor.ln()), rel=1e-11)


@law
@pytest.mark.parametrize("chi", CHI)
def test_values_and_derivatives_match_the_paper(ours: Ours, paper: Paper, chi: float) -> None:
    with localcontext(prec=800):
        step = Decimal(10) ** -60
        centre = Decimal(chi)
        value = float(paper(centre, C))
        slope = float((paper(centre + step, C) - paper(centre - step, C)) / (2 * step))
    assert ours(chi, C)[0] == pytest.approx(value, rel=2e-15)
    assert ours(chi, C)[1] == pytest.approx(slope, rel=1e-14)


@law
@pytest.mark.parametrize("chi", [-12.0, -8.0, -0.4, 0.0, 0.4, 9.0])
def test_complex_step_gives_the_derivative(ours: Ours, paper: Paper, chi: float) -> None:
    value, slope = ours(complex(chi, 1e-40), C)
    assert value.imag / 1e-40 == pytest.approx(ours(chi, C)[1], rel=1e-14)
    assert slope.real == pytest.approx(ours(chi, C)[1], rel=1e-14)


@law
@pytest.mark.parametrize("chi", [-1000.0, 1000.0, complex(-1000.0, 1e-40), complex(1000.0, 1e-40)])
def test_far_arguments_stay_finite_and_saturate(ours: Ours, paper: Paper, chi: complex) -> None:
    value, slope = ours(chi, C)
    with localcontext(prec=60):
        limit = float(paper(Decimal(chi.real), C))
    assert np.isfinite([value, slope]).all()
    assert value.real == pytest.approx(limit, rel=1e-15)
    assert abs(slope) < 1e-300


def test_limits_of_the_ersatz_material() -> None:
    assert stiffness(-800.0, C)[0] == pytest.approx(1e-6, rel=1e-15)
    assert stiffness(800.0, C)[0] == pytest.approx(1.0, rel=1e-15)
    assert permeability(800.0, C)[0] == pytest.approx(1e-6 * permeability(-800.0, C)[0], rel=1e-14)
    assert drainage(-800.0, C)[0] == 0.0
    # Table 1: k_v = 1000 L²/E; Section 2.1: Q_s = (ln 10 / (0.02 L_i))² k_s with L_i = 3 mm.
    assert permeability(-800.0, C)[0] == pytest.approx(1000.0 * LENGTH**2 / 2.736, rel=1e-14)
    assert drainage(800.0, C)[0] == pytest.approx((np.log(10.0) / 0.06) ** 2 * 1e-3 * LENGTH**2 / 2.736, rel=1e-13)


def test_parameters_of_table_1() -> None:
    material, load, objective = parameters(strain_limit=0.11)
    E, nu = 2.736, 0.48
    assert 9.0 * material.bulk * material.shear / (3.0 * material.bulk + material.shear) == pytest.approx(E, rel=1e-13)
    assert material.bulk == pytest.approx(E / (3.0 * (1.0 - 2.0 * nu)), rel=1e-14)
    assert material.hessian_penalty == pytest.approx(5.13e-3, rel=1e-12)  # α L² K_s with α = 1e-6
    assert load.pressure == pytest.approx(0.02 * E, rel=1e-14)
    assert load.arm_length == 60.0
    assert load.spring_stiffness == pytest.approx(1.6e-2 * E * RADIUS**3 / 60.0**2, rel=1e-14)
    assert objective.energy_limit == pytest.approx(0.5 * 0.11**2 * E, rel=1e-14)


# ---------------------------------------------------------------------------------- fields of the appendices


def source_at(r: float) -> float:
    """Q_in at a distance from the axis."""
    return float(100.0 * C.drainage * DOMAIN.inlet(np.array([1.0, 0.6 * r, -0.8 * r])))


@pytest.mark.parametrize("ratio", [0.0, 0.1, 0.15, 0.17, 0.2, 0.22, 0.249, 0.25, 0.3, 1.0])
def test_source_of_appendix_a(ratio: float) -> None:
    bracket = max(10.0 * ratio - 1.5, 0.0)
    expected = 100.0 * C.drainage * (1.0 - np.sin(0.5 * np.pi * min(1.0, bracket)) ** 2)
    source = source_at(ratio * RADIUS)
    assert source == pytest.approx(expected, rel=1e-13, abs=1e-13 * C.drainage)


def test_source_is_zero_outside_a_quarter_of_the_radius() -> None:
    inside, outside = source_at(0.14 * RADIUS), source_at(0.26 * RADIUS)
    assert inside == 100.0 * C.drainage
    assert abs(outside) < 1e-28 * C.drainage


def log_sum_exp_minimum(a: Floats, b: Floats, width: float) -> Floats:
    """Eq. (20) as printed."""
    return -4.0 / width * np.log(np.exp(-a * width / 4.0) + np.exp(-b * width / 4.0))


def test_smooth_minimum_is_the_printed_formula_and_does_not_overflow() -> None:
    a, b = np.array([-3.0, 0.2, 5.0, 40.0]), np.array([2.0, 0.2, 1.0, -7.0])
    assert smooth_minimum(a, b, 3.0) == pytest.approx(log_sum_exp_minimum(a, b, 3.0), rel=1e-14)
    assert smooth_minimum(np.array([-1e4]), np.array([1e4]), 3.0)[0] == -1e4


def test_initial_design_of_appendix_c() -> None:
    rng, width = np.random.default_rng(4), 3.0
    points = rng.uniform(-1.0, 1.0, (50, 3)) * RADIUS
    r = np.sqrt(points[:, 1] ** 2 + points[:, 2] ** 2)
    wall = log_sum_exp_minimum(0.95 * RADIUS - r, r - 0.45 * RADIUS, width)
    tube = 8.0 / (3.0 * width) * wall - 0.1 * np.where(points[:, 2] > 0.0, points[:, 2], 0.0)
    passive = 8.0 / width * log_sum_exp_minimum(RADIUS - r, r - 0.3 * RADIUS, width)
    expected = log_sum_exp_minimum(tube, passive, width)
    assert DOMAIN.initial_design(points, width) == pytest.approx(expected, rel=1e-12, abs=1e-12)


# ---------------------------------------------------------------------------------------------- hyperelasticity


def test_inverse_and_left_cauchy_green() -> None:
    F, out, b = np.array(STRETCH), np.empty((3, 3)), np.empty((3, 3))
    assert inverse(F, out) == pytest.approx(np.linalg.det(F), rel=1e-14)
    assert out == pytest.approx(np.linalg.inv(F), rel=1e-13)
    assert left_cauchy_green(F, b) == pytest.approx(np.sum(F**2), rel=1e-14)
    assert b == pytest.approx(F @ F.T, rel=1e-14)


def test_strain_energy_of_simo_taylor_and_pister() -> None:
    J = np.linalg.det(STRETCH)
    b = STRETCH @ STRETCH.T
    ours = 0.37 * energy_density(C, np.log(J), J ** (-2.0 / 3.0), np.trace(b), b)
    assert ours == pytest.approx(strain_energy(STRETCH, 0.37, C), rel=1e-14)
    assert energy_density(C, 0.0, 1.0, 3.0, np.eye(3)) == 0.0


def test_reference_stress_is_the_derivative_of_the_reference_energy() -> None:
    """The NumPy laws that other tests rely on agree with each other, and with Hooke's law for small strains."""
    factor, pressure = ramp(np.array(0.6), C), np.array(0.0)
    slope = np.empty((3, 3))
    for i, j in np.ndindex(3, 3):
        h = 1e-6 * np.outer(np.eye(3)[i], np.eye(3)[j])
        slope[i, j] = (strain_energy(STRETCH + h, factor, C) - strain_energy(STRETCH - h, factor, C)) / 2e-6
    assert first_piola(STRETCH, factor, pressure, C) == pytest.approx(slope, rel=1e-6, abs=1e-9)
    strain = 1e-7 * np.array([[1.0, 0.4, 0.0], [0.4, -0.3, 0.2], [0.0, 0.2, 0.5]])
    trace = np.trace(strain)
    hooke = C.bulk * trace * np.eye(3) + 2.0 * C.shear * (strain - trace / 3.0 * np.eye(3))
    assert first_piola(np.eye(3) + strain, np.array(1.0), pressure, C) == pytest.approx(hooke, rel=1e-5, abs=1e-12)
