"""Shape functions and their derivatives at the quadrature points, ready for the element kernels."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementHex1, ElementHexS2, FacetBasis, MeshHex
from skfem.helpers import dot, grad

from actuator.arrays import Floats, Ints
from actuator.domains.interface import Domain
from actuator.equations.assembly import scatter_vector
from actuator.equations.quadrature import hexahedron_rule
from actuator.equations.scheme import DEFAULT, Scheme


class Geometry(NamedTuple):
    """Arrays the compiled kernels read. Cells of a class share their shape functions.

    Attributes:
        cells, node_cells: connectivity (n_cells, 8) and (n_cells, 20).
        cell_class: class of each cell, (n_cells,); index into the arrays below.
        shape: trilinear shape functions, (n_q, 8).
        gradient: their gradients, (n_classes, n_q, 8, 3), 1/mm.
        gradient20: gradients of the 20-node serendipity functions, (n_classes, n_q, 20, 3), 1/mm; for the 8-node
            element those of the trilinear functions, and zero for the other 12 nodes, which then carry nothing.
        volume: quadrature weight times det of the map, (n_classes, n_q), mm³.
        hessian: ∫ ∂²N_a/∂X_i∂X_j ∂²N_b/∂X_i∂X_j of the same functions, (n_classes, 20, 20), 1/mm.
        size_squared: h² of each cell, its volume to the power 2/3, (n_classes,), mm².
        summed, fitted: whether matrices of source and drainage are summed by rows, and k is fitted to the cells.
    """

    cells: Ints
    node_cells: Ints
    cell_class: Ints
    shape: Floats
    gradient: Floats
    gradient20: Floats
    volume: Floats
    hessian: Floats
    size_squared: Floats
    summed: bool
    fitted: bool


class Discretisation:
    """Finite-element spaces on a design domain: trilinear χ and p, 20-node serendipity (or trilinear) u.

    Attributes:
        rule: points (3, n_q) on the reference cube and weights (n_q,) of the quadrature.
        quadrature_points: of the cells that stand for their classes, (n_classes, n_q, 3), mm.
        geometry: what the kernels read.
    """

    def __init__(self, domain: Domain, scheme: Scheme = DEFAULT) -> None:
        self.domain = domain
        points, weights = hexahedron_rule(scheme.quadrature)
        self.rule = points, weights
        element = ElementHexS2() if scheme.element == "hex20" else ElementHex1()
        mesh = _part(domain.mesh, domain.representatives)
        linear = Basis(mesh, ElementHex1(), quadrature=self.rule)
        displacements = Basis(mesh, element, quadrature=self.rule)
        shape = np.stack([np.broadcast_to(b[0], linear.dx.shape)[0] for b in linear.basis], axis=-1)
        gradient = np.stack([b[0].grad for b in linear.basis]).transpose(2, 3, 0, 1)
        slopes = np.stack([b[0].grad for b in displacements.basis]).transpose(2, 3, 0, 1)
        volume = np.array(linear.dx)
        self.quadrature_points: Floats = np.asarray(linear.global_coordinates()).transpose(1, 2, 0)
        self.geometry = Geometry(
            np.ascontiguousarray(domain.cells, dtype=np.int64),
            np.ascontiguousarray(domain.node_cells, dtype=np.int64),
            np.ascontiguousarray(domain.cell_class, dtype=np.int64),
            np.ascontiguousarray(shape),
            np.ascontiguousarray(gradient),
            _padded(np.ascontiguousarray(slopes), 2),
            volume,
            _padded(_hessian_products(mesh, element, points, slopes, volume), 1, 2),
            volume.sum(axis=1) ** (2.0 / 3.0),
            scheme.pressure != "plain",
            scheme.pressure == "fitted",
        )

    def source(self, drainage: float) -> Floats:
        """Q_in of Eq. (18) at the quadrature points, (n_classes, n_q), mm²/(N s), for a drainage Q_s in the same."""
        return 100.0 * drainage * self.domain.inlet(self.quadrature_points)

    def fed(self, drainage: float, shares: Sequence[float]) -> Floats:
        """As :meth:`source`, of several chambers, each counted by the share of p_in that its source has."""
        return 100.0 * drainage * np.tensordot(shares, self.domain.profiles(self.quadrature_points), axes=1)

    def integral(self, density: Floats) -> Floats:
        """∫ N_a f of f at the quadrature points, (n_classes, n_q): (n_vertices,)."""
        geometry = self.geometry
        elements = ((geometry.volume * density) @ geometry.shape)[geometry.cell_class]
        return scatter_vector(elements, geometry.cells, self.domain.mesh.nvertices)

    @cached_property
    def inlet_masses(self) -> tuple[sp.csr_array, ...]:
        """∫ w N_a N_b / ∫ w for the profile w of every chamber's inlet, (n_vertices, n_vertices) each."""
        geometry, n = self.geometry, self.domain.mesh.nvertices
        cells, found = geometry.cells, []
        rows, columns = np.broadcast_to(cells[:, :, None], (len(cells), 8, 8)), np.repeat(cells[:, None], 8, axis=1)
        for profile in self.domain.profiles(self.quadrature_points):
            weights = geometry.volume * profile
            elements = np.einsum("cq,qa,qb->cab", weights, geometry.shape, geometry.shape)[geometry.cell_class]
            entries = elements.ravel() / elements.sum(), (rows.ravel(), columns.ravel())
            found.append(sp.csr_array(sp.coo_array(entries, shape=(n, n))))
        return tuple(found)

    @cached_property
    def volume(self) -> float:
        """|Ω|, mm³."""
        copies, volume = np.bincount(self.geometry.cell_class), self.geometry.volume
        return sum(int(count) * float(volume[copies == count].sum()) for count in np.unique(copies))

    @cached_property
    def linear(self) -> Basis:
        """Trilinear basis on the whole mesh."""
        return Basis(self.domain.mesh, ElementHex1(), quadrature=self.rule)

    @cached_property
    def mass(self) -> sp.csr_array:
        """∫ N_a N_b, (n_vertices, n_vertices), mm³."""
        return sp.csr_array(BilinearForm(lambda u, v, _: u * v).assemble(self.linear))

    @cached_property
    def stiffness(self) -> sp.csr_array:
        """∫ ∇N_a · ∇N_b, (n_vertices, n_vertices), mm."""
        return sp.csr_array(BilinearForm(lambda u, v, _: dot(grad(u), grad(v))).assemble(self.linear))

    @cached_property
    def wall_mass(self) -> sp.csr_array:
        """∫ N_a N_b over the outside Γ_ext divided by its area, (n_vertices, n_vertices)."""
        basis = FacetBasis(self.domain.mesh, ElementHex1(), facets=self.domain.outside.facets, intorder=4)
        area = float(basis.dx.sum())
        return sp.csr_array(BilinearForm(lambda u, v, _: u * v / area).assemble(basis))


