"""The metric of design steps, and the model of curvature that the optimiser builds in it."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from physics import Floats, half_cylinder

from actuator.discretisation import Discretisation
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.metric import Metric
from actuator.tangent import darcy_gather

DIFFUSIVITY_LENGTH = 15.0


@pytest.fixture(scope="module")
def metric() -> Metric:
    discretisation = Discretisation(half_cylinder(1, 1, 1))
    return Metric(discretisation, DIFFUSIVITY_LENGTH, darcy_gather(discretisation), threads=1)


def symmetric(size: int, seed: int) -> Floats:
    """A random symmetric matrix, indefinite."""
    a = np.random.default_rng(seed).normal(size=(size, size))
    return 0.5 * (a + a.T)


def dense(model: Curvature, size: int) -> Floats:
    return np.stack([model @ unit for unit in np.eye(size)], axis=1)


def powell(pairs: list[tuple[Floats, Floats]], M: Floats) -> Floats:
    """Powell's symmetric update in the metric M, dense and one pair after the other (Powell 1970)."""
    B = np.zeros_like(M)
    for d, y in pairs:
        r, w, s = y - B @ d, M @ d, d @ M @ d
        B = B + (np.outer(r, w) + np.outer(w, r)) / s - (r @ d) / s**2 * np.outer(w, w)
    return B


# -------------------------------------------------------------------------------------------------- metric


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


# ----------------------------------------------------------------------------------------------- curvature


def taught(metric: Metric, pairs: int, memory: int, seed: int) -> tuple[Curvature, list[tuple[Floats, Floats]]]:
    """A model after random directions, and the pairs (d, H d) of an indefinite Hessian."""
    H = symmetric(metric.size, seed)
    known = [(d, H @ d) for d in np.random.default_rng(seed).normal(size=(pairs, metric.size))]
    curvature = Curvature(metric, memory)
    for d, y in known:
        curvature.learn(d, y)
    return curvature, known


@pytest.mark.parametrize(("pairs", "memory"), [(1, 20), (2, 20), (8, 20), (22, 30), (9, 4)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_model_is_powells_update_of_the_latest_pairs(metric: Metric, pairs: int, memory: int, seed: int) -> None:
    curvature, known = taught(metric, pairs, memory, seed)
    expected = powell(known[-memory:], metric.matrix.toarray())
    model = dense(curvature, metric.size)
    assert np.abs(model - expected).max() < 1e-9 * np.abs(expected).max()
    assert np.abs(model - model.T).max() < 1e-10 * np.abs(model).max()


@pytest.mark.parametrize(("pairs", "memory"), [(1, 20), (8, 20), (22, 30), (9, 4)])
def test_newest_pair_is_reproduced(metric: Metric, pairs: int, memory: int) -> None:
    curvature, known = taught(metric, pairs, memory, 4)
    d, y = known[-1]
    assert np.abs(curvature @ d - y).max() < 1e-9 * np.abs(y).max()


def test_each_pair_is_the_smallest_symmetric_change_in_the_metric(metric: Metric) -> None:
    """Among symmetric changes that meet the pair, Powell's has the smallest norm ‖M^(-1/2) Δ M^(-1/2)‖."""
    n = metric.size
    curvature, _ = taught(metric, 2, 20, 5)
    before, d = dense(curvature, n), np.random.default_rng(9).normal(size=n)
    curvature.learn(d, symmetric(n, 6) @ d)
    change = dense(curvature, n) - before
    root = scipy.linalg.inv(scipy.linalg.sqrtm(metric.matrix.toarray()))
    smallest = np.linalg.norm(root @ change @ root)
    rng, beside = np.random.default_rng(10), np.eye(n) - np.outer(d, d) / (d @ d)
    for _ in range(20):
        a = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-2.0, 2.0)
        other = change + beside @ (a + a.T) @ beside  # symmetric, and the same product with d
        assert np.linalg.norm(root @ other @ root) > smallest


def test_a_hessian_is_known_once_it_has_been_seen_from_all_sides(metric: Metric) -> None:
    """Along M-orthogonal directions every pair stays in force, so that all of them make up the Hessian."""
    n = metric.size
    H = symmetric(n, 4)
    _, directions = scipy.linalg.eigh(symmetric(n, 5), metric.matrix.toarray())
    curvature = Curvature(metric, n)
    for d in directions.T:
        curvature.learn(d, H @ d)
    assert np.abs(dense(curvature, n) - H).max() < 1e-9 * np.abs(H).max()


def test_curvature_knows_nothing_at_first_and_learns_nothing_from_no_step(metric: Metric) -> None:
    curvature = Curvature(metric)
    curvature.learn(np.zeros(metric.size), np.ones(metric.size))
    assert np.array_equal(curvature @ np.ones(metric.size), np.zeros(metric.size))


@pytest.mark.parametrize("pairs", [0, 3, 9])
def test_arrays_restore_the_model(metric: Metric, pairs: int) -> None:
    model, _ = taught(metric, pairs, 5, 7)
    copy = Curvature(metric, 5)
    copy.restore(model.arrays())
    assert np.array_equal(dense(copy, metric.size), dense(model, metric.size))
    # The copy is its own, and learns the same from the same.
    before, d = dense(model, metric.size), np.ones(metric.size)
    copy.learn(d, 2.0 * d)
    assert np.array_equal(dense(model, metric.size), before)
    model.learn(d, 2.0 * d)
    assert np.array_equal(dense(copy, metric.size), dense(model, metric.size))
