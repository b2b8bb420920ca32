"""The subproblem of a Newton step: stationary where it says, exact walls, low rank as if it were dense."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from physics import Floats, coefficients, half_cylinder, parameters
from scipy.optimize import minimize
from small_case import INTERFACE_WIDTH, metric_of, small_objective, start_of

from actuator.linear import DirectSolver
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.proposal import Proposal
from actuator.optimiser.subproblem import Subproblem
from actuator.regions.bounds import Kind, Region, Regions
from actuator.regions.shapes import Sphere
from actuator.solve.reduced import ReducedObjective
from actuator.terms import total_objective
from actuator.terms.interface import Problem as Terms
from actuator.terms.step import Metric

FAR = 1e3


@dataclass(frozen=True)
class Problem:
    objective: ReducedObjective
    norm: Metric
    chi: Floats
    linear: Floats
    curvature: Curvature
    quadratic: Floats

    def solve(self, reach: float = FAR, *, exact: bool = True, solver: DirectSolver | None = None) -> Proposal | None:
        solver = solver or self.objective.equilibrium.vertex_solver()
        value = self.objective.design.value(self.chi)
        subproblem = Subproblem(self.objective.design, solver, self.norm)
        return subproblem.solve(self.chi, value, self.linear, self.curvature, self.quadratic, reach, exact=exact)

    def matrix(self) -> Floats:
        """B + Q, dense."""
        upper = self.objective.design.gather.matrix(self.quadratic).toarray()
        columns = self.curvature.columns
        low_rank = columns * self.curvature.signs @ columns.T
        base = self.curvature.scale * self.norm.matrix.toarray() + np.diag(self.curvature.diagonal)
        return np.asarray(upper + np.triu(upper, 1).T + base + low_rank)

    def value(self, s: Floats) -> float:
        return float(
            self.linear @ s
            + 0.5 * s @ (self.matrix() @ s)
            + self.objective.design(self.chi + s).value
            - self.objective.design(self.chi).value
        )

    def gradient(self, s: Floats) -> Floats:
        return self.linear + self.matrix() @ s + self.objective.design(self.chi + s).gradient


def problem(*, inside: bool, pairs: int) -> Problem:
    """From the initial design, or from one well inside all walls; ``pairs`` of curvature learnt."""
    objective = small_objective()
    norm = metric_of(objective)
    rng = np.random.default_rng(7)
    chi = start_of(objective.domain)
    if inside:
        chi = 0.05 * chi - 20.0
    curvature = Curvature(norm, 1e-2 / norm.volume)
    curvature.rebase(1e-4 * rng.random(norm.size))
    for _ in range(pairs):
        s = rng.standard_normal(norm.size)
        curvature.learn(s, 30.0 * (norm @ s) / norm.volume)
    linear = 1e-2 * norm.matrix @ np.cos(objective.domain.points @ [0.2, 0.1, -0.3]) / norm.volume
    return Problem(objective, norm, chi, linear, curvature, 1e-3 * norm.upper)


@pytest.mark.parametrize("pairs", [0, 3, 12])
@pytest.mark.parametrize("inside", [True, False])
def test_proposal_is_stationary_and_says_what_it_gains(inside: bool, pairs: int) -> None:
    given = problem(inside=inside, pairs=pairs)
    proposal = given.solve()
    assert proposal is not None
    assert proposal.change == pytest.approx(given.value(proposal.step), rel=1e-6)
    assert proposal.change < 0.0
    first, left = (given.norm.dual_norm(given.gradient(s)) for s in (0.0 * proposal.step, proposal.step))
    assert left < 0.1 * first
    assert proposal.value == pytest.approx(given.objective.design.value(given.chi + proposal.step), rel=1e-13)


@pytest.mark.parametrize("pairs", [0, 5])
def test_far_from_all_walls_it_is_a_linear_system(pairs: int) -> None:
    given = problem(inside=True, pairs=pairs)
    proposal = given.solve()
    assert proposal is not None
    terms = given.objective.design(given.chi).terms
    assert terms["C_chi"].value == terms["C_i"].value == 0.0
    exact = np.linalg.solve(given.matrix(), -given.linear)
    # The search ends with a part of the barrier left; of the gain that costs the square.
    assert np.abs(proposal.step - exact).max() < 1e-2 * np.abs(exact).max()
    assert proposal.change == pytest.approx(0.5 * float(given.linear @ exact), rel=1e-3)


def test_violated_wall_is_left() -> None:
    given = problem(inside=False, pairs=4)
    before = given.objective.design(given.chi)
    proposal = given.solve()
    assert proposal is not None
    after = given.objective.design(given.chi + proposal.step)
    assert before.terms["C_chi"].value > 1e4
    assert after.terms["C_chi"].value < 0.1 * before.terms["C_chi"].value


@pytest.mark.parametrize("share", [0.5, 0.05])
def test_search_stays_within_its_reach(share: float) -> None:
    given = problem(inside=True, pairs=2)
    free = given.solve()
    assert free is not None
    reach = share * float(np.abs(free.step).max())
    held = given.solve(reach=reach)
    assert held is not None
    assert 0.9 * reach < np.abs(held.step).max() <= reach
    assert free.change < held.change < 0.5 * share * free.change, "a shorter step along the same way does as well"


def test_step_along_the_passive_region_is_as_good_as_a_long_descent_finds() -> None:
    """Designs that touch C_χ everywhere: Newton's method with the wall where it stands moves a thousandth as far."""
    given = problem(inside=False, pairs=4)
    design = given.objective.design
    first = given.solve()
    assert first is not None
    chi = given.chi + first.step
    touching = replace(given, chi=chi, linear=given.linear - design.smooth(chi).gradient)
    proposal = touching.solve()
    assert proposal is not None
    found = minimize(
        lambda s: (touching.value(s), touching.gradient(s)),
        proposal.step,
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": 400, "maxfun": 1000},
    )
    assert np.abs(design.passive.room(chi + proposal.step)).min() < 1e-3, "the bound must hold somewhere"
    assert proposal.change < 0.9 * float(found.fun)


