"""The hyperelastic part of the model in FElupe, an independent finite-element package (github.com/adtzlr/felupe).

Eq. (6) without the flow: the pressure is given, and so are the displacements of Γ. FElupe has the 20-node hexahedron
and its gradients, the isochoric neo-Hookean law, the integrals, the assembly and Newton's method. What it lacks is
written here with its own tools: the volumetric law with the pressure, and the second derivatives of c_r. From poro come
the mesh, the fields χ and p at its vertices, the constants, and the points of the quadrature rule.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy.sparse as sp
from felupe import (
    Boundary,
    Field,
    FieldContainer,
    Hexahedron,
    Material,
    Mesh,
    NeoHooke,
    QuadraticHexahedron,
    Region,
    SolidBody,
    newtonraphson,
)
from felupe.dof import partition
from felupe.math import cdya_il, det, dya, inv, transpose
from felupe.quadrature import Scheme
from skfem import ElementHex1, ElementHexS2

from actuator.arrays import Floats, Ints
from actuator.domains.interface import Domain
from actuator.parameters import Material as Constants
from benchmarks.given_pressure import MAX_NEWTON, Solution

#: Solves K x = b, K in compressed rows with both triangles.
LinearSolver = Callable[[Any, Floats], Floats]


class TwiceDifferentiable(QuadraticHexahedron):
    """FElupe's 20-node hexahedron with the second derivatives that it lacks.

    The shape functions are of degree two at most in each variable, so that central differences of FElupe's gradients
    are exact.
    """

    def hessian(self, rst: Floats) -> Floats:
        """Second derivatives at a point, (20, 3, 3)."""
        steps = 0.5 * np.eye(3)
        return np.stack([self.gradient(rst + step) - self.gradient(rst - step) for step in steps], axis=-1)


class FelupeProblem:
    """u for given pressure and given displacements of Γ.

    Args:
        domain: mesh.
        constants: of the model, with neo-Hooke's law.
        chi, p: χ, dimensionless, and p, N/mm², at the vertices, (n_vertices,).
        rule: quadrature points (3, n_q) on the unit cube and weights (n_q,).
    """

    def __init__(
        self, domain: Domain, constants: Constants, chi: Floats, p: Floats, rule: tuple[Floats, Floats]
    ) -> None:
        quadrature = Scheme(2.0 * rule[0].T - 1.0, 8.0 * rule[1])
        linear = Mesh(domain.points, domain.cells[:, _order(ElementHex1, Hexahedron)], "hexahedron")
        quadratic = Mesh(domain.nodes, domain.node_cells[:, _order(ElementHexS2, QuadraticHexahedron)], "hexahedron20")
        vertices = Region(linear, Hexahedron(), quadrature)
        design, pressure = (Field(vertices, dim=1, values=values[:, None]).interpolate()[0] for values in (chi, p))
        density = 1.0 / (1.0 + np.exp(-design))
        contrast, penalty = constants.stiffness_contrast, constants.ramp_penalty
        factor = contrast + (1.0 - contrast) * density / (1.0 + penalty * (1.0 - density))

        region = Region(quadratic, TwiceDifferentiable(), quadrature, hess=constants.hessian_penalty > 0.0)
        self.field = FieldContainer([Field(region, dim=3)])
        self._load = 0.0
        isochoric = NeoHooke(mu=factor * constants.shear)
        volumetric = Material(self._stress, self._elasticity, bulk=factor * constants.bulk, pressure=pressure)
        law = isochoric & volumetric
        # FElupe cuts strains into chunks of cells, but not the moduli that go with them.
        law.chunksize = isochoric.chunksize = None
        self.items: list[Any] = [SolidBody(law, self.field)]
        if constants.hessian_penalty > 0.0:
            self.items.append(_second_derivatives(self.field, constants.hessian_penalty))
        displacement, places = self.field[0], domain.nodes[:, 0]
        symmetric = Boundary(displacement, mask=domain.nodes[:, 1] == 0.0, skip=(True, False, True))
        ends = Boundary(displacement, mask=(places == 0.0) | (places == domain.length))
        self.prescribed, self.free = partition(self.field, {"symmetric": symmetric, "ends": ends})

    def pattern(self) -> sp.csr_array:
        """Upper triangle of all entries that the free unknowns' matrix may have; sums drop those that cancel."""
        cells = self.field.region.mesh.cells
        rows, columns = np.broadcast_arrays(cells[:, :, None], cells[:, None, :])
        size = self.field.region.mesh.npoints
        nodes = sp.csr_array((np.ones(rows.size), (rows.ravel(), columns.ravel())), shape=(size, size))
        whole = sp.csr_array(sp.kron(nodes, np.ones((3, 3)), format="csr"))
        upper = sp.csr_array(sp.triu(whole[self.free][:, self.free], format="csr"))
        upper.sort_indices()
        return upper

    # ------------------------------------------------- volumetric law and pressure

    def _stress(self, x: list[Floats], bulk: Floats, pressure: Floats) -> list[Floats]:
        """First Piola-Kirchhoff stress (K ln J - J p) F⁻ᵀ, the derivative of K (ln J)² / 2 - J p."""
        J, inverse = _kinematics(x)
        return [(bulk * np.log(J) - self._load * pressure * J) * inverse, x[-1]]

    def _elasticity(self, x: list[Floats], bulk: Floats, pressure: Floats) -> list[Floats]:
        """Its derivative."""
        J, inverse = _kinematics(x)
        Jp = self._load * pressure * J
        return [(bulk - Jp) * dya(inverse, inverse) - (bulk * np.log(J) - Jp) * cdya_il(inverse, inverse)]

    # -------------------------------------------------------------------- solution

    def solve(
        self, motion: Callable[[float], Floats], loads: Floats, tolerance: float, solver: LinearSolver
    ) -> Solution:
        """From rest through growing loads, each by FElupe's Newton method, without a search.

        Args:
            motion: displacements (n_nodes, 3) at a load factor, read where they are prescribed.
            loads: load factors; the pressure is multiplied by them.
            tolerance: norm of the residual over that of the reactions.
            solver: for the free unknowns.

        Raises:
            felupe.tools.NewtonConvergenceError: if a load is not reached.
        """
        linear = 0.0

        def timed(matrix: Any, right: Floats) -> Floats:
            nonlocal linear
            began = process_time()
            answer = solver(matrix, right)
            linear += process_time() - began
            return answer

        def check(dx: Floats, f: Floats, ftol: float, **_: Any) -> tuple[float, float, bool]:
            ratio = float(np.linalg.norm(f[self.free]) / np.linalg.norm(f[self.prescribed]))
            return float(np.linalg.norm(dx)), ratio, ratio <= ftol

        began, iterations = process_time(), 0
        self.field[0].values = np.zeros_like(self.field[0].values)
        x, result = self.field, None
        for load in loads:
            self._load = float(load)
            result = newtonraphson(
                x0=x,
                items=self.items,
                dof1=self.free,
                dof0=self.prescribed,
                ext0=motion(self._load).ravel()[self.prescribed],
                tol=tolerance,
                maxiter=MAX_NEWTON,
                check=check,
                solver=timed,
                verbose=False,
            )
            x, iterations = result.x, iterations + result.iterations
        assert result is not None
        shape = self.field[0].values.shape
        return Solution(x[0].values, result.fun.reshape(shape), iterations, process_time() - began, linear)

    def forces(self, displacement: Floats, load: float = 1.0) -> Floats:
        """Nodal residual forces (n_nodes, 3), N, at any displacements; :meth:`matrix` is their derivative there."""
        self._load = load
        self.field[0].values = displacement
        return sum(item.assemble.vector(self.field).toarray() for item in self.items).reshape(displacement.shape)

    def matrix(self) -> sp.csr_matrix:
        """(3 n_nodes, 3 n_nodes), N/mm."""
        return sum(item.assemble.matrix() for item in self.items)


