"""Elimination of q against the multiplier form of Eqs. (6) to (8), assembled with scikit-fem and solved by SciPy."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
import scipy.sparse as sp
from physics import (
    RADIUS,
    Floats,
    assembled,
    displacement_dofs,
    element_tangents,
    half_cylinder,
    nodal_residuals,
    parameters,
)
from scipy.sparse.linalg import spsolve
from skfem import BilinearForm, ElementHexS2, FacetBasis

from actuator.equations.discretisation import Discretisation
from actuator.material.constants import constants_of
from actuator.solve.equilibrium import Equilibrium, State

DOMAIN = half_cylinder(1, 1, 3)
CHI = DOMAIN.initial_design(DOMAIN.points, 3.0) - 1.5 * DOMAIN.points[:, 2] / RADIUS
SPRINGS = {"paper's spring": 1.6e-2, "stiff spring": 0.5, "no spring": 0.0}


@BilinearForm
def product(u, v, _):
    return u * v


@dataclass
class Unknowns:
    """u (n_nodes, 3), p (n_vertices,), q on Γ (n_tip, 3) in N/mm², T (3,)."""

    u: Floats
    p: Floats
    q: Floats
    T: Floats


class MultiplierForm:
    """Residual and tangent of Eqs. (5) to (8) in all unknowns at once: a saddle point."""

    def __init__(self, spring_ratio: float) -> None:
        material, self.load, objective = parameters(load={"spring_ratio": spring_ratio})
        self.c = constants_of(material, self.load, objective)
        self.discretisation = Discretisation(DOMAIN)
        self.source = self.discretisation.source(material.drainage)
        self.tip = np.flatnonzero(DOMAIN.nodes[:, 0] == DOMAIN.length)
        facets = DOMAIN.mesh.facets_satisfying(lambda x: x[0] > DOMAIN.length - 1e-9, boundaries_only=True)
        # Products of the face's quadratic functions have degree 6 at most, with a linear Jacobian.
        basis = FacetBasis(DOMAIN.mesh, ElementHexS2(), facets=facets, intorder=8)
        self.mass = product.assemble(basis).tocsr()[self.tip][:, self.tip].toarray()
        self.heights = DOMAIN.nodes[self.tip, 2]
        free = np.ones((len(DOMAIN.nodes), 3), dtype=bool)
        free[DOMAIN.nodes[:, 0] == 0.0] = False
        free[DOMAIN.nodes[:, 1] == 0.0, 1] = False
        self.free_u, self.free_q = free.ravel(), free[self.tip].ravel()

    @cached_property
    def free(self) -> Floats:
        """Which of all unknowns, in the order u, p, q, T, are not prescribed."""
        return np.concatenate([self.free_u, np.ones(DOMAIN.mesh.nvertices, bool), self.free_q, np.ones(3, bool)])

    def rigid(self, T: Floats) -> Floats:
        """The bracket's second vector in Eq. (7)."""
        sine, cosine = np.sin(T[2]), np.cos(T[2])
        return np.stack([T[0] + self.heights * sine, 0.0 * self.heights, T[1] - self.heights * (1.0 - cosine)], axis=1)

    def rigid_slope(self, T: Floats) -> Floats:
        """The bracket's derivative in Eq. (8), (n_tip, 3, 3 of T)."""
        sine, cosine, one = np.sin(T[2]), np.cos(T[2]), np.ones_like(self.heights)
        nothing = 0.0 * one
        return np.stack(
            [
                np.stack([one, nothing, self.heights * cosine], axis=1),
                np.zeros((len(one), 3)),
                np.stack([nothing, one, -self.heights * sine], axis=1),
            ],
            axis=1,
        )

    def arm_residual(self, T: Floats, q: Floats) -> Floats:
        """R_T of Eq. (8)."""
        arm = self.load.arm_length
        pull = self.load.spring_stiffness * (T[1] - arm * np.sin(T[2]))
        spring = pull * np.array([0.0, 1.0, -arm * np.cos(T[2])])
        return spring - np.einsum("nik,ni->k", self.rigid_slope(T), self.mass @ q)

    def residual(self, at: Unknowns) -> Floats:
        """R_u, R_p, R_q and R_T, one after the other."""
        forces, flow = nodal_residuals(self.discretisation.geometry, self.source, self.c, CHI, at.u, at.p)
        forces[self.tip] += self.mass @ at.q
        gap = self.mass @ (at.u[self.tip] - self.rigid(at.T))
        return np.concatenate([forces.ravel(), flow, gap.ravel(), self.arm_residual(at.T, at.q)])

    def tangent(self, at: Unknowns) -> sp.csr_array:
        g = self.discretisation.geometry
        n_u, n_p, n_q = at.u.size, len(at.p), at.q.size
        uu, up, pu, pp = element_tangents(g, self.source, self.c, CHI, at.u, at.p)
        dofs = displacement_dofs(g)
        K = assembled(uu, dofs, dofs, (n_u, n_u)), assembled(up, dofs, g.cells, (n_u, n_p))
        D = assembled(pu, g.cells, dofs, (n_p, n_u)), assembled(pp, g.cells, g.cells, (n_p, n_p))
        tip_dofs = (3 * self.tip[:, None] + np.arange(3)).ravel()
        trace = sp.csr_array((np.ones(n_q), (np.arange(n_q), tip_dofs)), (n_q, n_u))
        mass = sp.csr_array(np.kron(self.mass, np.eye(3)))
        coupling = mass @ trace
        arm = -mass @ sp.csr_array(self.rigid_slope(at.T).reshape(n_q, 3))
        # Derivatives of R_T with respect to T: the spring's, and that of the lever arms of q.
        turn = np.stack([self.arm_residual(at.T + 1e-40j * unit, at.q).imag / 1e-40 for unit in np.eye(3)], axis=1)
        blocks = [[*K, coupling.T, None], [*D, None, None], [coupling, None, None, arm], [None, None, arm.T, turn]]
        return sp.csr_array(sp.block_array(blocks))

    def solve(self, p: Floats) -> Unknowns:
        """Newton's method from rest with a pressure p to start from."""
        at = Unknowns(np.zeros_like(DOMAIN.nodes), p, np.zeros((len(self.tip), 3)), np.zeros(3))
        sizes = np.cumsum([at.u.size, at.p.size, at.q.size])
        scale = np.abs(self.residual(at)[self.free]).max()
        for _ in range(12):
            r = self.residual(at)
            if np.abs(r[self.free]).max() < 1e-13 * scale:
                return at
            step = np.zeros(len(r))
            matrix = self.tangent(at)[self.free][:, self.free]
            step[self.free] = spsolve(matrix.tocsc(), -r[self.free])
            du, dp, dq, dT = np.split(step, sizes)
            at = Unknowns(at.u + du.reshape(-1, 3), at.p + dp, at.q + dq.reshape(-1, 3), at.T + dT)
        raise AssertionError(f"Newton's method did not converge: {np.abs(r[self.free]).max() / scale}")


