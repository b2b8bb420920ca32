"""Compiled element loops: the residual and the derivative of the Lagrangian.

Symbols are the paper's. With n_a = F⁻ᵀ ∇N_a, the Kirchhoff stress τ = (K ln J - J p) I + G dev S(b̄) does the work
τ : (∇δu F⁻¹) of Eq. (6), and w = F⁻ᵀ ∇p carries the flow of Eq. (5). The matrices of source and drainage are summed by
rows, k is fitted to that (:func:`actuator.material.ersatz.log_fitted_permeability`);
:mod:`actuator.material.elasticity` has the law.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.material.elasticity import add_stress, contraction, energy_density, kirchhoff_stress
from actuator.material.ersatz import (
    FAST,
    drainage,
    inverse,
    left_cauchy_green,
    log_fitted_permeability,
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


@njit(cache=True)
def cell_permeability(geometry, c, chi, e, slope):
    """k of a cell, mm⁴/(N s): the fitted one's geometric mean. Writes its logarithm's derivatives to χ, (8,).

    k falls by decades within a cell. Its arithmetic mean is that of the most open corner; the geometric mean lies
    between flow along layers of unlike permeability and flow across them.
    """
    s, vertices = geometry.cell_class[e], geometry.cells[e]
    volume, mean = 0.0, 0.0 * chi[0]
    for a in range(8):
        slope[a] = mean
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
        c: :class:`actuator.material.ersatz.Coefficients`.
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
        H = geometry.hessian[s]
        k = cell_permeability(geometry, c, chi, e, np.empty(8, chi.dtype))
        if stressed:
            Ru[e] = 0.0
            if c.hessian_penalty != 0.0:
                for a in range(20):
                    for i in range(3):
                        value = 0.0 * u[0, 0]
                        for d in range(20):
                            value += H[a, d] * u[nodes[d], i]
                        Ru[e, a, i] = c.hessian_penalty * value
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
                E = stiffness(x, c)[0]
                log_J = np.log(J)
                kirchhoff_stress(c, E, E * c.bulk * log_J - J * pressure, log_J, trace, b)
                for i in range(3):
                    for j in range(3):
                        P[i, j] = dx * (b[i, 0] * Finv[j, 0] + b[i, 1] * Finv[j, 1] + b[i, 2] * Finv[j, 2])
                for a in range(20):
                    grad = geometry.gradient20[s, q, a]
                    for i in range(3):
                        Ru[e, a, i] += P[i, 0] * grad[0] + P[i, 1] * grad[1] + P[i, 2] * grad[2]
            vertex_gradient(p, vertices, geometry.gradient[s, q], g)
            push(Finv, g, w)
            kJ = k * J * dx
            for i in range(3):
                flux[i] = kJ * (Finv[i, 0] * w[0] + Finv[i, 1] * w[1] + Finv[i, 2] * w[2])
            out = drainage(x, c)[0]
            for a in range(8):
                grad = geometry.gradient[s, q, a]
                at_vertex = p[vertices[a]]
                sink = dx * (source[s, q] * (at_vertex - c.pressure) + out * at_vertex)
                Rp[e, a] += flux[0] * grad[0] + flux[1] * grad[1] + flux[2] * grad[2] + sink * geometry.shape[q, a]
    return lowest.min()


@njit(cache=True, parallel=True, fastmath=FAST)
def lagrangian_gradient(geometry, source, c, chi, u, p, lu, lp, weight, stressed, g_chi, g_u, g_p):
    """Derivative of Λ_u·R_u + Λ_p·R_p + weight · C_Ψ with respect to χ, u and p, per element.

    Adds nothing for Γ or the spring. ``weight`` is 1 to include C_Ψ (Eq. 14) and 0 to leave it out; the complex
    step on this function gives second derivatives.

    Args:
        lu, lp: adjoint fields Λ_u (n_nodes, 3) and Λ_p (n_vertices,), of the type of the other fields.
        stressed: whether Λ_u is not zero; its part of the work is skipped otherwise.
        g_chi, g_u, g_p: results, (n_cells, 8), (n_cells, 20, 3) and (n_cells, 8).
    """
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        vertices, nodes = geometry.cells[e], geometry.node_cells[e]
        F, Finv = np.empty((3, 3), u.dtype), np.empty((3, 3), u.dtype)
        b, H = np.empty((3, 3), u.dtype), np.empty((3, 3), u.dtype)
        h, M = np.empty((3, 3), u.dtype), np.empty((3, 3), u.dtype)
        g, w, gl = np.empty(3, u.dtype), np.empty(3, u.dtype), np.empty(3, u.dtype)
        v, flux, slope = np.empty(3, u.dtype), np.empty(3, u.dtype), np.empty(8, chi.dtype)
        k = cell_permeability(geometry, c, chi, e, slope)
        seepage = 0.0 * u[0, 0]  # ∫ k J w · v
        hessian = geometry.hessian[s]
        g_u[e] = 0.0
        if stressed and c.hessian_penalty != 0.0:
            for a in range(20):
                for i in range(3):
                    value = 0.0 * u[0, 0]
                    for d in range(20):
                        value += hessian[a, d] * lu[nodes[d], i]
                    g_u[e, a, i] = c.hessian_penalty * value
        for a in range(8):
            g_chi[e, a] = 0.0
            g_p[e, a] = 0.0
        for q in range(n_q):
            dx = geometry.volume[s, q]
            gradient20 = geometry.gradient20[s, q]
            deformation_gradient(u, nodes, gradient20, F)
            J = inverse(F, Finv)
            x = interpolate(chi, vertices, geometry.shape[q])
            pressure = interpolate(p, vertices, geometry.shape[q])
            trace = left_cauchy_green(F, b)
            E, dE = stiffness(x, c)
            log_J = np.log(J)
            iso = np.exp(-2.0 / 3.0 * log_J)
            d_chi = d_p = 0.0 * J
            M[:] = 0.0
            if stressed:
                # h = ∇Λ F⁻¹
                for i in range(3):
                    for j in range(3):
                        H[i, j] = 0.0
                for a in range(20):
                    n = nodes[a]
                    for i in range(3):
                        for j in range(3):
                            H[i, j] += lu[n, i] * gradient20[a, j]
                for i in range(3):
                    for j in range(3):
                        h[i, j] = H[i, 0] * Finv[0, j] + H[i, 1] * Finv[1, j] + H[i, 2] * Finv[2, j]
                div = h[0, 0] + h[1, 1] + h[2, 2]
                d_chi = dE * contraction(c, E, J * pressure, log_J, iso, trace, b, h, div, M)
                d_p = -J * div
            # Darcy
            vertex_gradient(p, vertices, geometry.gradient[s, q], g)
            push(Finv, g, w)
            vertex_gradient(lp, vertices, geometry.gradient[s, q], gl)
            push(Finv, gl, v)
            work = 0.0 * J  # p Λ_p, interpolated as a product: the drainage's rows are summed
            for a in range(8):
                work += geometry.shape[q, a] * p[vertices[a]] * lp[vertices[a]]
            out, d_out = drainage(x, c)
            wv = w[0] * v[0] + w[1] * v[1] + w[2] * v[2]
            seepage += dx * k * J * wv
            d_chi += d_out * work
            sink = dx * (source[s, q] + out)
            for i in range(3):
                flux[i] = dx * k * J * (Finv[i, 0] * v[0] + Finv[i, 1] * v[1] + Finv[i, 2] * v[2])
                for j in range(3):
                    M[i, j] -= k * J * (w[i] * v[j] + v[i] * w[j])
                M[i, i] += k * J * wv
            # Strain energy limit
            if weight != 0.0:
                density = energy_density(c, log_J, iso, trace, b)
                if density.real > c.energy_limit:  # the factor of the stiffness is at most one
                    Es, dEs = stiffness(x + c.energy_shift, c)
                    over = Es * density / c.energy_limit - 1.0
                    if over.real > 0.0:
                        rate = weight * c.strain_energy_weight * over * over * over * over * over / c.energy_limit
                        d_chi += rate * (dEs * density)
                        add_stress(c, rate * Es, log_J, iso, trace, b, M)
            # f_a = M F⁻ᵀ ∇N_a
            for i in range(3):
                for j in range(3):
                    H[i, j] = dx * (M[i, 0] * Finv[j, 0] + M[i, 1] * Finv[j, 1] + M[i, 2] * Finv[j, 2])
            for a in range(20):
                for i in range(3):
                    g_u[e, a, i] += H[i, 0] * gradient20[a, 0] + H[i, 1] * gradient20[a, 1] + H[i, 2] * gradient20[a, 2]
            for a in range(8):
                grad = geometry.gradient[s, q, a]
                shape = geometry.shape[q, a]
                g_chi[e, a] += dx * d_chi * shape
                g_p[e, a] += (dx * d_p + sink * lp[vertices[a]]) * shape
                g_p[e, a] += flux[0] * grad[0] + flux[1] * grad[1] + flux[2] * grad[2]
        for a in range(8):
            g_chi[e, a] += seepage * slope[a]


@njit(cache=True, parallel=True, fastmath=FAST)
def strain_energy_excess(geometry, c, chi, u):
    """C_Ψ of Eq. (14) and the largest Ψ(χ + 4/L_i, u) / Ψ_lim over the quadrature points."""
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    total, largest = np.zeros(n_cells), np.zeros(n_cells)
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        F, Finv, b = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        for q in range(n_q):
            deformation_gradient(u, geometry.node_cells[e], geometry.gradient20[s, q], F)
            J = inverse(F, Finv)
            if J <= 0.0:
                total[e] = np.inf
                continue
            log_J = np.log(J)
            trace, iso = left_cauchy_green(F, b), np.exp(-2.0 / 3.0 * log_J)
            x = interpolate(chi, geometry.cells[e], geometry.shape[q])
            density = energy_density(c, log_J, iso, trace, b)
            ratio = stiffness(x + c.energy_shift, c)[0] * density / c.energy_limit
            largest[e] = max(largest[e], ratio)
            if ratio > 1.0:
                total[e] += geometry.volume[s, q] * c.strain_energy_weight / 6.0 * (ratio - 1.0) ** 6
    return ordered_sum(total), largest.max()
