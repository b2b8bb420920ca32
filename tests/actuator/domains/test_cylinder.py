"""The whole cylinder: its mesh is the half's and its mirror image, and so are its equations, terms and gradients."""

from __future__ import annotations

import numpy as np
import pytest
from small_case import metric_of

from actuator.arrays import Floats, Ints
from actuator.domains.cylinder import Cylinder
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.equations.discretisation import Discretisation
from actuator.geometry.whole import whole_boundary
from actuator.optimiser.stationarity import stationarity
from actuator.solve.reduced import ReducedObjective
from stages.domains import CylinderSettings, DomainSettings, HalfCylinderSettings
from stages.settings import ObjectiveSettings, ProblemSettings

SIZES = {"radius": 15.0, "length": 12.0, "core_cells": 3, "rings": 2, "layers": 3}
HALF, WHOLE = HalfCylinder(**SIZES), Cylinder(**SIZES)


def images(domain: Domain) -> Ints:
    """For every vertex its mirror image, found by its place to the last bit."""
    places = {tuple(place): number for number, place in enumerate(domain.points.tolist())}
    return np.array([places[x1, -x2 if x2 else x2, x3] for x1, x2, x3 in domain.points.tolist()])


def test_the_mesh_is_that_of_the_half_and_its_image_to_the_last_bit() -> None:
    upper = WHOLE.points[:, 1] >= 0.0
    np.testing.assert_array_equal(WHOLE.points[upper], HALF.points)
    assert WHOLE.mesh.nelements == 2 * HALF.mesh.nelements == CylinderSettings(**SIZES).cells
    cells = {frozenset(cell) for cell in WHOLE.cells.tolist()}
    assert {frozenset(cell) for cell in images(WHOLE)[WHOLE.cells].tolist()} == cells
    assert Discretisation(WHOLE).volume == pytest.approx(2.0 * Discretisation(HALF).volume, rel=1e-13)
    assert not len(WHOLE.symmetry.facets)
    assert len(WHOLE.outside.facets) == 2 * len(HALF.outside.facets)
    # The wall is drawn around both halves.
    outline = WHOLE.outline()
    assert np.hypot(*outline.T) == pytest.approx(15.0)
    assert len(np.unique(outline.round(9), axis=0)) == len(outline)


def test_finer_meshes_hold_the_coarse_one_and_symmetric_fields_stay_so() -> None:
    fine, weights = WHOLE.refined(2), WHOLE.prolongation(2)
    assert weights.shape == (len(fine.points), len(WHOLE.points))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-14)
    half = HALF.prolongation(2) @ np.arange(len(HALF.points), dtype=float)
    chi = np.empty(len(WHOLE.points))
    upper = WHOLE.points[:, 1] >= 0.0
    chi[upper] = np.arange(len(HALF.points))
    chi[images(WHOLE)[upper]] = chi[upper]
    finer = weights @ chi
    np.testing.assert_array_equal(finer[fine.points[:, 1] >= 0.0], half)
    np.testing.assert_array_equal(finer[images(fine)], finer)


def test_the_surface_of_a_symmetric_design_is_symmetric_to_the_last_bit() -> None:
    chi = WHOLE.initial_design(WHOLE.points, 3.0)
    surface, _, _ = whole_boundary(WHOLE, WHOLE.tetrahedra(), chi, 0.0)
    half, _, _ = whole_boundary(HALF, HALF.tetrahedra(), HALF.initial_design(HALF.points, 3.0), 0.0)
    assert len(surface.triangles) == len(half.triangles)
    places = {tuple(place) for place in np.abs(surface.vertices).tolist()}
    assert len(places) < 0.51 * len(surface.vertices) + 50
    mirrored = {(x1, -x2 + 0.0, x3) for x1, x2, x3 in (surface.vertices + 0.0).tolist()}
    assert mirrored == {tuple(place) for place in (surface.vertices + 0.0).tolist()}


def objective_of(domain: DomainSettings) -> ReducedObjective:
    """All terms of C at work: a low strain limit, and a leak that counts though the walls hold."""
    limits = ObjectiveSettings(strain_limit=0.04, strain_energy_shift="4/L_i", leak_weight=1e12)
    settings = ProblemSettings(domain=domain, objective=limits)
    tolerances = {"state_tolerance": 1e-12, "adjoint_tolerance": 1e-13}
    return ReducedObjective(settings.domain.build(), *settings.parameters(), **tolerances, threads=1)


def design(domain: Domain) -> Floats:
    """Half the initial design, which is too little void in the core, with a steep bump inside the upper wall."""
    inside = (np.abs(domain.points[:, 0] - 6.0) < 3.0) & (domain.points[:, 2] > 5.0)
    return 0.5 * domain.initial_design(domain.points, 3.0) + 12.0 * inside


def test_half_and_whole_have_the_same_terms_gradient_and_stationarity() -> None:
    found = []
    for settings in (HalfCylinderSettings(**SIZES), CylinderSettings(**SIZES)):
        objective = objective_of(settings)
        at = objective.evaluate(design(objective.domain))
        gradient = objective.gradient(at)
        found.append((at, gradient, stationarity(at, gradient, metric_of(objective))))
    (half, of_half, measure), (whole, of_whole, measure_of_whole) = found
    for term, value in half.terms.items():
        assert abs(value) > 1e-9, term
        assert whole.terms[term] == pytest.approx(value, rel=1e-9), term
    pairs = np.zeros(len(WHOLE.points))
    np.add.at(pairs, images(WHOLE), of_whole.total)
    upper = WHOLE.points[:, 1] > 0.0
    on_plane = WHOLE.points[:, 1] == 0.0
    summed = np.where(on_plane, of_whole.total, of_whole.total + pairs)[upper | on_plane]
    assert summed == pytest.approx(of_half.total, abs=1e-9 * np.abs(of_half.total).max())
    assert measure_of_whole == pytest.approx(measure, rel=1e-7)
