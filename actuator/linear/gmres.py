"""Flexible GMRES with restarts for operators and preconditioners given as functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dgemv

from actuator.arrays import Floats

Operator = Callable[[Floats], Floats]


@dataclass(frozen=True)
class KrylovResult:
    """Outcome of an iterative solve.

    Attributes:
        x: solution, (n,).
        iterations: operator applications in the iteration (not counting those for true residuals).
        relative_residual: ||b - A x|| / ||b|| of the returned x, recomputed.
        converged: whether ``relative_residual`` is within the tolerance.
        stagnated: whether the iteration ended because rounding errors let the residual fall no further.
        history: relative residual before the first and after each iteration; estimates within a cycle, true values
            at its start.
    """

    x: Floats
    iterations: int
    relative_residual: float
    converged: bool
    stagnated: bool
    history: tuple[float, ...]


def gmres(
    matvec: Operator,
    b: ArrayLike,
    *,
    precondition: Operator,
    tolerance: float,
    x0: ArrayLike | None = None,
    max_iterations: int = 100,
    restart: int = 50,
) -> KrylovResult:
    """Solve A x = b by right-preconditioned FGMRES (Saad 1993, doi:10.1137/0914028, Algorithm 2.2).

    The preconditioned vectors are kept, so the preconditioner may vary from call to call or work in single
    precision. Convergence is judged by the true residual: if the estimate was too hopeful, a new cycle starts.
    A breakdown, a stagnation of the true residual at rounding level, or values that are not finite end the
    iteration; the result then tells honestly whether it converged.

    Args:
        matvec: x -> A x, both (n,).
        b: right-hand side, (n,).
        precondition: r -> approximation of A⁻¹ r, both (n,).
        tolerance: bound on ||b - A x|| / ||b||.
        x0: initial guess, (n,); zero if None.
        max_iterations: bound on all iterations together.
        restart: iterations per cycle; two vectors are kept for each.
    """
    rhs = np.asarray(b, dtype=np.float64)
    norm_b = float(np.linalg.norm(rhs))
    if norm_b == 0.0:
        return KrylovResult(np.zeros_like(rhs), 0, 0.0, True, False, (0.0,))
    x = np.zeros_like(rhs) if x0 is None else np.array(x0, dtype=np.float64)
    residual = rhs.copy() if x0 is None else rhs - matvec(x)
    beta = float(np.linalg.norm(residual))
    history = [beta / norm_b]
    iterations, stagnated = 0, False
    while beta > tolerance * norm_b and iterations < max_iterations and np.isfinite(beta):
        steps = min(restart, max_iterations - iterations)
        correction, estimates, broke_down = _cycle(matvec, precondition, residual, beta, steps, tolerance * norm_b)
        iterations += len(estimates)
        history.extend(estimate / norm_b for estimate in estimates)
        candidate = x + correction
        new_residual = rhs - matvec(candidate)
        new_beta = float(np.linalg.norm(new_residual))
        # Below this gain a cycle only moves rounding errors.
        idle = 0.9 * beta < new_beta < np.inf
        stagnated = bool(idle and estimates and estimates[-1] < 0.1 * min(beta, new_beta))
        if not new_beta < beta:  # also when it is not a number: keep what we have
            break
        x, residual, beta = candidate, new_residual, new_beta
        history[-1] = beta / norm_b
        if broke_down or stagnated:
            break
    relative = history[-1] = beta / norm_b
    return KrylovResult(x, iterations, relative, bool(relative <= tolerance), stagnated, tuple(history))


def _cycle(
    matvec: Operator, precondition: Operator, residual: Floats, beta: float, steps: int, target: float
) -> tuple[Floats, list[float], bool]:
    """One Arnoldi cycle: the correction to x, the residual estimate after each step, and whether it broke down."""
    n = len(residual)
    basis = np.empty((n, steps + 1), order="F")
    directions = np.empty((n, steps), order="F")
    triangle = np.zeros((steps, steps))
    cosines, sines = np.zeros(steps), np.zeros(steps)
    g = np.zeros(steps + 1)
    g[0] = beta
    basis[:, 0] = residual / beta
    estimates: list[float] = []
    broke_down = False
    for j in range(steps):
        directions[:, j] = precondition(basis[:, j])
        w = np.array(matvec(directions[:, j]), dtype=np.float64)
        length = float(np.linalg.norm(w))
        h = _orthogonalise(basis[:, : j + 1], w)
        below = float(np.linalg.norm(w))
        if not np.isfinite(below):
            broke_down = True
            break
        for i in range(j):
            h[i], h[i + 1] = cosines[i] * h[i] + sines[i] * h[i + 1], cosines[i] * h[i + 1] - sines[i] * h[i]
        radius = float(np.hypot(h[j], below))
        # The new direction adds nothing: the space is invariant (solved) or the operator is singular on it.
        exhausted = below <= 1e-14 * length
        if radius <= 1e-14 * length:
            broke_down = True
            break
        cosines[j], sines[j] = h[j] / radius, below / radius
        h[j] = radius
        triangle[: j + 1, j] = h
        g[j], g[j + 1] = cosines[j] * g[j], -sines[j] * g[j]
        estimates.append(abs(float(g[j + 1])))
        if estimates[-1] <= target or exhausted:
            broke_down = exhausted and estimates[-1] > target
            break
        basis[:, j + 1] = w / below
    count = len(estimates)
    if count == 0:
        return np.zeros(n), estimates, broke_down
    y = solve_triangular(triangle[:count, :count], g[:count])
    return directions[:, :count] @ y, estimates, broke_down


def _orthogonalise(basis: Floats, w: Floats) -> Floats:
    """Make w orthogonal to the columns in place by classical Gram-Schmidt done twice; returns the coefficients."""
    h = dgemv(1.0, basis, w, trans=1)
    dgemv(-1.0, basis, h, beta=1.0, y=w, overwrite_y=1)
    again = dgemv(1.0, basis, w, trans=1)
    dgemv(-1.0, basis, again, beta=1.0, y=w, overwrite_y=1)
    return h + again
