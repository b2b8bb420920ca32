"""The half cylinder: sizes, numbering, boundaries, refinement and prolongation."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skfem import Basis, ElementHex1, FacetBasis, Functional

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import HEX_OFFSETS

RADIUS, LENGTH = 15.0, 12.0
COARSE = HalfCylinder(RADIUS, LENGTH, 3, 2, 4)


@Functional
def one(w):
    return 1.0 + 0.0 * w.x[0]


def volume(domain: HalfCylinder) -> float:
    return float(one.assemble(Basis(domain.mesh, ElementHex1(), intorder=3)))


def area(domain: HalfCylinder, facets: NDArray[np.int64]) -> float:
    return float(one.assemble(FacetBasis(domain.mesh, ElementHex1(), facets=facets, intorder=3)))


def end_facets(domain: HalfCylinder, x1: float) -> NDArray[np.int64]:
    return domain.mesh.facets_satisfying(lambda x: np.isclose(x[0], x1), boundaries_only=True)


def test_paper_mesh_has_the_paper_counts() -> None:
    domain = HalfCylinder(15.0, 15.0, 12, 5, 18)
    assert domain.section_cells == 528
    assert domain.mesh.nelements == 18 * 528 == 9504
    assert domain.mesh.nvertices == len(domain.points) == 10830
    assert domain.nodes.shape == (41933, 3)
    assert domain.node_cells.shape == (9504, 20)


@pytest.mark.parametrize("sizes", [(1, 1, 1), (2, 3, 1), (5, 1, 2)])
def test_counts_follow_the_formula(sizes: tuple[int, int, int]) -> None:
    m, k, layers = sizes
    domain = HalfCylinder(RADIUS, LENGTH, m, k, layers)
    assert domain.mesh.nelements == layers * 2 * (m**2 + 2 * m * k)
    assert domain.mesh.nvertices == domain.section_points * (layers + 1)
    assert len(np.unique(domain.points, axis=0)) == domain.mesh.nvertices


@pytest.mark.parametrize("sizes", [(1, 1, 1), (6, 2, 9), (12, 5, 3), (3, 12, 2), (20, 1, 1), (200, 1, 1)])
def test_jacobians_are_positive_at_all_corners(sizes: tuple[int, int, int]) -> None:
    domain = HalfCylinder(RADIUS, LENGTH, *sizes)
    jacobians = domain.mesh.mapping().detDF(HEX_OFFSETS.T.astype(float))
    assert jacobians.shape == (domain.mesh.nelements, 8)
    assert jacobians.min() > 0.0


def test_cells_of_the_paper_mesh_are_well_shaped() -> None:
    jacobians = HalfCylinder(15.0, 15.0, 12, 5, 18).mesh.mapping().detDF(HEX_OFFSETS.T.astype(float))
    assert (jacobians.min(axis=1) / jacobians.max(axis=1)).min() > 0.7
    assert jacobians.max() / jacobians.min() < 3.5


def test_volume_and_areas_are_those_of_the_inscribed_prism_and_converge_to_the_cylinder() -> None:
    exact = np.array([np.pi * RADIUS**2 * LENGTH / 2, np.pi * RADIUS * LENGTH, np.pi * RADIUS**2 / 2])
    errors = []
    for factor in (1, 2, 4):
        domain = COARSE.refined(factor)
        wedges = 4 * domain.core_cells
        prism_end = 0.5 * wedges * RADIUS**2 * np.sin(np.pi / wedges)
        prism_wall = wedges * 2.0 * RADIUS * np.sin(0.5 * np.pi / wedges) * LENGTH
        found = np.array(
            [volume(domain), area(domain, domain.outside.facets), area(domain, end_facets(domain, LENGTH))]
        )
        np.testing.assert_allclose(found, [prism_end * LENGTH, prism_wall, prism_end], rtol=1e-12)
        np.testing.assert_allclose(area(domain, end_facets(domain, 0.0)), prism_end, rtol=1e-12)
        errors.append(1.0 - found / exact)
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(rates > 1.95)
    assert np.all(np.array(errors[-1]) < 1e-3)


def test_boundary_sets_cover_the_boundary_once() -> None:
    mesh = COARSE.mesh
    plane = mesh.facets_satisfying(lambda x: np.isclose(x[1], 0.0), boundaries_only=True)
    parts = [COARSE.outside.facets, end_facets(COARSE, 0.0), end_facets(COARSE, LENGTH), plane]
    np.testing.assert_array_equal(np.sort(np.concatenate(parts)), np.sort(mesh.boundary_facets()))
    np.testing.assert_allclose(area(COARSE, plane), 2.0 * RADIUS * LENGTH, rtol=1e-12)


def test_node_sets_lie_where_they_should() -> None:
    nodes = COARSE.nodes
    np.testing.assert_array_equal(nodes[: COARSE.mesh.nvertices], COARSE.points)
    for found, distance in (
        (COARSE.fixed.nodes, nodes[:, 0]),
        (COARSE.tip.nodes, nodes[:, 0] - LENGTH),
        (COARSE.symmetry.nodes, nodes[:, 1]),
    ):
        np.testing.assert_array_equal(found, np.flatnonzero(np.abs(distance) < 1e-9))
    on_wall = np.abs(np.hypot(*COARSE.points.T[1:]) - RADIUS) < 1e-9
    np.testing.assert_array_equal(np.sort(COARSE.outside.vertices), np.flatnonzero(on_wall))


@pytest.mark.parametrize("factor", [2, 3])
def test_refinement_is_nested_and_on_the_cylinder(factor: int) -> None:
    fine = COARSE.refined(factor)
    assert fine.mesh.nelements == factor**3 * COARSE.mesh.nelements
    distance, _ = cKDTree(fine.points).query(COARSE.points)
    assert distance.max() < 1e-12
    radii = np.hypot(*fine.points[fine.outside.vertices].T[1:])
    np.testing.assert_allclose(radii, RADIUS, rtol=1e-14)


def test_prolongation_by_two_is_trilinear_in_every_cell() -> None:
    """scikit-fem's own midpoint refinement gives the same trilinear values at the same reference points."""
    mesh = COARSE.mesh
    field = np.random.default_rng(3).normal(size=mesh.nvertices)

    def at_midpoints(values: Floats) -> Floats:
        parts = [values, values[mesh.edges].mean(0), values[mesh.facets].mean(0), values[mesh.t].mean(0)]
        return np.concatenate(parts)

    expected_points = np.stack([at_midpoints(x) for x in mesh.p], axis=1)
    prolongation = COARSE.prolongation(2)
    fine = COARSE.refined(2)
    assert prolongation.shape == (fine.mesh.nvertices, mesh.nvertices) == (len(expected_points), mesh.nvertices)
    distance, match = cKDTree(expected_points).query(prolongation @ COARSE.points)
    assert distance.max() < 1e-12
    np.testing.assert_allclose(prolongation @ field, at_midpoints(field)[match], atol=1e-13)
    # The exact geometry differs from the trilinear one only by the curvature of the section.
    assert np.abs(prolongation @ COARSE.points - fine.points).max() < 0.02 * RADIUS


@pytest.mark.parametrize("factor", [1, 2, 5])
def test_prolongation_keeps_constants_and_linear_functions_of_x1(factor: int) -> None:
    prolongation, fine = COARSE.prolongation(factor), COARSE.refined(factor)
    np.testing.assert_allclose(prolongation.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(prolongation @ COARSE.points[:, 0], fine.points[:, 0], atol=1e-13)
    assert prolongation.min() >= 0.0


@pytest.mark.parametrize("sizes", [(0.0, 1.0, 1, 1, 1), (1.0, -1.0, 1, 1, 1), (1.0, 1.0, 0, 1, 1), (1.0, 1.0, 1, 1, 0)])
def test_sizes_must_be_positive(sizes: tuple[float, float, int, int, int]) -> None:
    with pytest.raises(ValueError, match="must be"):
        HalfCylinder(*sizes)


def test_refinement_factor_must_be_positive() -> None:
    with pytest.raises(ValueError, match="factor"):
        COARSE.refined(0)
