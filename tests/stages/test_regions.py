"""Regions in a case of another size: a similar case has the same design, and a body from a file scales with it."""

from __future__ import annotations

import numpy as np
from shapes import block, surface

from actuator.geometry.zero_set import Surface
from pipeline.case.model import case_type
from stages import optimize

BODY = surface(block(6.0, 6.0, 6.0, 7.0, 9.0, 0.0))


def first_design(size: float) -> optimize.Result:
    """With no design update, all lengths of the case multiplied by a number."""
    case = case_type().model_validate(
        {
            "domain": {"radius": 15.0 * size, "length": 15.0 * size, "core_cells": 3, "rings": 2, "layers": 4},
            "objective": {"interface_width": 3.0 * size, "length_unit": size},
            "optimizer": {"max_updates": 0},
            "regions": [
                {"kind": "solid", "shape": "file", "file": "given"},
                {
                    "kind": "void",
                    "shape": "cylinder",
                    "start": [0.0, 0.0, 9.0 * size],
                    "end": [4.0 * size, 0.0, 9.0 * size],
                    "radius": 3.0 * size,
                },
            ],
        }
    )
    return optimize.run(case.optimize, bodies={0: Surface(size * BODY.vertices, BODY.triangles)})


def test_similar_cases_have_the_same_design() -> None:
    one, other = first_design(1.0), first_design(2.0)
    np.testing.assert_allclose(other.chi, one.chi, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(other.summary["C"], one.summary["C"], rtol=1e-6)
    assert one.summary["solid_missing"] == 0.0
    inside = np.abs(one.domain.points - [7.0, 9.0, 0.0]).max(axis=1) < 2.5
    assert inside.any()
    assert (one.chi[inside] > 0.0).all()
