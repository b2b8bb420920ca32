"""Quadratic tetrahedra near the incompressible limit: what the plain form carries, and what the mixed one.

A thin tube that bends and bulges, two cells through the wall: the plain form is the stiffer one, by a few percent at
0.48, by twice as much at 0.4999.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from bodies import between_plates, inflated, inflation, material, sector

from actuator.solve.path import Control

EASY = Control(first=1.0, largest=1.0, tolerance=1e-8)


@cache
def response(cells: int, poisson_ratio: float, mixed: bool) -> tuple[float, float]:
    """By how much the chamber grows, mm³, and travel, mm, with so many cells through the wall."""
    tube = sector(np.pi, np.linspace(5.0, 7.0, cells + 1), 15.0, 4 * cells, 4 * cells, 0.7)
    mesh = between_plates(*tube, 15.0)
    problem = inflation(mesh, material(poisson_ratio), mixed=mixed, stiffness=1e-3, pressure=0.03)
    state = problem.state(inflated(problem, 1.0, EASY).z, 1.0)
    return state.volume - problem.state(problem.rest, 0.0).volume, problem.arm.elongation(state.motion)


def test_both_forms_agree_at_the_papers_ratio() -> None:
    apart = {}
    for cells in (1, 2):
        plain, mixed = (response(cells, 0.48, form) for form in (False, True))
        apart[cells] = [a / b - 1.0 for a, b in zip(plain, mixed, strict=True)]
    assert max(map(abs, apart[2])) < 0.03
    assert max(map(abs, apart[2])) < 0.5 * max(map(abs, apart[1]))


def test_only_the_mixed_form_is_soft_enough_close_to_the_limit() -> None:
    fine, _ = response(3, 0.4999, True)
    short = {mixed: 1.0 - response(2, 0.4999, mixed)[0] / fine for mixed in (False, True)}
    assert 0.0 < short[True] < 0.03
    assert short[False] > 2.5 * short[True]


def test_the_form_is_chosen_by_poissons_ratio() -> None:
    mesh = between_plates(*sector(np.pi, np.array([5.0, 7.0]), 15.0, 4, 2), 15.0)
    assert [inflation(mesh, material(nu)).mixed for nu in (0.3, 0.45, 0.48, 0.4999)] == [False, False, True, True]
