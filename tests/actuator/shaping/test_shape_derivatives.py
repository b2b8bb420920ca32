"""Shape derivatives of an inflated body by Taylor's formula: what is left after the first term falls as the square."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import PRECISE, half_tube, inflated, inflation, material, whole_tube
from physics import parameters

from actuator.arrays import Floats
from actuator.body.inflation import Inflation
from actuator.body.mesh import BodyMesh
from actuator.body.meshing import opening_of
from actuator.material.laws.ogden import Ogden
from actuator.parameters import Material
from actuator.shaping.derivatives import Functional, main_objective, opening_by_shape, shape_gradient, strain_aggregate
from actuator.solve.path import correct
from actuator.terms.goals.bending import PAPER_GOAL

LOAD = replace(parameters()[1], arm_length=60.0)
LIMIT = 0.5 * material().shear * 0.02
MESHES = {"half": half_tube(5, 3, 1), "whole": whole_tube(5, 3, 1)}


def functionals(problem: Inflation, z: Floats) -> dict[str, Functional]:
    weight = 1.0 + np.arange(len(problem.mesh.cells)) % 3
    return {
        "travel": main_objective(problem, z, PAPER_GOAL, LOAD),
        "strain": strain_aggregate(problem, z, 1.0, limit=LIMIT, power=4.0, weight=weight),
    }


def motion(mesh: BodyMesh, seed: int = 0) -> Floats:
    """A smooth motion of all nodes that keeps the planes of plates and symmetry, (n_nodes, 3), about 1 mm."""
    rng = np.random.default_rng(seed)
    x = mesh.nodes
    theta = sum(
        rng.normal(size=3) * np.sin(x @ rng.normal(scale=0.2, size=(3, 3)).T + rng.normal(size=3)) for _ in "ab"
    )
    theta[:, 0] *= np.sin(np.pi * x[:, 0] / mesh.length)
    theta[np.concatenate([mesh.fixed, mesh.tip]), 0] = 0.0
    if mesh.half:
        theta[:, 1] *= np.tanh(x[:, 1])
    return np.asarray(theta)


def moved(mesh: BodyMesh, by: Floats) -> BodyMesh:
    nodes = mesh.nodes + by
    return replace(mesh, nodes=nodes, opening=opening_of(nodes, mesh.walls, mesh.length))


@pytest.mark.parametrize("mixed", [True, False], ids=["mixed", "plain"])
@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
@pytest.mark.parametrize("name", ["travel", "strain"])
def test_taylor(mesh: BodyMesh, mixed: bool, name: str) -> None:
    assert_taylor(mesh, name, mixed=mixed)


def test_taylor_of_another_law() -> None:
    assert_taylor(MESHES["half"], "strain", replace(material(), law=Ogden.of([0.6, 0.4], [2.0, -1.5])))


def assert_taylor(mesh: BodyMesh, name: str, stuff: Material | None = None, mixed: bool | None = None) -> None:
    problem = inflation(mesh, stuff, mixed=mixed)
    z = inflated(problem).z
    problem.linearise(z, 1.0, fresh=True)
    there = functionals(problem, z)[name]
    theta = motion(mesh)
    slope = float(np.sum(shape_gradient(problem, z, 1.0, there) * theta))

    def left(step: float) -> float:
        other = inflation(moved(mesh, step * theta), stuff, mixed=mixed)
        state, _, _ = correct(other, z, 1.0, None, replace(PRECISE, tolerance=1e-11))
        return abs(functionals(other, state)[name].value - there.value - step * slope)

    steps = 0.05 * 0.5 ** np.arange(3)
    rests = np.array([left(step) for step in steps])
    rates = np.log2(rests[:-1] / rests[1:])
    assert rates.min() > 1.9, (rests, slope)


def test_the_opening_changes_as_its_derivative_says() -> None:
    """The area is a quadratic, of which central differences are exact."""
    for mesh in MESHES.values():
        theta = motion(mesh, seed=1)
        ends = [opening_of(mesh.nodes + side * theta, mesh.walls, mesh.length) for side in (1.0, -1.0)]
        assert 0.5 * (ends[0] - ends[1]) == pytest.approx(float(np.sum(opening_by_shape(mesh) * theta)), rel=1e-12)
