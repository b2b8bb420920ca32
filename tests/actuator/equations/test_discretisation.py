"""Volumes, wall, shape functions and the energy of second derivatives, against closed forms and finite differences."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from physics import LENGTH, RADIUS, Floats, half_cylinder
from skfem import Basis, ElementHexS2, MeshHex

from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import HEX_OFFSETS
from actuator.equations.discretisation import Discretisation
from actuator.equations.quadrature import hexahedron_14

DOMAIN = half_cylinder(2, 2, 3)


@pytest.fixture(scope="module")
def discretisation() -> Discretisation:
    return Discretisation(DOMAIN)


def outline(domain: HalfCylinder) -> Floats:
    """Corners (X2, X3) of the section's wall, from the lowest to the highest."""
    wall = domain.points[domain.outside.vertices][domain.points[domain.outside.vertices, 0] == 0.0][:, 1:]
    return wall[np.argsort(wall[:, 1])]


# ----------------------------------------------------------------------------------------- volume and wall


def test_volume_is_that_of_the_inscribed_prism(discretisation: Discretisation) -> None:
    chords = 4 * DOMAIN.core_cells
    section = chords * 0.5 * RADIUS**2 * np.sin(np.pi / chords)
    assert discretisation.volume == pytest.approx(section * LENGTH, rel=1e-14)


def test_volume_tends_to_half_a_cylinder() -> None:
    fine = Discretisation(half_cylinder(24, 1, 1)).volume
    assert fine == pytest.approx(0.5 * np.pi * RADIUS**2 * LENGTH, rel=1e-3)


def test_wall_average_of_known_fields(discretisation: Discretisation) -> None:
    W, (x1, _, x3) = discretisation.wall_mass, DOMAIN.points.T
    one = np.ones_like(x1)
    assert one @ W @ one == pytest.approx(1.0, rel=1e-14)
    assert one @ W @ x1 == pytest.approx(LENGTH / 2.0, rel=1e-13)
    assert x1 @ W @ x1 == pytest.approx(LENGTH**2 / 3.0, rel=1e-13)
    # X3² over each chord (a, b) of equal length: (a² + a b + b²) / 3.
    squares = [(a * a + a * b + b * b) / 3.0 for a, b in pairwise(outline(DOMAIN)[:, 1])]
    assert x3 @ W @ x3 == pytest.approx(np.mean(squares), rel=1e-13)


def test_wall_matrix_sees_wall_vertices_only(discretisation: Discretisation) -> None:
    W = np.abs(discretisation.wall_mass.toarray())
    inside = np.setdiff1d(np.arange(len(W)), DOMAIN.outside.vertices)
    assert W[inside].max() < 1e-15 * W.max()
    assert W.diagonal()[DOMAIN.outside.vertices].min() > 1e-2 * W.max()


def test_mass_and_stiffness_of_linear_fields(discretisation: Discretisation) -> None:
    x1, slope = DOMAIN.points[:, 0], np.array([0.3, -0.7, 1.1])
    field, volume = DOMAIN.points @ slope, discretisation.volume
    assert x1 @ discretisation.mass @ np.ones_like(x1) == pytest.approx(volume * LENGTH / 2.0, rel=1e-13)
    assert field @ discretisation.stiffness @ field == pytest.approx(volume * slope @ slope, rel=1e-13)


# ------------------------------------------------------------------------------------------ shape functions


def test_shape_functions_reproduce_linear_fields_in_every_layer(discretisation: Discretisation) -> None:
    g, slope = discretisation.geometry, np.array([0.3, -0.7, 1.1])
    at_vertices, at_nodes = DOMAIN.points @ slope, DOMAIN.nodes @ slope
    gradient = np.einsum("eqai,ea->eqi", g.gradient[g.cell_class], at_vertices[g.cells])
    gradient20 = np.einsum("eqai,ea->eqi", g.gradient20[g.cell_class], at_nodes[g.node_cells])
    assert np.abs(gradient - slope).max() < 1e-13
    assert np.abs(gradient20 - slope).max() < 1e-13
    corners = DOMAIN.mesh.mapping().F(hexahedron_14()[0])  # (3, cell, q)
    values = np.einsum("qa,ea->eq", g.shape, at_vertices[g.cells])
    assert np.abs(values - np.einsum("icq,i->cq", corners, slope)).max() < 1e-12


def test_quadrature_points_are_those_of_the_first_layer(discretisation: Discretisation) -> None:
    points = DOMAIN.mesh.mapping().F(hexahedron_14()[0])[:, : DOMAIN.section_cells]
    assert np.abs(discretisation.quadrature_points - points.transpose(1, 2, 0)).max() < 1e-13


# --------------------------------------------------------------------------------------- second derivatives


def hessian_energy(discretisation: Discretisation, nodal: Floats) -> float:
    """∫ ‖∂²u/∂X∂X‖² of a scalar field at the nodes."""
    g = discretisation.geometry
    local = nodal[g.node_cells]
    return float(np.einsum("ea,eab,eb->", local, g.hessian[g.cell_class], local))


def test_linear_fields_have_no_hessian(discretisation: Discretisation) -> None:
    field = DOMAIN.nodes @ np.array([0.3, -0.7, 1.1]) + 5.0
    scale = np.abs(discretisation.geometry.hessian).max() * np.abs(field).max() ** 2
    assert abs(hessian_energy(discretisation, field)) < 1e-14 * scale


