"""FGMRES: exact cases, restarts, varying preconditioners, and honesty about what did not converge."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp

from actuator.linear import gmres, make_solver

N = 200


def identity(r: np.ndarray) -> np.ndarray:
    return r.copy()


@pytest.fixture
def system() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return 4.0 * np.eye(N) + rng.standard_normal((N, N)) / np.sqrt(N), rng.standard_normal(N)


def times(A: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    return lambda x: A @ x


@pytest.mark.parametrize("restart", [5, 50])
def test_reaches_the_true_tolerance(system: tuple[np.ndarray, np.ndarray], restart: int) -> None:
    A, b = system
    result = gmres(times(A), b, precondition=identity, tolerance=1e-12, restart=restart)
    assert result.converged
    assert np.linalg.norm(A @ result.x - b) <= 1.01e-12 * np.linalg.norm(b)
    np.testing.assert_allclose(result.x, np.linalg.solve(A, b), rtol=1e-9)


def test_exact_preconditioner_needs_one_iteration(system: tuple[np.ndarray, np.ndarray]) -> None:
    A, b = system
    inverse = np.linalg.inv(A)
    result = gmres(times(A), b, precondition=times(inverse), tolerance=1e-12)
    assert result.converged
    assert result.iterations == 1


def test_ends_after_as_many_iterations_as_there_are_distinct_eigenvalues() -> None:
    eigenvalues = np.repeat([1.0, 2.0, 5.0, -3.0], 25)
    b = np.random.default_rng(1).standard_normal(100)
    result = gmres(lambda x: eigenvalues * x, b, precondition=identity, tolerance=1e-12)
    assert result.converged
    assert result.iterations == 4


def test_history_starts_at_one_never_grows_and_ends_at_the_true_residual(
    system: tuple[np.ndarray, np.ndarray],
) -> None:
    A, b = system
    result = gmres(times(A), b, precondition=identity, tolerance=1e-10)
    assert result.history[0] == 1.0
    assert len(result.history) == result.iterations + 1
    assert np.all(np.diff(result.history) <= 1e-14)
    true = np.linalg.norm(b - A @ result.x) / np.linalg.norm(b)
    assert result.history[-1] == result.relative_residual == pytest.approx(true, rel=1e-6)


def test_good_guess_costs_nothing_and_a_near_one_little(system: tuple[np.ndarray, np.ndarray]) -> None:
    A, b = system
    exact = np.linalg.solve(A, b)
    guess = exact.copy()
    assert gmres(times(A), b, precondition=identity, tolerance=1e-10, x0=guess).iterations == 0
    near = gmres(times(A), b, precondition=identity, tolerance=1e-10, x0=exact * (1.0 + 1e-6))
    far = gmres(times(A), b, precondition=identity, tolerance=1e-10)
    assert near.converged
    assert near.iterations < far.iterations
    np.testing.assert_array_equal(guess, exact)


def test_zero_right_hand_side_gives_zero(system: tuple[np.ndarray, np.ndarray]) -> None:
    A, _ = system
    result = gmres(times(A), np.zeros(N), precondition=identity, tolerance=1e-10, x0=np.ones(N))
    assert result.converged
    np.testing.assert_array_equal(result.x, 0.0)


def test_too_few_iterations_are_reported(system: tuple[np.ndarray, np.ndarray]) -> None:
    A, b = system
    result = gmres(times(A), b, precondition=identity, tolerance=1e-12, max_iterations=3)
    assert not result.converged
    assert result.iterations == 3
    true = np.linalg.norm(b - A @ result.x) / np.linalg.norm(b)
    assert result.relative_residual == pytest.approx(true, rel=1e-12)
    assert 1e-12 < result.relative_residual < 1.0


def test_unreachable_tolerance_ends_and_is_reported(system: tuple[np.ndarray, np.ndarray]) -> None:
    A, b = system
    result = gmres(times(A), b, precondition=identity, tolerance=1e-18, max_iterations=10_000)
    assert not result.converged
    assert result.iterations < 500
    assert result.relative_residual < 1e-13


def test_singular_operator_gives_the_least_residual() -> None:
    """diag(1..1, 0..0) x = 1: only the first half can be met, so the residual is 1/√2 of the right-hand side."""
    diagonal = np.repeat([1.0, 0.0], 5)
    result = gmres(lambda x: diagonal * x, np.ones(10), precondition=identity, tolerance=1e-10)
    assert not result.converged
    assert result.relative_residual == pytest.approx(np.sqrt(0.5), rel=1e-12)


def test_inconsistent_operator_that_returns_zero() -> None:
    result = gmres(np.zeros_like, np.ones(10), precondition=identity, tolerance=1e-10)
    assert not result.converged
    assert result.relative_residual == 1.0


def test_operator_that_is_not_finite_is_reported() -> None:
    result = gmres(lambda x: x * np.nan, np.ones(10), precondition=identity, tolerance=1e-10)
    assert not result.converged
    assert np.isfinite(result.x).all()


def test_preconditioner_may_change_between_calls(system: tuple[np.ndarray, np.ndarray]) -> None:
    A, b = system
    calls = 0

    def varying(r: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        return r / np.diag(A) if calls % 2 else (0.5 * r).astype(np.float32).astype(float)

    result = gmres(times(A), b, precondition=varying, tolerance=1e-12)
    assert result.converged
    assert calls == result.iterations
    assert np.linalg.norm(A @ result.x - b) <= 1.01e-12 * np.linalg.norm(b)


def test_single_precision_factors_precondition_a_changed_matrix_to_full_accuracy() -> None:
    """The use in the program: float32 factors of an earlier state, and a material contrast of 1e6."""
    side = 12
    rng = np.random.default_rng(2)
    step = sp.diags_array([-np.ones(side), np.ones(side)], offsets=[0, -1], shape=(side + 1, side))
    eye = sp.eye_array(side)
    gradient = sp.vstack(
        [
            sp.kron(sp.kron(step, eye), eye),
            sp.kron(sp.kron(eye, step), eye),
            sp.kron(sp.kron(eye, eye), step),
        ]
    ).tocsr()
    stiffness = np.where(rng.random(gradient.shape[0]) < 0.3, 1e-6, 1.0)

    def conductance(k: np.ndarray) -> sp.csr_array:
        return sp.csr_array(gradient.T @ sp.diags_array(k) @ gradient)

    old, new = conductance(stiffness), conductance(stiffness * (1.0 + 0.5 * rng.random(len(stiffness))))
    upper = sp.csr_array(sp.triu(old))
    upper.sort_indices()
    solver = make_solver(upper.indptr, upper.indices, symmetric=True, precision="single")
    solver.factorise(upper.data)
    b = rng.standard_normal(side**3)
    result = gmres(lambda x: new @ x, b, precondition=lambda r: solver.solve(r, check=None), tolerance=1e-11)
    assert result.converged
    assert result.iterations <= 25
    assert np.linalg.norm(new @ result.x - b) <= 1.01e-11 * np.linalg.norm(b)


def test_tells_rounding_from_a_hard_system(system: tuple[np.ndarray, np.ndarray]) -> None:
    """Rows that differ by ten digits leave ten digits less in the residual of the small ones' right-hand side."""
    A, b = system
    rows = np.where(np.arange(N) < N // 2, 1e10, 1.0)
    b = np.where(rows > 1.0, 0.0, b)
    rough = rows[:, None] * A
    inverse = np.linalg.inv(rough)
    ended = gmres(times(rough), b, precondition=times(inverse), tolerance=1e-15)
    assert ended.stagnated
    assert not ended.converged
    assert ended.relative_residual < 1e-3
    short = gmres(times(A), b, precondition=identity, tolerance=1e-12, max_iterations=3)
    assert not short.stagnated
    assert not short.converged
