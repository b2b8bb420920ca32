"""Compiled element loops: what they share, and the residual.

Symbols are the paper's. With n_a = F⁻ᵀ ∇N_a, the Kirchhoff stress τ = (K ln J - J p) I + G dev S(b̄) does the work
τ : (∇δu F⁻¹) of Eq. (6), and w = F⁻ᵀ ∇p carries the flow of Eq. (5). By default the matrices of source and drainage are
summed by rows, and k is fitted to that (:func:`actuator.material.ersatz.log_fitted_permeability`).
:mod:`actuator.material.elasticity` has the law.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.material.elasticity import kirchhoff_stress
from actuator.material.ersatz import (
    FAST,
    drainage,
    inverse,
    left_cauchy_green,
    log_fitted_permeability,
    permeability,
    push,
    stiffness,
)


@njit(cache=True)
def ordered_sum(values):
    """Sum in the order of the array; within a parallel function, ``values.sum()`` depends on the thread count."""
    total = 0.0
    for value in values:
        total += value
    return total


@njit(cache=True, inline="always")
def deformation_gradient(u, nodes, gradient, F):
    """F = I + Σ u_a ⊗ ∇N_a."""
    for i in range(3):
        for j in range(3):
            F[i, j] = 1.0 if i == j else 0.0
    for a in range(20):
        n = nodes[a]
        for i in range(3):
            for j in range(3):
                F[i, j] += u[n, i] * gradient[a, j]


@njit(cache=True, inline="always")
def interpolate(field, vertices, shape):
    """Value of a vertex field at a quadrature point."""
    value = field[vertices[0]] * shape[0]
    for a in range(1, 8):
        value += field[vertices[a]] * shape[a]
    return value


@njit(cache=True, inline="always")
def vertex_gradient(field, vertices, gradient, out):
    """Write the material gradient of a vertex field."""
    for i in range(3):
        out[i] = field[vertices[0]] * gradient[0, i]
        for a in range(1, 8):
            out[i] += field[vertices[a]] * gradient[a, i]


@njit(cache=True, inline="always")
def penalty_forces(c, hessian, nodes, u, out):
    """Write what c_r adds to the forces of a cell, (20, 3), N."""
    out[:] = 0.0
    if c.hessian_penalty != 0.0:
        for a in range(20):
            for i in range(3):
                value = 0.0 * u[0, 0]
                for d in range(20):
                    value += hessian[a, d] * u[nodes[d], i]
                out[a, i] = c.hessian_penalty * value


@njit(cache=True)
def cell_permeability(geometry, c, chi, e, slope):
    """k of a cell, mm⁴/(N s): the fitted one's geometric mean. Writes its logarithm's derivatives to χ, (8,).

    Where k is not fitted it is left to :func:`actuator.material.ersatz.permeability` at the points, and this returns 0.

    k falls by decades within a cell. Its arithmetic mean is that of the most open corner; the geometric mean lies
    between flow along layers of unlike permeability and flow across them.
    """
    s, vertices = geometry.cell_class[e], geometry.cells[e]
    volume, mean = 0.0, 0.0 * chi[0]
    for a in range(8):
        slope[a] = mean
    if not geometry.fitted:
        return mean
    for q in range(geometry.shape.shape[0]):
        dx = geometry.volume[s, q]
        x = interpolate(chi, vertices, geometry.shape[q])
        log_k, d_log_k = log_fitted_permeability(x, c, geometry.size_squared[s])
        volume += dx
        mean += dx * log_k
        for a in range(8):
            slope[a] += dx * d_log_k * geometry.shape[q, a]
    for a in range(8):
        slope[a] /= volume
    return np.exp(mean / volume)


@njit(cache=True, parallel=True, fastmath=FAST)
def residual(geometry, source, c, chi, u, p, stressed, Ru, Rp):
    """Element residuals of Eqs. (5) and (6), without tractions on Γ.

    Args:
        geometry: :class:`actuator.equations.discretisation.Geometry`.
        source: Q_in at the quadrature points, (n_classes, n_q), mm²/(N s).
        c: :class:`actuator.material.constants.Constants`.
        chi, u, p: fields, (n_vertices,), (n_nodes, 3) mm, (n_vertices,) N/mm²; real or complex, all of one type.
        stressed: whether Ru is wanted; only Rp is computed otherwise.
        Ru, Rp: results, (n_cells, 20, 3) in N and (n_cells, 8) in mm³/s.

    Returns:
        Smallest det F over all quadrature points (real part).
    """
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    lowest = np.empty(n_cells)
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        vertices, nodes = geometry.cells[e], geometry.node_cells[e]
        F, Finv = np.empty((3, 3), u.dtype), np.empty((3, 3), u.dtype)
        b, P = np.empty((3, 3), u.dtype), np.empty((3, 3), u.dtype)
        g, w, flux = np.empty(3, u.dtype), np.empty(3, u.dtype), np.empty(3, u.dtype)
        k = cell_permeability(geometry, c, chi, e, np.empty(8, chi.dtype))
        if stressed:
            penalty_forces(c, geometry.hessian[s], nodes, u, Ru[e])
        for a in range(8):
            Rp[e, a] = 0.0
        lowest[e] = np.inf
        for q in range(n_q):
            dx = geometry.volume[s, q]
            deformation_gradient(u, nodes, geometry.gradient20[s, q], F)
            J = inverse(F, Finv)
            lowest[e] = min(lowest[e], J.real)
            if J.real <= 0.0:
                continue
            x = interpolate(chi, vertices, geometry.shape[q])
            pressure = interpolate(p, vertices, geometry.shape[q])
            if stressed:
                trace = left_cauchy_green(F, b)
                factor = stiffness(x, c)[0]
                log_J = np.log(J)
                kirchhoff_stress(c, factor, factor * c.bulk * log_J - J * pressure, log_J, trace, b)
                for i in range(3):
                    for j in range(3):
                        P[i, j] = dx * (b[i, 0] * Finv[j, 0] + b[i, 1] * Finv[j, 1] + b[i, 2] * Finv[j, 2])
                for a in range(20):
                    grad = geometry.gradient20[s, q, a]
                    for i in range(3):
                        Ru[e, a, i] += P[i, 0] * grad[0] + P[i, 1] * grad[1] + P[i, 2] * grad[2]
            vertex_gradient(p, vertices, geometry.gradient[s, q], g)
            push(Finv, g, w)
            if not geometry.fitted:
                k = permeability(x, c)[0]
            kJ = k * J * dx
            for i in range(3):
                flux[i] = kJ * (Finv[i, 0] * w[0] + Finv[i, 1] * w[1] + Finv[i, 2] * w[2])
            out = drainage(x, c)[0]
            for a in range(8):
                grad = geometry.gradient[s, q, a]
                drained = p[vertices[a]] if geometry.summed else pressure
                sink = dx * (source[s, q] * (drained - c.pressure) + out * drained)
                Rp[e, a] += flux[0] * grad[0] + flux[1] * grad[1] + flux[2] * grad[2] + sink * geometry.shape[q, a]
    return lowest.min()