@pytest.fixture(scope="module", params=SPRINGS.values(), ids=SPRINGS.keys())
def both(request: pytest.FixtureRequest) -> tuple[MultiplierForm, Unknowns, State]:
    """The multiplier form, its solution, and the state with q eliminated."""
    equilibrium = Equilibrium(DOMAIN, *parameters(load={"spring_ratio": request.param}), tolerance=1e-12, threads=1)
    state = equilibrium.solve(CHI)
    form = MultiplierForm(request.param)
    return form, form.solve(0.5 * state.p), state


def test_same_arm_displacements_and_pressure(both: tuple[MultiplierForm, Unknowns, State]) -> None:
    _, full, state = both
    assert np.abs(state.arm).min() > 1e-3
    assert state.arm == pytest.approx(full.T, rel=1e-9)
    assert np.abs(state.displacement - full.u).max() < 1e-9 * np.abs(full.u).max()
    assert np.abs(state.p - full.p).max() < 1e-9 * np.abs(full.p).max()


def test_tractions_are_the_reactions_of_the_eliminated_nodes(both: tuple[MultiplierForm, Unknowns, State]) -> None:
    """∫ q·N_a over Γ balances the nodal forces; on the symmetry plane q has no X2 component to do so."""
    form, full, state = both
    traction = form.mass @ full.q
    reaction = -state.nodal[form.tip]
    held = form.free_q.reshape(-1, 3)
    assert np.abs(traction).max() > 1e-3
    assert np.abs(traction - reaction)[held].max() < 1e-9 * np.abs(traction).max()
    assert np.all(full.q[~held] == 0.0)


def test_resultants_of_q_hold_the_spring(both: tuple[MultiplierForm, Unknowns, State]) -> None:
    """Eq. (8): no net force along X1, the spring's force along X3 and its moment about the arm's origin."""
    form, full, _ = both
    traction = form.mass @ full.q
    pull = form.load.spring_stiffness * (full.T[1] - form.load.arm_length * np.sin(full.T[2]))
    scale = np.abs(traction).sum()
    assert traction[:, 0].sum() == pytest.approx(0.0, abs=1e-10 * scale)
    assert traction[:, 2].sum() == pytest.approx(pull, abs=1e-10 * scale)
    lever = form.heights * np.cos(full.T[2]), -form.heights * np.sin(full.T[2])
    moment = np.sum(lever[0] * traction[:, 0] + lever[1] * traction[:, 2])
    expected = -pull * form.load.arm_length * np.cos(full.T[2])
    assert moment == pytest.approx(expected, abs=1e-9 * scale * RADIUS)
