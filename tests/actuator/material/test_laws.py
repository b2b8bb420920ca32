"""The hyperelastic laws at a point: energy, stress and tangent against each other and against closed forms."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from physics import STRETCH, Floats, parameters, random_rotation
from scipy.optimize import brentq

from actuator.material import pointwise
from actuator.material.constants import constants_of
from actuator.material.elasticity import energy_density, kirchhoff_stress
from actuator.material.homogeneous import principal_stresses, stability, uniaxial_stress
from actuator.material.laws.mooney_rivlin import MooneyRivlin
from actuator.material.laws.neo_hooke import NeoHooke
from actuator.material.laws.ogden import Ogden
from actuator.material.laws.yeoh import Yeoh
from actuator.material.spectral import eigen, power_difference, power_second_difference
from actuator.parameters import Law

LAWS: dict[str, Law] = {
    "neo-hooke": NeoHooke(),
    "mooney-rivlin": MooneyRivlin(0.13),
    "yeoh": Yeoh(-0.02, 0.004),
    "ogden": Ogden.of([0.7, 0.2, 0.1], [1.3, 5.0, -2.0]),
}
law_by_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())

#: Deformations with three, two and one different stretches, and with stretches that differ by rounding or little more.
DEFORMATIONS = {
    "general": STRETCH,
    "rest": np.eye(3),
    "two equal": random_rotation(1) @ np.diag([1.5, 0.8, 0.8]),
    "two almost equal": random_rotation(2) @ np.diag([1.5, 0.8, 0.8 + 1e-15]) @ random_rotation(5),
    "two close": random_rotation(2) @ np.diag([1.5, 0.8, 0.8 + 1e-8]) @ random_rotation(5),
    "three close": random_rotation(3) @ np.diag([1.01, 0.999, 1.0]) @ random_rotation(4),
    "strong": random_rotation(3) @ np.diag([3.0, 0.4, 1.1]),
}
everywhere = pytest.mark.parametrize("F", DEFORMATIONS.values(), ids=DEFORMATIONS.keys())

SYMMETRIC = np.random.default_rng(7).normal(size=(4, 3, 3))
SYMMETRIC = SYMMETRIC + SYMMETRIC.transpose(0, 2, 1)
STEP, TINY = 1e-5, 1e-40


def isochoric(F: Floats) -> Floats:
    return np.linalg.det(F) ** (-2.0 / 3.0) * F @ F.T


def stress(law: Law, b: Floats) -> Floats:
    S = np.empty_like(b)
    pointwise.stress(law, b, S)
    return S


def tangent(law: Law, b: Floats, X: Floats) -> Floats:
    dS = np.empty_like(X)
    pointwise.tangent(law, b, X, dS)
    return dS


@law_by_law
@everywhere
def test_stress_is_the_derivative_of_the_energy(law: Law, F: Floats) -> None:
    b = isochoric(F)
    slope = np.linalg.solve(b, stress(law, b)) / 2.0  # ∂w/∂b̄
    for X in SYMMETRIC:
        central = (pointwise.energy(law, b + STEP * X) - pointwise.energy(law, b - STEP * X)) / (2.0 * STEP)
        assert np.sum(slope * X) == pytest.approx(central, rel=1e-6, abs=1e-7)
        assert pointwise.energy(law, b + 1j * TINY * X).imag / TINY == pytest.approx(np.sum(slope * X), abs=1e-12)
    assert pointwise.energy(law, np.eye(3)) == pytest.approx(0.0, abs=1e-15)


@law_by_law
@everywhere
def test_tangent_is_the_derivative_of_the_stress(law: Law, F: Floats) -> None:
    b = isochoric(F)
    size = np.abs(stress(law, b)).max()
    for X, dS in zip(SYMMETRIC, tangent(law, b, SYMMETRIC), strict=True):
        exact = stress(law, b + 1j * TINY * X)
        assert exact.real == pytest.approx(stress(law, b), rel=1e-14, abs=1e-14)
        assert dS == pytest.approx(exact.imag / TINY, rel=1e-12, abs=1e-12 * size)
        central = (stress(law, b + STEP * X) - stress(law, b - STEP * X)) / (2.0 * STEP)
        assert dS == pytest.approx(central, rel=1e-6, abs=1e-6 * size)


@law_by_law
@everywhere
def test_complex_tangent_has_the_second_derivative(law: Law, F: Floats) -> None:
    """The Hessian products differentiate the tangent itself: along b̄ and along its direction."""
    b, X, Y, Z = isochoric(F), SYMMETRIC[:2], SYMMETRIC[2:], SYMMETRIC[3]
    found = tangent(law, b + 1j * TINY * Z, X + 1j * TINY * Y)
    central = (tangent(law, b + STEP * Z, X + STEP * Y) - tangent(law, b - STEP * Z, X - STEP * Y)) / (2.0 * STEP)
    assert found.real == pytest.approx(tangent(law, b, X), rel=1e-13, abs=1e-13)
    assert found.imag / TINY == pytest.approx(central, rel=1e-6, abs=2e-6 * np.abs(central).max())


@law_by_law
def test_tangent_is_symmetric(law: Law) -> None:
    """∂w/∂b̄ has a symmetric derivative: X : d(b̄⁻¹ S)[Y] = Y : d(b̄⁻¹ S)[X]."""
    b = isochoric(STRETCH)
    inverse, S = np.linalg.inv(b), stress(law, b)
    slopes = [
        inverse @ dS - inverse @ X @ inverse @ S for X, dS in zip(SYMMETRIC, tangent(law, b, SYMMETRIC), strict=True)
    ]
    products = np.einsum("aij,bij->ab", SYMMETRIC, np.array(slopes))
    assert products == pytest.approx(products.T, rel=1e-11)


@law_by_law
def test_laws_are_objective_and_isotropic(law: Law) -> None:
    Q = random_rotation(11)
    b, turned = isochoric(STRETCH), isochoric(Q @ STRETCH)
    assert pointwise.energy(law, turned) == pytest.approx(pointwise.energy(law, b), rel=1e-12)
    assert pointwise.energy(law, isochoric(STRETCH @ Q)) == pytest.approx(pointwise.energy(law, b), rel=1e-12)
    assert stress(law, turned) == pytest.approx(Q @ stress(law, b) @ Q.T, rel=1e-12, abs=1e-13)
    X = Q @ SYMMETRIC @ Q.T
    assert tangent(law, turned, X) == pytest.approx(Q @ tangent(law, b, SYMMETRIC) @ Q.T, rel=1e-11, abs=1e-12)


@law_by_law
def test_initial_shear_modulus_is_g(law: Law) -> None:
    deviator = SYMMETRIC - np.einsum("aii->a", SYMMETRIC)[:, None, None] * np.eye(3) / 3.0
    assert tangent(law, np.eye(3), deviator) == pytest.approx(deviator, rel=1e-13, abs=1e-13)
    assert stability(law, "uniaxial tension", np.ones(1))[0] == pytest.approx(2.0, rel=1e-12)


@pytest.mark.parametrize(
    "law", [MooneyRivlin(0.0), Yeoh(0.0, 0.0), Ogden.of([1.0], [2.0]), Ogden.of([0.4, 0.6], [2, 2])]
)
@everywhere
def test_laws_reduce_to_neo_hooke(law: Law, F: Floats) -> None:
    b = isochoric(F)
    assert pointwise.energy(law, b) == pytest.approx(pointwise.energy(NeoHooke(), b), rel=1e-13, abs=1e-15)
    assert stress(law, b) == pytest.approx(b, rel=1e-13, abs=1e-14)
    assert tangent(law, b, SYMMETRIC) == pytest.approx(SYMMETRIC, rel=1e-12, abs=1e-13)


def test_ogden_with_exponents_of_two_and_minus_two_is_mooney_rivlin() -> None:
    """λ̄^-2 adds up to Ī2: another way through the eigenvalues to a closed form."""
    b = isochoric(STRETCH)
    ogden, closed = Ogden.of([0.74, 0.26], [2.0, -2.0]), MooneyRivlin(0.13)
    assert pointwise.energy(ogden, b) == pytest.approx(pointwise.energy(closed, b), rel=1e-12)
    difference = stress(ogden, b) - stress(closed, b)
    assert difference == pytest.approx(difference[0, 0] * np.eye(3), abs=1e-12)  # a pressure, which dev takes off


CLOSED_FORMS = {
    "neo-hooke": lambda x: x - x**-2,
    "mooney-rivlin": lambda x: 2.0 * (0.37 + 0.13 / x) * (x - x**-2),
    "yeoh": lambda x: 2.0 * (x - x**-2) * (0.5 - 0.04 * (x**2 + 2 / x - 3) + 0.012 * (x**2 + 2 / x - 3) ** 2),
    "ogden": lambda x: sum(
        2.0 * mu / a * (x ** (a - 1.0) - x ** (-a / 2.0 - 1.0)) for mu, a in ((0.7, 1.3), (0.2, 5.0), (0.1, -2.0))
    ),
}


@pytest.mark.parametrize("name", LAWS)
def test_uniaxial_stress_has_the_closed_form(name: str) -> None:
    stretch = np.array([0.4, 0.9, 1.0, 1.05, 1.7, 4.0])
    assert uniaxial_stress(LAWS[name], stretch) == pytest.approx(CLOSED_FORMS[name](stretch), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("stretch", [0.8, 1.3, 2.0])
def test_nearly_incompressible_bar_has_the_closed_form(name: str, stretch: float) -> None:
    """The whole law with its volumetric part: sides contract until they are free of stress."""
    material, load, objective = parameters(material={"poisson_ratio": 0.499999})
    c = constants_of(dataclasses.replace(material, law=LAWS[name]), load, objective)

    def kirchhoff(lateral: float) -> Floats:
        F = np.diag([stretch, lateral, lateral])
        b, J = F @ F.T, np.linalg.det(F)
        kirchhoff_stress(c, 1.0, c.bulk * np.log(J), np.log(J), np.trace(b), b)
        return b

    lateral = brentq(lambda x: kirchhoff(x)[1, 1], 0.9 * stretch**-0.5, 1.1 * stretch**-0.5, xtol=1e-15)
    closed = c.shear * CLOSED_FORMS[name](stretch)
    assert kirchhoff(lateral)[0, 0] / stretch == pytest.approx(closed, rel=2e-5)


@pytest.mark.parametrize("name", LAWS)
def test_kirchhoff_stress_is_the_derivative_of_the_whole_energy(name: str) -> None:
    material, load, objective = parameters()
    c = constants_of(dataclasses.replace(material, law=LAWS[name]), load, objective)
    assert c.law is type(LAWS[name])

    def energy(F: Floats) -> float:
        b, J = F @ F.T, np.linalg.det(F)
        return energy_density(c, np.log(J), J ** (-2.0 / 3.0), np.trace(b), b)

    b, J = STRETCH @ STRETCH.T, np.linalg.det(STRETCH)
    kirchhoff_stress(c, 1.0, c.bulk * np.log(J), np.log(J), np.trace(b), b)
    first_piola = b @ np.linalg.inv(STRETCH).T
    for i, j in np.ndindex(3, 3):
        h = STEP * np.outer(np.eye(3)[i], np.eye(3)[j])
        central = (energy(STRETCH + h) - energy(STRETCH - h)) / (2.0 * STEP)
        assert first_piola[i, j] == pytest.approx(central, rel=1e-7, abs=1e-7 * c.bulk)


def test_principal_stresses_differentiate_themselves() -> None:
    stretches, strain = np.array([[1.7, 0.8, 1.0 / 1.36]]), 1e-6
    for law in LAWS.values():
        _, D = principal_stresses(law, stretches)
        for j in range(3):
            ahead, behind = (stretches * np.exp(sign * strain * np.eye(3)[j]) for sign in (1.0, -1.0))
            central = (principal_stresses(law, ahead)[0] - principal_stresses(law, behind)[0]) / (2.0 * strain)
            assert D[0, :, j] == pytest.approx(central[0], rel=1e-7, abs=1e-8)


def test_lost_stability_is_found() -> None:
    """A Yeoh law that softens too much: its energy has its inflection where the smallest eigenvalue changes sign."""
    soft = Yeoh(-0.1, 0.0)
    stretch = np.linspace(1.0, 2.5, 301)
    found = stability(soft, "uniaxial tension", stretch)
    assert found[0] > 0.0
    assert found[-1] < 0.0
    assert (stability(LAWS["ogden"], "uniaxial tension", stretch) > 0.0).all()


# ------------------------------------------------------------------------------------------------- eigenvalues


@everywhere
def test_eigenvalues_and_vectors_rebuild_the_matrix(F: Floats) -> None:
    b, values, vectors = isochoric(F), np.empty(3), np.empty((3, 3))
    eigen(b.copy(), values, vectors)
    assert np.sort(values) == pytest.approx(np.linalg.eigvalsh(b), rel=1e-14)
    assert vectors @ np.diag(values) @ vectors.T == pytest.approx(b, rel=1e-14, abs=1e-15)
    assert vectors.T @ vectors == pytest.approx(np.eye(3), abs=1e-15)


@pytest.mark.parametrize("s", [-2.5, -0.7, 0.5, 0.65, 1.0, 2.5, 5.0])
@pytest.mark.parametrize("spread", [0.0, 1e-16, 1e-9, 1e-4, 0.03, 0.0999, 0.1001, 0.5])
def test_divided_differences_have_full_precision(s: float, spread: float) -> None:
    """Against f[a, b, c] = ∫ f'' over the simplex (Hermite & Genocchi), by Gauss's rule."""
    nodes, weights = np.polynomial.legendre.leggauss(20)
    t, w = 0.5 * (nodes + 1.0), 0.5 * weights
    a, b, c = 1.3, 1.3 * (1.0 + spread), 1.3 * (1.0 - 0.6 * spread)
    first = np.sum(w * s * (a + (b - a) * t) ** (s - 1.0))
    assert power_difference(a, b, s) == pytest.approx(first, rel=5e-14)
    x, y = t[:, None], t[None, :] * t[:, None]
    second = np.sum(w[:, None] * w[None, :] * x * s * (s - 1.0) * (a + (b - a) * x + (c - b) * y) ** (s - 2.0))
    for p, q, r in ((a, b, c), (c, a, b), (b, c, a)):
        assert power_second_difference(p, q, r, s) == pytest.approx(second, rel=1e-12, abs=1e-15)
