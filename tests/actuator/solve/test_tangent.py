"""Every block of the tangent, Newton's method with it, and the linear solves."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from physics import LENGTH, Floats, half_cylinder, parameters
from scipy.sparse.linalg import spsolve

from actuator.equations.scheme import PressureElements, Scheme
from actuator.solve.equilibrium import Equilibrium, NoState
from actuator.solve.linearisation import Outdated
from actuator.solve.state import State

DOMAIN = half_cylinder(1, 1, 3)
CHI = DOMAIN.initial_design(DOMAIN.points, 3.0) + 1.0


@pytest.fixture(scope="module")
def equilibrium() -> Equilibrium:
    return Equilibrium(DOMAIN, *parameters(), tolerance=1e-11, threads=1)


@pytest.fixture(scope="module")
def state(equilibrium: Equilibrium) -> State:
    return equilibrium.solve(CHI)


@pytest.fixture(scope="module")
def far_state(equilibrium: Equilibrium) -> tuple[Floats, Floats]:
    """A strongly bent state that is no equilibrium: θ2 = 0.6, T1 and T3 of millimetres, uneven p."""
    rng = np.random.default_rng(1)
    X, arm = DOMAIN.nodes, np.array([1.1, -2.3, 0.6])
    along = X[:, 0] / LENGTH
    bent = np.zeros_like(X)
    bent[:, 0] = along * arm[0] + X[:, 2] * np.sin(along * arm[2])
    bent[:, 2] = along * arm[1] - X[:, 2] * (1.0 - np.cos(along * arm[2]))
    x = equilibrium.kinematics.reduced(bent + 0.05 * rng.normal(size=X.shape), arm)
    p = 0.05 * rng.uniform(size=DOMAIN.mesh.nvertices)
    assert equilibrium.residual(CHI, x, p)[3] > 0.1
    return x, p


def symmetric(upper: sp.csr_array) -> sp.csr_array:
    return sp.csr_array(upper + sp.triu(upper, 1).T)


def blocks(equilibrium: Equilibrium, chi: Floats, x: Floats, p: Floats) -> tuple[sp.csr_array, ...]:
    """K_xx, K_xp, K_px, K_pp at any state."""
    tangent = equilibrium.tangent
    nodal = equilibrium.residual(chi, x, p)[2]
    tangent.assemble(equilibrium.source, equilibrium.coefficients, chi, x, p, nodal)
    return symmetric(tangent.xx), tangent.xp.copy(), tangent.px.copy(), symmetric(tangent.pp)


def columns(equilibrium: Equilibrium, x: Floats, p: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """The same blocks, column by column, by complex step on the residual."""
    step = 1e-40j
    by_x = [equilibrium.residual(CHI, x + step * unit, p) for unit in np.eye(len(x))]
    by_p = [equilibrium.residual(CHI, x, p + step * unit) for unit in np.eye(len(p))]
    return tuple(
        np.stack([r[row].imag / 1e-40 for r in derivatives], axis=1)
        for row, derivatives in ((0, by_x), (0, by_p), (1, by_x), (1, by_p))
    )


def test_every_block_is_the_derivative_of_the_residual(
    equilibrium: Equilibrium, far_state: tuple[Floats, Floats]
) -> None:
    assembled = blocks(equilibrium, CHI, *far_state)
    for ours, expected in zip(assembled, columns(equilibrium, *far_state), strict=True):
        error = np.abs(ours.toarray() - expected)
        assert error.max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("elements", ["summed", "plain"])
def test_blocks_for_other_elements_of_p(elements: PressureElements, far_state: tuple[Floats, Floats]) -> None:
    """The flow's blocks by complex step, those with respect to χ too, and the Darcy problem's own matrix."""
    equilibrium = Equilibrium(DOMAIN, *parameters(), threads=1, scheme=Scheme(pressure=elements))
    x, p = far_state
    *_, px, pp = blocks(equilibrium, CHI, x, p)
    *_, by_x, by_p = columns(equilibrium, x, p)
    by_chi = np.stack(
        [equilibrium.flow_residual(CHI + 1e-40j * unit, x, p).imag / 1e-40 for unit in np.eye(len(CHI))], axis=1
    )
    of_flow, of_design = equilibrium.tangent.flow_blocks(equilibrium.coefficients, CHI, x, p)
    for ours, expected in ((px, by_x), (of_flow, by_x), (pp, by_p), (of_design, by_chi)):
        assert np.abs(ours.toarray() - expected).max() < 1e-12 * np.abs(expected).max()
    flow = np.random.default_rng(3).normal(size=len(p))
    assert by_p @ equilibrium.flow(CHI, x).solve(flow) == pytest.approx(flow, rel=1e-9, abs=1e-9)


def test_rows_and_columns_of_the_arm_are_full(equilibrium: Equilibrium, far_state: tuple[Floats, Floats]) -> None:
    """Compared one by one, since stiff solid cells would hide them in the test above."""
    assembled = blocks(equilibrium, CHI, *far_state)
    expected = columns(equilibrium, *far_state)
    for k in (-3, -2, -1):
        for ours, exact in ((assembled[0], expected[0]), (assembled[1], expected[1])):
            assert ours.toarray()[k] == pytest.approx(exact[k], rel=1e-10, abs=1e-11 * np.abs(exact[k]).max())
        exact = expected[2][:, k]
        assert assembled[2].toarray()[:, k] == pytest.approx(exact, rel=1e-10, abs=1e-11 * np.abs(exact).max())
    assert np.linalg.matrix_rank(expected[0][-3:, -3:]) == 3


def test_products_with_the_tangent_and_its_transpose(
    equilibrium: Equilibrium, far_state: tuple[Floats, Floats]
) -> None:
    xx, xp, px, pp = blocks(equilibrium, CHI, *far_state)
    full = sp.block_array([[xx, xp], [px, pp]]).toarray()
    v = np.random.default_rng(2).normal(size=len(full))
    n = len(far_state[0])
    tangent = equilibrium.tangent
    assert np.concatenate(tangent.multiply(v[:n], v[n:])) == pytest.approx(full @ v, rel=1e-10)
    assert np.concatenate(tangent.multiply_transposed(v[:n], v[n:])) == pytest.approx(full.T @ v, rel=1e-10)


# ---------------------------------------------------------------------------------------------------- Newton


def test_newton_with_this_tangent_converges_quadratically(equilibrium: Equilibrium, state: State) -> None:
    """Undamped, from rest at full pressure, each step solved exactly by SciPy."""
    x, p = np.zeros_like(state.x), state.p
    (force, flow), n, norms = equilibrium.scales, len(x), []
    for _ in range(6):
        rx, rp, _, _ = equilibrium.residual(CHI, x, p)
        norms.append(float(np.hypot(np.linalg.norm(rx) / force, np.linalg.norm(rp) / flow)))
        if norms[-1] < 1e-12:
            break
        xx, xp, px, pp = blocks(equilibrium, CHI, x, p)
        step = spsolve(sp.block_array([[xx, xp], [px, pp]], format="csc"), -np.concatenate([rx, rp]))
        x, p = x + step[:n], p + step[n:]
    r = np.array(norms)
    assert r[0] > 0.1
    assert np.all(r[1:] < r[:-1] ** 2 + 1e-12), r
    assert r[-1] < 1e-12
    assert x == pytest.approx(state.x, abs=1e-9)


def test_state_satisfies_all_equations(equilibrium: Equilibrium, state: State) -> None:
    rx, rp, nodal, lowest = equilibrium.residual(CHI, state.x, state.p)
    force, flow = equilibrium.scales
    norm = np.hypot(np.linalg.norm(rx) / force, np.linalg.norm(rp) / flow)
    assert norm == pytest.approx(state.residual, rel=1e-6)
    assert norm <= 1e-11
    assert lowest == state.lowest_jacobian
    assert np.array_equal(nodal, state.nodal)
    assert np.array_equal(state.displacement, equilibrium.kinematics.displacement(state.x))
    # The reaction on Γ carries the spring: -∫ q·∂u/∂T = spring force.
    reaction = equilibrium.kinematics.force(state.x, nodal)[-3:]
    assert reaction == pytest.approx(-equilibrium.kinematics.spring_force(state.x), abs=1e-10 * force)


def test_pressure_solves_darcy_at_given_displacements(
    equilibrium: Equilibrium, far_state: tuple[Floats, Floats]
) -> None:
    x, _ = far_state
    p = equilibrium.pressure(CHI, x)
    _, flow, _, _ = equilibrium.residual(CHI, x, p)
    assert np.linalg.norm(flow) < 1e-11 * equilibrium.scales[1]


def test_start_with_an_inverted_element_is_refused(equilibrium: Equilibrium, state: State) -> None:
    x = state.x.copy()
    x[-3] = -2.0 * LENGTH  # pushes the tip through the fixed end
    with pytest.raises(NoState, match="inverted element"):
        equilibrium.solve(CHI, (x, state.p))


def test_warm_start_needs_no_more_steps(equilibrium: Equilibrium, state: State) -> None:
    before = equilibrium.work.newton
    again = equilibrium.solve(CHI, (state.x, state.p))
    assert equilibrium.work.newton == before
    assert np.array_equal(again.x, state.x)


# ---------------------------------------------------------------------------------------------- linear solves


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_solves_honour_their_tolerance(equilibrium: Equilibrium, state: State, tolerance: float) -> None:
    rng, (force, flow) = np.random.default_rng(3), equilibrium.scales
    rx, rp = force * rng.normal(size=len(state.x)), flow * rng.normal(size=len(state.p))
    there = equilibrium.linearise(state)
    left = there.tangent.multiply(*there.solve(rx, rp, tolerance))
    error = np.hypot(np.linalg.norm(left[0] - rx) / force, np.linalg.norm(left[1] - rp) / flow)
    assert error <= 1.01 * tolerance * np.hypot(np.linalg.norm(rx) / force, np.linalg.norm(rp) / flow)

    gx, gp = rng.normal(size=len(state.x)) / force, rng.normal(size=len(state.p)) / flow
    left = there.tangent.multiply_transposed(*there.solve(gx, gp, tolerance, transposed=True))
    error = np.hypot(np.linalg.norm(left[0] - gx) * force, np.linalg.norm(left[1] - gp) * flow)
    assert error <= 1.01 * tolerance * np.hypot(np.linalg.norm(gx) * force, np.linalg.norm(gp) * flow)


def test_adjoint_is_dual_to_the_tangent(equilibrium: Equilibrium, state: State) -> None:
    rng, (force, flow) = np.random.default_rng(4), equilibrium.scales
    rx, rp = force * rng.normal(size=len(state.x)), flow * rng.normal(size=len(state.p))
    gx, gp = rng.normal(size=len(state.x)), rng.normal(size=len(state.p))
    dx, dp = equilibrium.linearise(state).solve(rx, rp, 1e-10)
    lx, lp = equilibrium.linearise(state).solve(gx, gp, 1e-10, transposed=True)
    assert gx @ dx + gp @ dp == pytest.approx(lx @ rx + lp @ rp, rel=1e-7)


def test_a_good_guess_saves_iterations(equilibrium: Equilibrium, state: State) -> None:
    gx, gp = np.zeros_like(state.x), np.zeros_like(state.p)
    gx[-1] = 1.0
    solution = equilibrium.linearise(state).solve(gx, gp, 1e-9, transposed=True)
    before = equilibrium.work.krylov
    equilibrium.linearise(state).solve(gx, gp, 1e-8, guess=solution, transposed=True)
    assert equilibrium.work.krylov == before


def test_a_linearisation_that_was_taken_over_cannot_be_used(equilibrium: Equilibrium, state: State) -> None:
    """Whatever is asked of it: the memory holds another tangent by then."""
    before = equilibrium.linearise(state, fresh=True)
    assert equilibrium.linearise(state) is before, "of the same state there is one"
    other = equilibrium.at(CHI, 0.5 * state.x, state.p)
    after = equilibrium.linearise(other)
    uses = (
        lambda: before.tangent,
        lambda: before.mechanics(state.x),
        lambda: before.flow(state.p),
        lambda: before.solve(state.x, state.p, 1e-3),
        lambda: before.solve(state.x, state.p, 1e-3, transposed=True),
        lambda: before.factorise(),
        lambda: before.negative_eigenvalues,
    )
    for use in uses:
        with pytest.raises(Outdated, match="linearise again"):
            use()
    assert after.tangent is equilibrium.tangent


def test_pressure_factors_that_were_replaced_cannot_be_used(equilibrium: Equilibrium, state: State) -> None:
    before = equilibrium.flow(CHI, state.x)
    assert equilibrium.flow(CHI.copy(), state.x.copy()) is before
    equilibrium.flow(CHI, 0.5 * state.x)
    with pytest.raises(RuntimeError, match="replaced"):
        before.solve(state.p)
