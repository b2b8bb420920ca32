"""The limited-memory model of the physics' curvature: secant equation, positive definiteness, memory."""

from __future__ import annotations

import numpy as np
import pytest
from physics import Floats
from small_case import metric_of, small_objective

from actuator.optimiser.controls import CONTROLS
from actuator.optimiser.curvature import Curvature
from actuator.terms.step import Metric

SCALE = 1e-3
MEMORY = CONTROLS.curvature_memory
#: Pairs that there may be before the oldest go.
MOST = MEMORY * 4 // 3


@pytest.fixture(scope="module")
def metric() -> Metric:
    return metric_of(small_objective())


@pytest.fixture
def curvature(metric: Metric) -> Curvature:
    return Curvature(metric, SCALE)


def hessian(size: int, *, negative: int = 0) -> Floats:
    """A symmetric matrix with eigenvalues over three decades, some of them negative."""
    rng = np.random.default_rng(3)
    axes = np.linalg.qr(rng.standard_normal((size, size)))[0]
    values = np.geomspace(1.0, 1e3, size)
    values[:negative] *= -1.0
    return np.asarray(axes * values @ axes.T)


def test_nothing_learnt_is_the_scaled_norm(curvature: Curvature, metric: Metric) -> None:
    v = np.arange(float(metric.size))
    np.testing.assert_allclose(curvature @ v, SCALE * (metric @ v))
    assert curvature.columns.shape == (metric.size, 0)


def test_another_diagonal_keeps_the_pairs(curvature: Curvature, metric: Metric) -> None:
    rng, matrix = np.random.default_rng(6), hessian(metric.size)
    s, v = rng.standard_normal((2, metric.size))
    curvature.learn(s, matrix @ s)
    diagonal = np.abs(rng.standard_normal(metric.size))
    curvature.rebase(diagonal)
    assert curvature.pairs.shape == (2, 1, metric.size)
    np.testing.assert_allclose(curvature @ s, matrix @ s, rtol=1e-9, atol=1e-9 * np.abs(matrix @ s).max())
    curvature.restore(np.empty((2, 0, metric.size)))
    np.testing.assert_allclose(curvature @ v, SCALE * (metric @ v) + diagonal * v)


def test_last_product_is_reproduced(curvature: Curvature, metric: Metric) -> None:
    rng, matrix = np.random.default_rng(0), hessian(metric.size)
    for _ in range(10):
        s = rng.standard_normal(metric.size)
        curvature.learn(s, matrix @ s)
        np.testing.assert_allclose(curvature @ s, matrix @ s, rtol=1e-9, atol=1e-9 * np.abs(matrix @ s).max())


def test_conjugate_directions_are_all_remembered(curvature: Curvature, metric: Metric) -> None:
    """BFGS keeps the products of directions that are conjugate to later ones."""
    matrix = hessian(metric.size)
    directions = np.linalg.eigh(matrix)[1][:, :8].T
    for s in directions:
        curvature.learn(s, matrix @ s)
    for s in directions:
        np.testing.assert_allclose(s @ (curvature @ s), s @ matrix @ s, rtol=1e-9)


def test_low_rank_part_is_what_the_product_uses(curvature: Curvature, metric: Metric) -> None:
    rng, matrix = np.random.default_rng(1), hessian(metric.size)
    for _ in range(5):
        s = rng.standard_normal(metric.size)
        curvature.learn(s, matrix @ s)
    v = rng.standard_normal(metric.size)
    whole = SCALE * metric.matrix.toarray() + curvature.columns * curvature.signs @ curvature.columns.T
    np.testing.assert_allclose(curvature @ v, whole @ v, rtol=1e-9, atol=1e-9 * np.abs(whole @ v).max())


def test_negative_curvature_leaves_it_positive_definite(curvature: Curvature, metric: Metric) -> None:
    rng, matrix = np.random.default_rng(2), hessian(metric.size, negative=metric.size // 2)
    for _ in range(20):
        s = rng.standard_normal(metric.size)
        curvature.learn(s, matrix @ s)
    whole = SCALE * metric.matrix.toarray() + curvature.columns * curvature.signs @ curvature.columns.T
    assert np.linalg.eigvalsh(whole)[0] > 0.0


def test_oldest_pairs_go_and_the_rest_counts(curvature: Curvature, metric: Metric) -> None:
    rng, matrix = np.random.default_rng(4), hessian(metric.size)
    directions = rng.standard_normal((MOST + 1, metric.size))
    for s in directions:
        curvature.learn(s, matrix @ s)
    assert curvature.pairs.shape == (2, MEMORY, metric.size)
    np.testing.assert_array_equal(curvature.pairs[0], directions[-MEMORY:])
    fresh = Curvature(metric, SCALE)
    for s in directions[-MEMORY:]:
        fresh.learn(s, matrix @ s)
    np.testing.assert_array_equal(curvature.columns, fresh.columns)


@pytest.mark.parametrize("learnt", [0, 1, MEMORY + 3, MOST + 5])
def test_restored_is_the_same_bit_by_bit(curvature: Curvature, metric: Metric, learnt: int) -> None:
    rng, matrix = np.random.default_rng(5), hessian(metric.size)
    for _ in range(learnt):
        s = rng.standard_normal(metric.size)
        curvature.learn(s, matrix @ s)
    other = Curvature(metric, SCALE)
    other.learn(np.ones(metric.size), np.ones(metric.size))
    other.restore(curvature.pairs)
    v = rng.standard_normal(metric.size)
    np.testing.assert_array_equal(other @ v, curvature @ v)
    np.testing.assert_array_equal(other.pairs, curvature.pairs)
