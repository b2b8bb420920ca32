"""The Lagrangian of Eq. (10), C + Λ·R: one compiled loop for the derivative of Λ·R and of C_Ψ.

The two share deformation gradient, inverse and stretch at every point, which is most of their price. Symbols are those
of :mod:`actuator.equations.kernels`.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.equations.kernels import (
    cell_permeability,
    deformation_gradient,
    interpolate,
    penalty_forces,
    vertex_gradient,
)
from actuator.material.elasticity import contraction
from actuator.material.ersatz import FAST, drainage, inverse, left_cauchy_green, permeability, push, stiffness
from actuator.terms.strain_energy import add_strain_energy


@njit(cache=True, parallel=True, fastmath=FAST)
def lagrangian_gradient(geometry, source, c, chi, u, p, lu, lp, weight, stressed, g_chi, g_u, g_p):
    """Derivative of Λ_u·R_u + Λ_p·R_p + weight · C_Ψ with respect to χ, u and p, per element.

    Adds nothing for Γ or the spring. ``weight`` is 1 to include C_Ψ and 0 to leave it out; the complex step on this
    function gives second derivatives.

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
        g_u[e] = 0.0
        if stressed:
            penalty_forces(c, geometry.hessian[s], nodes, lu, g_u[e])
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
            factor, d_factor = stiffness(x, c)
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
                d_chi = d_factor * contraction(c, factor, J * pressure, log_J, iso, trace, b, h, div, M)
                d_p = -J * div
            # Darcy
            vertex_gradient(p, vertices, geometry.gradient[s, q], g)
            push(Finv, g, w)
            vertex_gradient(lp, vertices, geometry.gradient[s, q], gl)
            push(Finv, gl, v)
            at_point = interpolate(lp, vertices, geometry.shape[q])
            work = pressure * at_point
            if geometry.summed:  # interpolated as a product
                work = 0.0 * J
                for a in range(8):
                    work += geometry.shape[q, a] * p[vertices[a]] * lp[vertices[a]]
            out, d_out = drainage(x, c)
            wv = w[0] * v[0] + w[1] * v[1] + w[2] * v[2]
            if geometry.fitted:
                seepage += dx * k * J * wv
            else:
                k, d_k = permeability(x, c)
                d_chi += d_k * J * wv
            d_chi += d_out * work
            sink = dx * (source[s, q] + out)
            for i in range(3):
                flux[i] = dx * k * J * (Finv[i, 0] * v[0] + Finv[i, 1] * v[1] + Finv[i, 2] * v[2])
                for j in range(3):
                    M[i, j] -= k * J * (w[i] * v[j] + v[i] * w[j])
                M[i, i] += k * J * wv
            if weight != 0.0:
                d_chi = add_strain_energy(c, weight, x, log_J, iso, trace, b, M, d_chi)
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
                multiplier = lp[vertices[a]] if geometry.summed else at_point
                g_p[e, a] += (dx * d_p + sink * multiplier) * shape
                g_p[e, a] += flux[0] * grad[0] + flux[1] * grad[1] + flux[2] * grad[2]
        for a in range(8):
            g_chi[e, a] += seepage * slope[a]