def pressed(pull: float) -> Problem:
    """A design that touches C_χ everywhere, pulled further outwards by a force."""
    given = problem(inside=False, pairs=4)
    design, first = given.objective.design, given.solve()
    assert first is not None
    chi = given.chi + first.step
    outwards = -pull * design.from_points(np.ones_like(design.points.volumes))
    return replace(given, chi=chi, linear=outwards - design.smooth(chi).gradient)


@pytest.mark.parametrize("pull", [1e-4, 1e-3])
def test_design_that_touches_the_passive_region_is_in_balance(pull: float) -> None:
    """C_χ is so steep that 1e-8 short of its bound nothing holds a design; the solution leans into it."""
    given = pressed(pull)
    design = given.objective.design
    proposal = given.solve()
    assert proposal is not None
    over = -design.passive.room(given.chi + proposal.step)
    leaning = (over > 0.0) & (over < 1e-3)
    assert leaning.sum() > 10
    push = design.from_points(design.passive.weight * np.maximum(over, 0.0))
    left = given.norm.dual_norm(given.gradient(proposal.step))
    assert left < 1e-6 * given.norm.dual_norm(push), "the wall's force must be that of the design's own"


@pytest.mark.parametrize("pull", [3e-5, 1e-4])
def test_design_between_bounds_from_both_sides_is_in_balance(pull: float) -> None:
    """A ball that stays solid is pulled to void, one that stays void to solid: the active set of both is exact."""
    domain = half_cylinder(4, 2, 5)
    balls: list[tuple[Kind, tuple[float, ...]]] = [("solid", (7.0, 9.5, 0.0)), ("void", (7.0, 0.0, 12.0))]
    regions = Regions(domain, [Region(kind, Sphere(np.array(centre), 4.0)) for kind, centre in balls])
    objective = small_objective(domain, regions=regions)
    design, norm = objective.design, metric_of(objective)
    passive, curvature = design.passive, Curvature(norm, 1e-2 / norm.volume)
    assert passive.lower is not None
    force = pull * design.from_points((passive.lower > 0.0) * 1.0 - (passive.upper < 0.0))
    lower, upper = regions.all_bounds(INTERFACE_WIDTH)
    # A little beyond the bounds of both.
    chi = np.where(lower > 0.0, lower - 0.05, np.where(upper < 0.0, upper + 0.05, start_of(domain)))
    for _ in range(6):
        linear = force - design.smooth(chi).gradient
        given = Problem(objective, norm, chi, linear, curvature, 1e-3 * norm.upper)
        proposal = given.solve()
        assert proposal is not None
        chi = chi + proposal.step
    for room in passive.rooms(chi):
        assert room is not None
        assert (room < 0.0).sum() > 10
        assert room.min() > -1e-6
    slope, _ = passive.derivatives(chi)
    left = norm.dual_norm(given.gradient(proposal.step))
    assert left < 1e-6 * norm.dual_norm(design.from_points(slope)), "the walls' force must be the design's own"
    assert proposal.value == pytest.approx(design.value(chi), rel=1e-12)


def test_little_gain_is_had_without_the_active_set() -> None:
    """But the gradient of C_χ is left undetermined: only the exact solution is one to a tenth of it."""
    given = pressed(1e-4)
    before = given.solve()
    assert before is not None
    linear = given.linear + given.matrix() @ before.step + 1e-4 * np.cos(np.arange(len(given.chi)))
    given = replace(given, chi=given.chi + before.step, linear=linear)
    full, short = given.objective.equilibrium.vertex_solver(), given.objective.equilibrium.vertex_solver()
    expected, found = given.solve(solver=full), given.solve(exact=False, solver=short)
    assert expected is not None
    assert found is not None
    assert expected.change <= found.change < 0.999 * expected.change
    assert short.statistics.factorisations < full.statistics.factorisations
    left, undetermined = (given.norm.dual_norm(given.gradient(each.step)) for each in (expected, found))
    assert left < 0.1 * undetermined


def test_no_bound_without_a_weight() -> None:
    given = problem(inside=True, pairs=3)
    _, load, objective = parameters(passive_weight=0.0)
    terms = Terms(given.objective.discretisation, coefficients(), load, objective)
    free = total_objective([terms], [1.0], given.objective.design.gather).design
    subproblem = Subproblem(free, given.objective.equilibrium.vertex_solver(), given.norm)
    proposal = subproblem.solve(given.chi, free.value(given.chi), given.linear, given.curvature, given.quadratic, FAR)
    bounded = given.solve()
    assert proposal is not None
    assert bounded is not None
    assert proposal.change == pytest.approx(bounded.change, rel=1e-3)


def test_no_step_where_nothing_is_to_be_gained() -> None:
    given = problem(inside=True, pairs=2)
    balanced = -given.objective.design(given.chi).gradient
    proposal = replace(given, linear=balanced).solve()
    assert proposal is None or proposal.change > -1e-12


def test_curvature_of_which_digits_are_lost_is_no_matter_for_the_user() -> None:
    hard = problem(inside=True, pairs=1)
    s = np.random.default_rng(3).standard_normal(hard.norm.size)
    hard.curvature.learn(s, 1e20 * (hard.norm @ s) / hard.norm.volume)
    found = hard.solve()  # no warning, which would be an error here
    assert found is not None
    assert found.change < 0.0
