"""The finish: a part comes nearer to its strain limit, and what is said of it is what `inflate` says."""

from __future__ import annotations

import numpy as np
import pytest

import poro
from actuator.failure import NotInflatable
from stages import finish, inflate, refine
from stages.events import Event, FinishStep

#: Thick walls that bend a little: the strain limit is a part of what the paper's design has.
CASE = poro.make_case(
    domain={"core_cells": 4, "rings": 2, "layers": 6},
    objective={"strain_limit": 0.02},
    load={"pressure_ratio": 0.02},
    finish={"method": "strain", "steps": 2, "size": 4.0, "share": 0.01, "wall": 2.0},
)
DOMAIN = CASE.domain.build()
FINE = refine.run(DOMAIN, DOMAIN.initial_design(DOMAIN.points, 3.0), CASE.refine)


@pytest.fixture(scope="module")
def steps() -> list[FinishStep]:
    return []


@pytest.fixture(scope="module")
def found(steps: list[FinishStep]) -> finish.Result:
    def observe(event: Event) -> None:
        if isinstance(event, FinishStep):
            steps.append(event)

    return poro.finish(CASE, FINE, threads=1, observer=observe)


def test_the_part_comes_nearer_to_its_limit(found: finish.Result, steps: list[FinishStep]) -> None:
    ratio = found.history["energy_ratio"]
    assert len(ratio) == len(steps) == CASE.finish.steps + 1
    assert ratio[0] > 1.2
    assert ratio[found.chosen] < 0.95 * ratio[0]
    assert found.history["share_above"][found.chosen] < found.history["share_above"][0]


def test_it_says_of_the_first_part_what_inflate_says(found: finish.Result) -> None:
    solid = poro.mirror(CASE, FINE)
    settings = CASE.inflate.model_copy(update={"size": CASE.finish.size, "max_load": 1.0})
    at = inflate.run(solid.vertices, solid.triangles, CASE.optimize, settings).summary["at_target"]
    assert found.history["travel"][0] == pytest.approx(-at["elongation"], rel=1e-3)
    assert found.history["share_above"][0] == pytest.approx(at["share_above"], rel=0.05)


def test_walls_and_the_passive_core_are_kept(found: finish.Result) -> None:
    wall, ratio = (found.history[name][found.chosen] for name in ("wall", "energy_ratio"))
    assert wall > 0.9 * CASE.finish.wall
    assert found.kept == (ratio <= 1.0 and wall >= CASE.finish.wall)
    bound = DOMAIN.refined(CASE.refine.factor).passive_bound(found.domain.points, 3.0)
    assert (found.chi <= np.maximum(bound, FINE.chi) + 1e-12).all()


def test_a_limit_that_is_kept_leaves_room_for_travel() -> None:
    case = poro.with_changes(CASE, {"objective.strain_limit": 0.5, "finish.steps": 1})
    found = poro.finish(case, FINE, threads=1)
    assert (found.history["energy_ratio"] < 1.0).all()
    assert found.chosen == 1
    assert found.history["C0"][1] < found.history["C0"][0]


def test_without_a_method_nothing_is_touched() -> None:
    case = poro.with_changes(CASE, {"finish.method": None})
    found = poro.finish(case, FINE)
    assert found.chi is FINE.chi
    assert finish.pack(found).summary == {"method": None}


def test_a_design_that_leaks_is_refused() -> None:
    x, _, height = FINE.domain.points.T
    holed = np.where((np.abs(x - 7.5) < 3.0) & (height > 4.0), -1.0, FINE.chi)
    with pytest.raises(NotInflatable, match="no chamber"):
        finish.run(FINE.domain, holed, CASE.optimize, CASE.finish)


def test_an_interrupted_finish_keeps_its_best_part() -> None:
    def interrupt(event: Event) -> None:
        if isinstance(event, FinishStep) and event.record["step"] == 1:
            raise KeyboardInterrupt

    found = poro.finish(CASE, FINE, threads=1, observer=interrupt)
    assert not found.finished
    assert len(found.history["step"]) == 2
    assert "interrupted" in finish.shortfall(finish.pack(found).summary, "a.finished.h5")
