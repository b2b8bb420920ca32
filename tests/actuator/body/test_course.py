"""What a path adds up to: the work of the air is what body and spring store, and the arm's plate is in balance."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import half_tube, imbalance, inflation, material, whole_tube

from actuator.body.mesh import BodyMesh
from actuator.solve.path import Control, begin, follow
from stages.inflation import Course
from stages.settings import ProblemSettings

#: As far and in as many steps as the stage goes by default.
LOADS = np.linspace(0.0, 1.5, 7)[1:]
MESHES = {"half": half_tube(4, 2, 1), "whole": whole_tube(4, 2, 1)}


def course_of(mesh: BodyMesh, *, mixed: bool):
    stiffness = 0.02 if mesh.half else 0.04
    stuff = material(0.4999 if mixed else 0.48)
    problem = inflation(mesh, stuff, mixed=mixed, pressure=0.06, stiffness=stiffness)
    control = Control(first=LOADS[0], largest=1.0, tolerance=1e-9)
    course = Course(mesh, ProblemSettings(), 1.0)
    here = begin(problem, problem.rest, 0.0, control)
    course.add(problem, here)
    for point in follow(problem, here, LOADS[-1], control, stops=LOADS.tolist()):
        course.add(problem, point, stored=point.load in LOADS)
    return problem, course


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize("kind", MESHES)
def test_work_is_stored_and_the_plate_is_in_balance(kind: str, mixed: bool) -> None:
    problem, course = course_of(MESHES[kind], mixed=mixed)
    whole = 2.0 if kind == "half" else 1.0
    assert len(course.records) == 1 + len(LOADS)
    assert course.result().summary["energy_error"] < 1e-6
    for record in course.records[1:]:
        assert record["air_work"] == pytest.approx(record["stored_energy"], rel=1e-6)
        pull = np.array([record[f"arm_{name}"] for name in ("force_1", "force_3", "moment_2")])
        motion = np.array([record[name] for name in ("T1", "T3", "theta2")])
        left = imbalance(problem, motion, pull / whole, record["load_factor"])
        np.testing.assert_allclose(left, 0.0, atol=1e-6 * np.abs(pull).max())
        # The glue of the fixed plate carries what is left of the air's forces on the body and of the arm's.
        spring = record["spring_force"]
        assert record["fixed_force_3"] == pytest.approx(-spring, abs=1e-6 * abs(pull[0]))
        assert record["fixed_force_1"] == pytest.approx(
            record["load_factor"] * problem.pressure * whole * problem.arm.opening, rel=1e-6
        )


def test_a_half_says_what_the_whole_does() -> None:
    """Figures of the whole part, whichever of the two is meshed; the whole does not leave its plane of symmetry."""
    (_, half), (problem, whole) = (course_of(mesh, mixed=False) for mesh in MESHES.values())
    for one, other in zip(half.records, whole.records, strict=True):
        for name in set(one) - {"newton"}:
            assert one[name] == pytest.approx(other[name], rel=1e-7, abs=1e-9), name
    (one, _), (other, _) = (course.states[LOADS[-1]] for course in (half, whole))
    assert np.abs(one).max() == pytest.approx(np.abs(other).max(), rel=1e-7)
    aside = other[problem.mesh.nodes[:, 1] == 0.0, 1]
    np.testing.assert_allclose(aside, 0.0, atol=1e-8 * np.abs(other).max())
