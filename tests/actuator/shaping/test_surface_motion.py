"""The surface moves with χ as it should, and so do the figures of a part that is meshed anew."""

from __future__ import annotations

import numpy as np
import pytest

import poro
from actuator.body.element import points_of
from actuator.body.inflation import Inflation
from actuator.body.mesh import BodyMesh
from actuator.geometry.distance import distance
from actuator.shaping.bounds import widths
from actuator.shaping.derivatives import main_objective, shape_gradient, strain_aggregate
from actuator.shaping.metric import Metric
from actuator.shaping.motion import SurfaceMotion
from actuator.shaping.part import part_of
from actuator.solve.path import Control, begin, follow
from actuator.terms.goals.bending import PAPER_GOAL

CASE = poro.make_case(domain={"core_cells": 8, "rings": 4, "layers": 12})
DOMAIN = CASE.domain.build()
TETRAHEDRA = DOMAIN.tetrahedra()
MATERIAL, LOAD, _ = CASE.optimize.parameters()
RADIUS = np.hypot(DOMAIN.points[:, 1], DOMAIN.points[:, 2])
#: A tube whose bore lies off its axis, so that it bends: χ changes by 1 per mm.
CHI = np.minimum(np.hypot(DOMAIN.points[:, 1], DOMAIN.points[:, 2] - 3.0) - 6.0, 13.0 - RADIUS)
SIZE = 3.0


@pytest.fixture(scope="module")
def metric() -> Metric:
    return Metric(DOMAIN, 2.0, threads=1)


def inflation_of(mesh: BodyMesh) -> Inflation:
    return Inflation(
        mesh, MATERIAL, pressure=LOAD.pressure, reach=LOAD.arm_length, stiffness=LOAD.spring_stiffness, threads=1
    )


def inflated(chi: np.ndarray) -> tuple[Inflation, np.ndarray]:
    inflation = inflation_of(part_of(DOMAIN, TETRAHEDRA, chi, 0.0, SIZE).mesh)
    control = Control(first=0.5, largest=1.0)
    *_, last = follow(inflation, begin(inflation, inflation.rest, 0.0, control), 1.0, control)
    return inflation, last.z


def values(inflation: Inflation, z: np.ndarray) -> list:
    weight = np.ones(len(inflation.mesh.cells))
    aggregate = strain_aggregate(inflation, z, 1.0, limit=1e-3, power=2.0, weight=weight)
    return [main_objective(inflation, z, PAPER_GOAL, LOAD), aggregate]


def test_the_surface_moves_with_chi(metric: Metric) -> None:
    before = part_of(DOMAIN, TETRAHEDRA, CHI, 0.0, SIZE)
    motion = SurfaceMotion(
        DOMAIN, TETRAHEDRA, metric.slope(CHI), before.mesh, points_of(before.mesh.nodes, before.mesh.cells)
    )
    change = 0.2 + 0.02 * DOMAIN.points[:, 0]
    after = part_of(DOMAIN, TETRAHEDRA, CHI + change, 0.0, SIZE)
    places = before.mesh.nodes[motion.nodes]
    moved = places + motion.along_normal(change)[:, None] * motion.outward
    inner = (places[:, 0] > 1.0) & (places[:, 0] < 14.0)
    assert distance(places[inner], after.surface).min() > 0.15
    assert distance(moved[inner], after.surface).max() < 0.1


def test_figures_change_as_their_derivatives_by_chi_say(metric: Metric) -> None:
    """Central differences over remeshing, which leaves an error of the mesh."""
    inflation, z = inflated(CHI)
    inflation.linearise(z, 1.0, fresh=True)
    motion = SurfaceMotion(DOMAIN, TETRAHEDRA, metric.slope(CHI), inflation.mesh, inflation.points)
    direction = np.where(RADIUS > 9.5, 1.0, 0.0)
    by_motion = [motion.by_normal_motion(shape_gradient(inflation, z, 1.0, each)) for each in values(inflation, z)]
    slopes = [float(motion.by_chi(each) @ direction) for each in by_motion]
    step = 0.2
    ends = [[each.value for each in values(*inflated(CHI + side * step * direction))] for side in (1.0, -1.0)]
    differences = (np.array(ends[0]) - np.array(ends[1])) / (2.0 * step)
    np.testing.assert_allclose(slopes, differences, rtol=0.1)


def test_smooth_gradients_are_gradients(metric: Metric) -> None:
    """They point where the derivative grows, and are the same for derivatives that differ from node to node only."""
    rng = np.random.default_rng(0)
    rough = rng.normal(size=len(CHI))
    assert rough @ metric.gradient(rough) > 0.0
    one, other = rng.normal(size=(2, len(CHI)))
    assert one @ metric.gradient(other) == pytest.approx(other @ metric.gradient(one), rel=1e-9)
    slope = metric.slope(DOMAIN.points @ np.array([1.0, -2.0, 3.0]))
    np.testing.assert_allclose(slope, np.tile([1.0, -2.0, 3.0], (len(CHI), 1)), atol=1e-9)


def test_walls_and_gaps() -> None:
    part = part_of(DOMAIN, TETRAHEDRA, CHI, 0.0, SIZE)
    places = np.array([[7.0, 0.01, 9.0], [7.0, 0.01, -3.0]])
    found = widths(part.surface, places, np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]))
    np.testing.assert_allclose(found.wall, [4.0, 10.0], atol=0.1)
    np.testing.assert_allclose(found.gap, 12.0, atol=0.1)
    held = found.held(np.array([1.0, -1.0]), 5.0, 0.0, 0.5)
    np.testing.assert_allclose(held, [0.0, -1.0])
    np.testing.assert_allclose(found.lack(5.0, 1.0, 1.0), [1.0, 0.0], atol=0.1)
    np.testing.assert_allclose(found.lack(5.0, 11.5, 1.0), [0.5, 0.0], atol=0.1)  # half of it in a narrow gap
