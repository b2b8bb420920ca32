"""Vertex fields of the half cylinder at points anywhere, those beyond the wall's facets included."""

from __future__ import annotations

import numpy as np
import pytest

from actuator.domains.half_cylinder import HalfCylinder
from actuator.geometry.sampling import MIRROR, sampled
from stages.datasets import vtk_order


def test_linear_fields_on_both_sides_and_beyond_the_facets() -> None:
    """On the cylinder between two vertices a point lies outside of all cells; it takes the facet's value."""
    domain = HalfCylinder(15.0, 15.0, 2, 1, 3)
    cells, slope = domain.cells[:, vtk_order()[:8]], np.array([0.3, -0.2, 0.5])
    fields = {"height": 7.0 + domain.points @ slope}
    angle, axial = np.meshgrid(np.linspace(-np.pi, np.pi, 41), [0.0, 3.7, 15.0])
    wall = np.stack([axial.ravel(), 15.0 * np.cos(angle.ravel()), 15.0 * np.sin(angle.ravel())], axis=1)
    scalars, vector = sampled(domain.points, cells, wall, fields, domain.points.copy(), mirrored=True)
    half = np.where(wall[:, 1:2] < 0.0, wall * MIRROR, wall)
    sagitta = 15.0 * (1.0 - np.cos(np.pi / 16.0))
    assert np.hypot(*(vector - wall).T[1:]).max() == pytest.approx(sagitta, rel=0.05)
    moved = np.where(wall[:, 1:2] < 0.0, vector * MIRROR, vector)
    np.testing.assert_allclose(scalars["height"], 7.0 + moved @ slope, rtol=1e-6)
    assert np.abs(moved - half).max() < 1.05 * sagitta
