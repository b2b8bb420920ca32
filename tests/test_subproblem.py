"""The subproblem of a Newton step: stationary where it says, exact walls, low rank as if it were dense."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from physics import Floats
from small_case import metric_of, small_objective, start_of

from actuator.optimiser.curvature import Curvature
from actuator.optimiser.metric import Metric
from actuator.optimiser.subproblem import Proposal, Subproblem
from actuator.reduced import ReducedObjective

FAR = 1e3


@dataclass(frozen=True)
class Problem:
    objective: ReducedObjective
    norm: Metric
    chi: Floats
    linear: Floats
    curvature: Curvature
    quadratic: Floats

    def solve(self, reach: float = FAR) -> Proposal | None:
        subproblem = Subproblem(self.objective.design, self.objective.equilibrium.design_solver, self.norm)
        at = self.objective.design(self.chi)
        return subproblem.solve(self.chi, at, self.linear, self.curvature, self.quadratic, reach)

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
    there = given.objective.design(given.chi + proposal.step)
    assert proposal.design.value == there.value


@pytest.mark.parametrize("pairs", [0, 5])
def test_far_from_all_walls_it_is_a_linear_system(pairs: int) -> None:
    given = problem(inside=True, pairs=pairs)
    proposal = given.solve()
    assert proposal is not None
    assert given.objective.design(given.chi).passive == given.objective.design(given.chi).slope == 0.0
    exact = np.linalg.solve(given.matrix(), -given.linear)
    assert np.abs(proposal.step - exact).max() < 1e-3 * np.abs(exact).max()


def test_violated_wall_is_left() -> None:
    given = problem(inside=False, pairs=4)
    before = given.objective.design(given.chi)
    proposal = given.solve()
    assert proposal is not None
    assert before.passive > 1e4
    assert proposal.design.passive < 1e-3 * before.passive


def test_search_ends_beyond_its_reach() -> None:
    given = problem(inside=False, pairs=0)
    given = replace(given, quadratic=1e-3 * given.quadratic)
    free, held = given.solve(), given.solve(reach=0.5)
    assert free is not None
    assert held is not None
    assert 0.5 < np.abs(held.step).max() <= 1.5
    assert free.change < held.change < 0.0


def test_no_step_where_nothing_is_to_be_gained() -> None:
    given = problem(inside=True, pairs=2)
    balanced = -given.objective.design(given.chi).gradient
    proposal = replace(given, linear=balanced).solve()
    assert proposal is None or proposal.change > -1e-12