def _order(ours: Any, theirs: Any) -> Ints:
    """Which of scikit-fem's local nodes each of FElupe's is, told by their places."""
    distance = np.abs(0.5 * (theirs().points[:, None] + 1.0) - ours.doflocs).sum(axis=2)
    order = distance.argmin(axis=1)
    if not (np.take_along_axis(distance, order[:, None], axis=1) == 0.0).all():
        raise ValueError("the two packages do not have the same element")
    return order


def _kinematics(x: list[Floats]) -> tuple[Floats, Floats]:
    """J and F⁻ᵀ."""
    J = det(x[0])
    return J, transpose(inv(x[0], J))


def _second_derivatives(field: FieldContainer, weight: float) -> SimpleNamespace:
    """c_r ∫ ℍu ⋮ ℍδu as an item of FElupe's Newton method; linear in u."""
    region = field.region
    products = np.einsum("aKLqc,bKLqc,qc->cab", region.d2hdXdX, region.d2hdXdX, region.dV, optimize=True)
    blocks = np.einsum("cab,ij->caibj", weight * products, np.eye(3))
    dofs = (3 * region.mesh.cells[:, :, None] + np.arange(3)).reshape(len(products), -1)
    size = 3 * region.mesh.npoints
    rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :])
    matrix = sp.csr_matrix((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))

    def vector(field: FieldContainer, **_: Any) -> sp.csr_matrix:
        return sp.csr_matrix((matrix @ field[0].values.ravel())[:, None])

    return SimpleNamespace(
        field=field,
        assemble=SimpleNamespace(vector=vector, matrix=lambda **_: matrix.copy(), multiplier=None),
        results=SimpleNamespace(update_statevars=lambda: None),
    )
