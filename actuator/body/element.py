"""Element loops of the 10-node tetrahedron at finite strain, compiled for the type of the law's constants.

Cells are isoparametric: those at the surface have curved edges. In the mixed form the mean stress π, linear in every
cell and continuous, is an unknown of its own,

    W = G w(b̄) + π ln J - π² / (2 K),

which does not lock for K >> G (P2-P1 of Taylor & Hood 1973, doi:10.1016/0045-7930(73)90027-3; stable in three
dimensions by Boffi 1997, doi:10.1137/S0036142994270193) and whose stationary π is K ln J. The plain form has
K/2 (ln J)² instead.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange

from actuator.arrays import Floats, Ints
from actuator.body.mesh import EDGES
from actuator.material.elasticity import contractions, isochoric_stress
from actuator.material.pointwise import energy

#: Rule of degree 2 with four points of equal weight (Keast 1986, doi:10.1016/0045-7825(86)90059-9): barycentric
#: coordinates. It integrates the stiffness of straight-edged cells at small strain exactly.
_NEAR, _FAR = 0.25 + 0.15 * 5**0.5, 0.25 - 0.05 * 5**0.5
POINTS = _FAR + (_NEAR - _FAR) * np.eye(4)


def shape_slopes(barycentric: Floats) -> Floats:
    """∂N_a/∂λ_c of the 10 nodes at points given by barycentric coordinates (n, 4), (n, 10, 4)."""
    slopes = np.zeros((len(barycentric), 10, 4))
    for a in range(4):
        slopes[:, a, a] = 4.0 * barycentric[:, a] - 1.0
    for k, (a, b) in enumerate(EDGES, start=4):
        slopes[:, k, a], slopes[:, k, b] = 4.0 * barycentric[:, b], 4.0 * barycentric[:, a]
    return slopes


SLOPES = shape_slopes(POINTS)


class Points(NamedTuple):
    """The points of the rule in all cells.

    Attributes:
        barycentric: :data:`POINTS`, (4, 4).
        gradients: ∇N, (n_cells, 4, 10, 3), 1/mm.
        volumes: what each point stands for, (n_cells, 4), mm³.
    """

    barycentric: Floats
    gradients: Floats
    volumes: Floats


def points_of(nodes: Floats, cells: Ints) -> Points:
    """The points of the rule in cells (n_cells, 10) with their nodes at (n_nodes, 3), mm."""
    local = SLOPES[:, :, 1:] - SLOPES[:, :, :1]  # by λ_1 to λ_3, with λ_0 = 1 - λ_1 - λ_2 - λ_3
    jacobian = np.einsum("eai,qac->eqic", nodes[cells], local)
    gradients = np.einsum("qac,eqcj->eqaj", local, np.linalg.inv(jacobian))
    return Points(POINTS, gradients, np.linalg.det(jacobian) / (6.0 * len(POINTS)))


def least_jacobian(nodes: Floats, cells: Ints) -> Floats:
    """Smallest det ∂X/∂λ at nodes and points of the rule over the mean at these points, (n_cells,)."""
    corners = np.eye(4)
    places = np.concatenate([corners, corners[EDGES].mean(axis=1), POINTS])
    slopes = shape_slopes(places)
    jacobian = np.einsum("eai,qac->eqic", nodes[cells], slopes[:, :, 1:] - slopes[:, :, :1])
    determinant = np.linalg.det(jacobian)
    return np.asarray(determinant.min(axis=1) / np.abs(determinant[:, -len(POINTS) :].mean(axis=1)))


#: Local number pairs a <= d of the packed blocks, in order.
PAIRS = np.array([(a, d) for a in range(10) for d in range(a, 10)])


@njit(cache=True)
def kinematics(gradient, u, n, b):
    """Write n = F⁻ᵀ ∇N (10, 3) and b = F Fᵀ; return ln J (NaN if J <= 0)."""
    F = np.eye(3)
    for a in range(10):
        for i in range(3):
            for j in range(3):
                F[i, j] += u[a, i] * gradient[a, j]
    J = (
        F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1])
        - F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2, 0])
        + F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0])
    )
    if not J > 0.0:
        return np.nan
    cofactor = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            k, m = (i + 1) % 3, (i + 2) % 3
            r, s = (j + 1) % 3, (j + 2) % 3
            cofactor[i, j] = (F[k, r] * F[m, s] - F[k, s] * F[m, r]) / J
            b[i, j] = F[i, 0] * F[j, 0] + F[i, 1] * F[j, 1] + F[i, 2] * F[j, 2]
    for a in range(10):
        g0, g1, g2 = gradient[a, 0], gradient[a, 1], gradient[a, 2]
        for i in range(3):
            n[a, i] = cofactor[i, 0] * g0 + cofactor[i, 1] * g1 + cofactor[i, 2] * g2
    return np.log(J)


@njit(cache=True, parallel=True)
def forces(c, mixed, points, cells, u, pi, f, g, density, log_J):
    """Write nodal forces, volumetric equations, energy and ln J of all cells.

    Args:
        c: constants, :func:`actuator.material.constants.constants_of`.
        mixed: whether π is an unknown.
        points: of the cells, :class:`Points`.
        cells: (n, 10).
        u: (n_nodes, 3), mm.
        pi: (n_vertices,), N/mm²; not read in the plain form.
        f: out, (n, 10, 3), N.
        g: out, (n, 4), mm³: ∂Π/∂π.
        density: out, (n, 4), N/mm²: Ψ at the points of the rule; in the mixed form with π² / (2 K).
        log_J: out, (n, 4); NaN where a cell is inside out.
    """
    for e in prange(len(cells)):
        ue, n = np.empty((10, 3)), np.empty((10, 3))
        b, S = np.empty((3, 3)), np.empty((3, 3))
        for a in range(10):
            for i in range(3):
                ue[a, i] = u[cells[e, a], i]
                f[e, a, i] = 0.0
        for a in range(4):
            g[e, a] = 0.0
        for q in range(4):
            logarithm = kinematics(points.gradients[e, q], ue, n, b)
            log_J[e, q] = logarithm
            if np.isnan(logarithm):
                density[e, q] = np.nan
                continue
            isochoric = isochoric_stress(c, np.exp(-2.0 / 3.0 * logarithm), b, S)
            dx = points.volumes[e, q]
            density[e, q] = c.shear * energy(c, isochoric)
            spherical = c.bulk * logarithm
            if mixed:
                spherical = 0.0
                for a in range(4):
                    spherical += points.barycentric[q, a] * pi[cells[e, a]]
                for a in range(4):
                    g[e, a] += dx * points.barycentric[q, a] * (logarithm - spherical / c.bulk)
                density[e, q] += 0.5 * spherical * spherical / c.bulk
            else:
                density[e, q] += 0.5 * spherical * logarithm
            for i in range(3):
                for j in range(3):
                    S[i, j] *= c.shear * dx
                S[i, i] += spherical * dx
            for a in range(10):
                for i in range(3):
                    f[e, a, i] += S[i, 0] * n[a, 0] + S[i, 1] * n[a, 1] + S[i, 2] * n[a, 2]


@njit(cache=True, parallel=True)
def tangents(c, shearing, mixed, points, cells, u, pi, K, B, C):
    """Write the second derivatives of the energy of all cells.

    Args:
        shearing: the constants, with K = 0 in the mixed form.
        K: out, (n, 55, 3, 3), N/mm: blocks of the node pairs :data:`PAIRS`.
        B: out, (n, 4, 10, 3), mm²: ∂²Π/∂π∂u; not written in the plain form.
        C: out, (n, 4, 4), mm³/(N/mm²): ∂²Π/∂π²; not written in the plain form.
    """
    for e in prange(len(cells)):
        ue, n = np.empty((10, 3)), np.empty((10, 3))
        b, S = np.empty((3, 3)), np.empty((3, 3))
        h, M, A = np.zeros((9, 3, 3)), np.empty((9, 3, 3)), np.empty((3, 3, 3))
        for a in range(10):
            for i in range(3):
                ue[a, i] = u[cells[e, a], i]
        K[e] = 0.0
        if mixed:
            B[e] = 0.0
            C[e] = 0.0
        for q in range(4):
            dx = points.volumes[e, q]
            for k in range(3):
                for s in range(3):
                    h[3 * k + s, k, s] = dx
            logarithm = kinematics(points.gradients[e, q], ue, n, b)
            # With π held, τ = π I + G dev S and δ(π I) = 0: that of K = 0 and J p = -π, but for the change of J.
            pressure = 0.0
            if mixed:
                for a in range(4):
                    pressure += points.barycentric[q, a] * pi[cells[e, a]]
            contractions(shearing, 1.0, -pressure, logarithm, np.exp(-2.0 / 3.0 * logarithm), b, h, M, S)
            if mixed:
                for k in range(3):
                    for i in range(3):
                        M[4 * k, i, i] -= pressure * dx
                for v in range(4):
                    for a in range(10):
                        for i in range(3):
                            B[e, v, a, i] += dx * points.barycentric[q, v] * n[a, i]
                    for w in range(4):
                        C[e, v, w] -= dx * points.barycentric[q, v] * points.barycentric[q, w] / c.bulk
            pair = 0
            for a in range(10):
                for i in range(3):
                    for k in range(3):
                        for s in range(3):
                            value = 0.0
                            for j in range(3):
                                value += M[3 * k + s, i, j] * n[a, j]
                            A[i, k, s] = value
                for d in range(a, 10):
                    for i in range(3):
                        for k in range(3):
                            K[e, pair, i, k] += A[i, k, 0] * n[d, 0] + A[i, k, 1] * n[d, 1] + A[i, k, 2] * n[d, 2]
                    pair += 1


def unpacked(K: Floats) -> Floats:
    """Full matrices (n, 30, 30) of packed blocks (n, 55, 3, 3)."""
    full = np.zeros((len(K), 10, 3, 10, 3))
    for pair, (a, d) in enumerate(PAIRS):
        full[:, a, :, d] = K[:, pair]
        full[:, d, :, a] = K[:, pair].transpose(0, 2, 1)
    return full.reshape(len(K), 30, 30)
