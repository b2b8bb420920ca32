"""Element loops for derivatives with respect to the shape of a body, compiled for the type of the law's constants.

The nodes of a fixed set of cells are what moves. With u held at the nodes, a motion θ changes ∇u by -∇u ∇θ and volumes
by div θ, so that the energy changes by ∫ (W I - (∇u)ᵀ P) : ∇θ dV, the energy-momentum tensor of Eshelby
(doi:10.1007/BF01579565).
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from actuator.body.element import kinematics
from actuator.material.elasticity import contractions, isochoric_stress


@njit(cache=True)
def _displacement_gradient(gradient, u, H):
    for i in range(3):
        for j in range(3):
            H[i, j] = 0.0
    for a in range(10):
        for i in range(3):
            for j in range(3):
                H[i, j] += u[a, i] * gradient[a, j]


@njit(cache=True, parallel=True)
def work_by_shape(c, shearing, mixed, points, cells, u, pi, v, varpi, by_shape, f):
    """Write the derivatives of the virtual work ∂Π/∂u · v + ∂Π/∂π · ϖ of all cells by the shape and by u.

    Args:
        c, shearing, mixed, points, cells, u, pi: as of :func:`actuator.body.element.tangents`.
        v: (n_nodes, 3), mm.
        varpi: ϖ, (n_vertices,), N/mm²; not read in the plain form.
        by_shape: out, (n, 10, 3), N, with u, π, v and ϖ held at the nodes.
        f: out, (n, 10, 3), N/mm times mm.
    """
    for e in prange(len(cells)):
        ue, ve, n = np.empty((10, 3)), np.empty((10, 3)), np.empty((10, 3))
        b, S, H, Y = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        h, M = np.empty((1, 3, 3)), np.empty((1, 3, 3))
        for a in range(10):
            for i in range(3):
                ue[a, i], ve[a, i] = u[cells[e, a], i], v[cells[e, a], i]
                by_shape[e, a, i] = 0.0
                f[e, a, i] = 0.0
        for q in range(4):
            gradient, dx = points.gradients[e, q], points.volumes[e, q]
            logarithm = kinematics(gradient, ue, n, b)
            _displacement_gradient(gradient, ue, H)
            _displacement_gradient(gradient, ve, Y)
            h[0] = 0.0
            for a in range(10):
                for i in range(3):
                    for j in range(3):
                        h[0, i, j] += ve[a, i] * n[a, j]
            pressure, change = 0.0, 0.0
            if mixed:
                for a in range(4):
                    pressure += points.barycentric[q, a] * pi[cells[e, a]]
                    change += points.barycentric[q, a] * varpi[cells[e, a]]
            iso = np.exp(-2.0 / 3.0 * logarithm)
            contractions(shearing, 1.0, -pressure, logarithm, iso, b, h, M, S)
            spherical = shearing.bulk * logarithm + pressure
            work = 0.0
            for i in range(3):
                if mixed:
                    M[0, i, i] += change - pressure * (h[0, 0, 0] + h[0, 1, 1] + h[0, 2, 2])
                for j in range(3):
                    S[i, j] *= c.shear
                S[i, i] += spherical
            for i in range(3):
                for j in range(3):
                    work += S[i, j] * h[0, i, j]
            if mixed:
                work += change * (logarithm - pressure / c.bulk)
            for a in range(10):
                for k in range(3):
                    by_shape[e, a, k] += dx * work * gradient[a, k]
                for i in range(3):
                    stress = S[i, 0] * n[a, 0] + S[i, 1] * n[a, 1] + S[i, 2] * n[a, 2]
                    changed = M[0, i, 0] * n[a, 0] + M[0, i, 1] * n[a, 1] + M[0, i, 2] * n[a, 2]
                    f[e, a, i] += dx * changed
                    for k in range(3):
                        by_shape[e, a, k] -= dx * (Y[i, k] * stress + H[i, k] * changed)


@njit(cache=True, parallel=True)
def energy_weighed(c, mixed, points, cells, u, pi, value, slope, f, g, by_shape):
    """Write the derivatives of ∫ φ(Ψ) dV of all cells by u, π and the shape.

    Args:
        c, mixed, points, cells, u, pi: as of :func:`actuator.body.element.forces`.
        value, slope: φ and dφ/dΨ at the points, (n, 4), as densities and by N/mm².
        f: out, (n, 10, 3), by u.
        g: out, (n, 4), by π; zero in the plain form.
        by_shape: out, (n, 10, 3), with u and π held at the nodes.
    """
    for e in prange(len(cells)):
        ue, n = np.empty((10, 3)), np.empty((10, 3))
        b, S, H = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
        for a in range(10):
            for i in range(3):
                ue[a, i] = u[cells[e, a], i]
                f[e, a, i] = 0.0
                by_shape[e, a, i] = 0.0
        for a in range(4):
            g[e, a] = 0.0
        for q in range(4):
            gradient, dx = points.gradients[e, q], points.volumes[e, q]
            logarithm = kinematics(gradient, ue, n, b)
            _displacement_gradient(gradient, ue, H)
            isochoric_stress(c, np.exp(-2.0 / 3.0 * logarithm), b, S)
            spherical = 0.0 if mixed else c.bulk * logarithm
            if mixed:
                pressure = 0.0
                for a in range(4):
                    pressure += points.barycentric[q, a] * pi[cells[e, a]]
                for a in range(4):
                    g[e, a] += dx * slope[e, q] * points.barycentric[q, a] * pressure / c.bulk
            for i in range(3):
                for j in range(3):
                    S[i, j] *= c.shear
                S[i, i] += spherical
            for a in range(10):
                for i in range(3):
                    stress = S[i, 0] * n[a, 0] + S[i, 1] * n[a, 1] + S[i, 2] * n[a, 2]
                    f[e, a, i] += dx * slope[e, q] * stress
                    for k in range(3):
                        by_shape[e, a, k] -= dx * slope[e, q] * H[i, k] * stress
                for k in range(3):
                    by_shape[e, a, k] += dx * value[e, q] * gradient[a, k]