def test_quadratic_field_is_exact_on_affine_cells() -> None:
    shear = np.array([[2.0, 0.3, -0.4], [0.0, 1.5, 0.6], [0.2, 0.0, 1.2]])
    mesh = MeshHex.init_tensor(*(np.linspace(0.0, 1.0, n) for n in (3, 3, 3)))
    mesh = MeshHex(shear @ mesh.p, mesh.t)
    basis = Basis(mesh, ElementHexS2(), intorder=1)
    parallelepiped = SimpleNamespace(
        mesh=mesh,
        representatives=np.arange(mesh.nelements),
        cell_class=np.arange(mesh.nelements),
        cells=mesh.t.T,
        node_cells=basis.element_dofs.T,
    )
    discretisation = Discretisation(parallelepiped)
    form = np.array([[0.7, -0.3, 0.2], [-0.3, 1.1, 0.5], [0.2, 0.5, -0.9]])
    field = np.einsum("in,ij,jn->n", basis.doflocs, form, basis.doflocs)
    exact = np.linalg.det(shear) * np.sum((2.0 * form) ** 2)
    assert hessian_energy(discretisation, field) == pytest.approx(exact, rel=1e-12)


class CurvedCell:
    """A trilinear cell whose shape functions are written down afresh and pulled back through the inverse map."""

    def __init__(self, corners: Floats, nodes: Floats) -> None:
        self.corners = corners  # (8, 3)
        self.signs = 2.0 * HEX_OFFSETS - 1.0
        # Reference coordinates of the nodes are read off the cell itself: they are corners and edge midpoints.
        self.node_signs = np.array([2.0 * self.locate(node) - 1.0 for node in nodes]).round(9)

    def map(self, xi: Floats) -> Floats:
        return np.prod(1.0 + self.signs * (2.0 * xi - 1.0), axis=1) / 8.0 @ self.corners

    def jacobian(self, xi: Floats) -> Floats:
        """∂X_i/∂ξ_a by complex step."""
        columns = [self.map(xi + 1e-30j * axis).imag / 1e-30 for axis in np.eye(3)]
        return np.stack(columns, axis=1)

    def locate(self, X: Floats) -> Floats:
        """ξ of a point by Newton's method."""
        xi = np.full(3, 0.5)
        for _ in range(30):
            step = np.linalg.solve(self.jacobian(xi), X - self.map(xi))
            xi = xi + step
            if np.abs(step).max() < 1e-15:
                break
        return xi

    def shapes(self, xi: Floats) -> Floats:
        """The 20 serendipity functions (Zienkiewicz & Taylor, The Finite Element Method, Vol. 1) on [-1, 1]³."""
        product = 1.0 + self.node_signs * (2.0 * xi - 1.0)
        corner = np.prod(product, axis=1) * (self.node_signs @ (2.0 * xi - 1.0) - 2.0) / 8.0
        bubble = np.where(self.node_signs == 0.0, 1.0 - (2.0 * xi - 1.0) ** 2, product)
        return np.where(np.any(self.node_signs == 0.0, axis=1), np.prod(bubble, axis=1) / 4.0, corner)

    def gradients(self, X: Floats) -> Floats:
        """∂N/∂X (20, 3) at a physical point, by complex step and the inverse map."""
        xi = self.locate(X)
        reference = np.stack([self.shapes(xi + 1e-30j * axis).imag / 1e-30 for axis in np.eye(3)], axis=1)
        return reference @ np.linalg.inv(self.jacobian(xi))

    def hessians(self, X: Floats, h: float) -> Floats:
        """∂²N/∂X∂X (20, 3, 3) by fourth-order differences of gradients in physical space."""
        columns = []
        for axis in h * np.eye(3):
            near = self.gradients(X + axis) - self.gradients(X - axis)
            far = self.gradients(X + 2.0 * axis) - self.gradients(X - 2.0 * axis)
            columns.append((8.0 * near - far) / (12.0 * h))
        return np.stack(columns, axis=2)


@pytest.mark.parametrize("cell", [0, 5, 17])
def test_products_on_curved_cells_match_differences_in_physical_space(
    discretisation: Discretisation, cell: int
) -> None:
    g = discretisation.geometry
    curved = CurvedCell(DOMAIN.points[g.cells[cell]], DOMAIN.nodes[g.node_cells[cell]])
    points, weights = hexahedron_14()
    expected = np.zeros((20, 20))
    for xi, weight in zip(points.T, weights, strict=True):
        H = curved.hessians(curved.map(xi), h=5e-3).reshape(20, 9)
        expected += weight * np.linalg.det(curved.jacobian(xi)) * H @ H.T
    error = np.abs(g.hessian[g.cell_class[cell]] - expected).max()
    assert error < 1e-8 * np.abs(expected).max()


def test_curvature_of_the_map_is_not_negligible(discretisation: Discretisation) -> None:
    """The test above would prove little on cells that are nearly parallelepipeds."""
    corner = DOMAIN.points[discretisation.geometry.cells]
    signs = 2.0 * HEX_OFFSETS - 1.0
    bilinear = np.einsum("cai,a->ci", corner, signs[:, 1] * signs[:, 2]) / 8.0
    linear = np.einsum("cai,a->ci", corner, signs[:, 1]) / 8.0
    assert np.min(np.linalg.norm(bilinear, axis=1) / np.linalg.norm(linear, axis=1)) > 0.02