def _part(mesh: MeshHex, cells: Ints) -> MeshHex:
    """The mesh of some cells alone."""
    used, corners = np.unique(mesh.t[:, cells], return_inverse=True)
    return MeshHex(np.ascontiguousarray(mesh.p[:, used]), np.ascontiguousarray(corners.reshape(8, -1)))


def _padded(values: Floats, *axes: int) -> Floats:
    """Zeros behind, up to the 20 nodes for which the element loops are compiled."""
    widths = [(0, 20 - length if axis in axes else 0) for axis, length in enumerate(values.shape)]
    return np.pad(values, widths) if any(after for _, after in widths) else values


def _hessian_products(
    mesh: MeshHex, element: ElementHex1 | ElementHexS2, points: Floats, slopes: Floats, volume: Floats
) -> Floats:
    """Integrals of products of second derivatives, with the terms the trilinear map of curved cells adds.

    ∂²N/∂X_i∂X_j = ∂ξ_a/∂X_i ∂ξ_b/∂X_j (∂²N/∂ξ_a∂ξ_b - ∂N/∂X_k ∂²X_k/∂ξ_a∂ξ_b)
    """
    second = _reference_second_derivatives(element, points)  # (n_shape, 3, 3, n_q)
    second8 = _reference_second_derivatives(ElementHex1(), points)
    corner = mesh.p[:, mesh.t]  # (3, 8, n)
    inverse = np.asarray(mesh.mapping().invDF(points))  # (a, i, n, n_q): ∂ξ_a/∂X_i
    curvature = np.einsum("kcn,cabq->kabnq", corner, second8)
    product = np.zeros((mesh.nelements, len(second), len(second)))
    for q in range(points.shape[1]):
        reference = second[None, ..., q] - np.einsum("nck,kabn->ncab", slopes[:, q], curvature[..., q])
        physical = np.einsum("ain,bjn,ncab->ncij", inverse[..., q], inverse[..., q], reference)
        flat = physical.reshape(mesh.nelements, len(second), 9)
        product += volume[:, q, None, None] * (flat @ flat.transpose(0, 2, 1))
    return product


def _reference_second_derivatives(element: ElementHex1 | ElementHexS2, points: Floats) -> Floats:
    """Second derivatives of an element's shape functions on the reference cube, (n_shape, 3, 3, n_q).

    The shape functions are polynomials of degree at most two in each variable, so that central differences of
    their gradients are exact.
    """
    count = element.doflocs.shape[0]
    second = np.empty((count, 3, 3, points.shape[1]))
    step = 0.5
    for axis in range(3):
        shift = step * np.eye(3)[:, axis : axis + 1]
        for i in range(count):
            forward, backward = element.lbasis(points + shift, i)[1], element.lbasis(points - shift, i)[1]
            second[i, :, axis] = (np.asarray(forward) - np.asarray(backward)) / (2.0 * step)
    return second
