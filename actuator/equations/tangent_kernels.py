"""Compiled element loops for the blocks of the state's tangent, and for the Darcy problem with u frozen."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.equations.kernels import cell_permeability, deformation_gradient, interpolate, vertex_gradient
from actuator.material.elasticity import kirchhoff_stress, mechanical_block
from actuator.material.ersatz import FAST, drainage, inverse, left_cauchy_green, permeability, push, stiffness

#: Entries of the packed mechanical block: the 210 node pairs a <= b, each a 3 x 3 block in row-major order.
PACKED = 210 * 9


@njit(cache=True, parallel=True, fastmath=FAST)
def tangent(geometry, source, c, chi, u, p, Kuu, Kup, Kpp):
    """Derivatives of the element residuals of :func:`actuator.equations.kernels.residual` with respect to u and p.

    Args:
        Kuu: result, (n_cells, 1890), N/mm; packed as :data:`PACKED` says. The block is symmetric.
        Kup: result, (n_cells, 20, 3, 8), mm².
        Kpp: result, (n_cells, 8, 8), mm⁵/(N s); symmetric.
    """
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        vertices, nodes = geometry.cells[e], geometry.node_cells[e]
        F, Finv, b = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        n, v = np.empty((20, 3)), np.empty((8, 3))
        m, left, right, geometric = np.empty((20, 3)), np.empty((20, 3)), np.empty((20, 3)), np.empty((20, 3))
        H = geometry.hessian[s]
        k = cell_permeability(geometry, c, chi, e, np.empty(8))
        first = 0
        for a in range(20):
            for d in range(a, 20):
                for i in range(9):
                    Kuu[e, first + i] = 0.0
                value = c.hessian_penalty * H[a, d]
                Kuu[e, first] = value
                Kuu[e, first + 4] = value
                Kuu[e, first + 8] = value
                first += 9
        Kup[e] = 0.0
        Kpp[e] = 0.0
        for q in range(n_q):
            dx = geometry.volume[s, q]
            deformation_gradient(u, nodes, geometry.gradient20[s, q], F)
            J = inverse(F, Finv)
            x = interpolate(chi, vertices, geometry.shape[q])
            pressure = interpolate(p, vertices, geometry.shape[q])
            trace = left_cauchy_green(F, b)
            factor = stiffness(x, c)[0]
            log_J = np.log(J)
            gradient20 = geometry.gradient20[s, q]
            mechanical_block(
                c, dx, factor, J * pressure, log_J, trace, b, Finv, gradient20, n, m, left, right, geometric, Kuu[e]
            )
            if not geometry.fitted:
                k = permeability(x, c)[0]
            kJ = k * J * dx
            sink = dx * (source[s, q] + drainage(x, c)[0])
            for a in range(8):
                push(Finv, geometry.gradient[s, q, a], v[a])
            for a in range(8):
                shape = geometry.shape[q, a]
                for d in range(8):
                    Kpp[e, a, d] += kJ * (v[a, 0] * v[d, 0] + v[a, 1] * v[d, 1] + v[a, 2] * v[d, 2])
                    if not geometry.summed:
                        Kpp[e, a, d] += sink * shape * geometry.shape[q, d]
                if geometry.summed:
                    Kpp[e, a, a] += sink * shape
                Jp = J * dx * shape
                for d in range(20):
                    for j in range(3):
                        Kup[e, d, j, a] -= Jp * n[d, j]


@njit(cache=True, parallel=True, fastmath=FAST)
def darcy_metric(geometry, u, metric):
    """Write J F⁻¹ F⁻ᵀ dx at the quadrature points for frozen u, and return the smallest J.

    Args:
        metric: result, (n_cells, n_q, 6) as 11, 22, 33, 23, 13, 12, mm³.
    """
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    lowest = np.full(n_cells, np.inf)
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        F, A = np.empty((3, 3)), np.empty((3, 3))
        for q in range(n_q):
            deformation_gradient(u, geometry.node_cells[e], geometry.gradient20[s, q], F)
            J = inverse(F, A)
            lowest[e] = min(lowest[e], J)
            scale = J * geometry.volume[s, q]
            for k in range(6):
                i, j = (k, k) if k < 3 else ((1, 2) if k == 3 else ((0, 2) if k == 4 else (0, 1)))
                metric[e, q, k] = scale * (A[i, 0] * A[j, 0] + A[i, 1] * A[j, 1] + A[i, 2] * A[j, 2])
    return lowest.min()


@njit(cache=True, parallel=True, fastmath=FAST)
def darcy_tangent(geometry, source, c, chi, metric, Kpp):
    """The Darcy block for frozen u, (n_cells, 8, 8); a prefix of what :func:`tangent` gives, far cheaper."""
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        Kpp[e] = 0.0
        v = np.empty((8, 3))
        k = cell_permeability(geometry, c, chi, e, np.empty(8))
        for q in range(n_q):
            x = interpolate(chi, geometry.cells[e], geometry.shape[q])
            if not geometry.fitted:
                k = permeability(x, c)[0]
            sink = geometry.volume[s, q] * (source[s, q] + drainage(x, c)[0])
            t = metric[e, q]
            for a in range(8):
                g = geometry.gradient[s, q, a]
                v[a, 0] = k * (t[0] * g[0] + t[5] * g[1] + t[4] * g[2])
                v[a, 1] = k * (t[5] * g[0] + t[1] * g[1] + t[3] * g[2])
                v[a, 2] = k * (t[4] * g[0] + t[3] * g[1] + t[2] * g[2])
            for a in range(8):
                if geometry.summed:
                    Kpp[e, a, a] += sink * geometry.shape[q, a]
                for d in range(a, 8):
                    g = geometry.gradient[s, q, d]
                    value = v[a, 0] * g[0] + v[a, 1] * g[1] + v[a, 2] * g[2]
                    if not geometry.summed:
                        value += sink * geometry.shape[q, a] * geometry.shape[q, d]
                    Kpp[e, a, d] += value
                    if d > a:
                        Kpp[e, d, a] += value


@njit(cache=True, parallel=True, fastmath=FAST)
def flow_tangent(geometry, c, chi, u, p, Kpu, Kpc):
    """Derivatives of the flow's element residuals with respect to u and χ.

    Args:
        Kpu: result, (n_cells, 8, 20, 3), mm²/s.
        Kpc: result, (n_cells, 8, 8), mm³/s; not symmetric.
    """
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        vertices, nodes = geometry.cells[e], geometry.node_cells[e]
        F, Finv, slope, flow = np.empty((3, 3)), np.empty((3, 3)), np.empty(8), np.zeros(8)
        g, w, v = np.empty(3), np.empty(3), np.empty((8, 3))
        wv, n = np.empty(8), np.empty(3)
        k, change = cell_permeability(geometry, c, chi, e, slope), 0.0
        Kpu[e] = 0.0
        Kpc[e] = 0.0
        for q in range(n_q):
            dx = geometry.volume[s, q]
            deformation_gradient(u, nodes, geometry.gradient20[s, q], F)
            x = interpolate(chi, vertices, geometry.shape[q])
            if not geometry.fitted:
                k, change = permeability(x, c)
            J = inverse(F, Finv)
            kJ = k * J * dx
            pressure = interpolate(p, vertices, geometry.shape[q])
            vertex_gradient(p, vertices, geometry.gradient[s, q], g)
            push(Finv, g, w)
            sink = dx * drainage(x, c)[1]
            for a in range(8):
                push(Finv, geometry.gradient[s, q, a], v[a])
                wv[a] = w[0] * v[a, 0] + w[1] * v[a, 1] + w[2] * v[a, 2]
                flow[a] += kJ * wv[a]
                drained = p[vertices[a]] if geometry.summed else pressure
                outflow = sink * geometry.shape[q, a] * drained + change * J * dx * wv[a]
                for d in range(8):
                    Kpc[e, a, d] += outflow * geometry.shape[q, d]
            for d in range(20):
                push(Finv, geometry.gradient20[s, q, d], n)
                nw = n[0] * w[0] + n[1] * w[1] + n[2] * w[2]
                for a in range(8):
                    nv = n[0] * v[a, 0] + n[1] * v[a, 1] + n[2] * v[a, 2]
                    for j in range(3):
                        Kpu[e, a, d, j] += kJ * (n[j] * wv[a] - w[j] * nv - v[a, j] * nw)
        for a in range(8):
            for d in range(8):
                Kpc[e, a, d] += flow[a] * slope[d]


@njit(cache=True, parallel=True, fastmath=FAST)
def design_tangent(geometry, c, chi, u, Kuc):
    """Derivatives of the forces on an element with respect to χ.

    Args:
        Kuc: result, (n_cells, 20, 3, 8), N.
    """
    n_cells, n_q = geometry.cells.shape[0], geometry.shape.shape[0]
    for e in prange(n_cells):
        s = geometry.cell_class[e]
        vertices, nodes = geometry.cells[e], geometry.node_cells[e]
        F, Finv, b, P = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        Kuc[e] = 0.0
        for q in range(n_q):
            dx = geometry.volume[s, q]
            deformation_gradient(u, nodes, geometry.gradient20[s, q], F)
            J = inverse(F, Finv)
            x = interpolate(chi, vertices, geometry.shape[q])
            trace = left_cauchy_green(F, b)
            log_J = np.log(J)
            rate = dx * stiffness(x, c)[1]
            kirchhoff_stress(c, rate, rate * c.bulk * log_J, log_J, trace, b)
            for i in range(3):
                for k in range(3):
                    P[i, k] = b[i, 0] * Finv[k, 0] + b[i, 1] * Finv[k, 1] + b[i, 2] * Finv[k, 2]
            for a in range(20):
                grad = geometry.gradient20[s, q, a]
                for i in range(3):
                    force = P[i, 0] * grad[0] + P[i, 1] * grad[1] + P[i, 2] * grad[2]
                    for d in range(8):
                        Kuc[e, a, i, d] += force * geometry.shape[q, d]
