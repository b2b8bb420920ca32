"""The inner product in which a change of χ is measured: its gradients are smooth, and so is what they do to a surface.

With H = 1 - r² Δ, the operator of C_t in Eq. (16) with a radius r of the order of a wall in place of L_t, it is
∫ H v H w dΩ. That of H alone (de Gournay 2006, doi:10.1137/050624108) would not do: a derivative by the nodes of a
surface consists of point sources, to which H⁻¹ answers by peaks, and the surface would become rough from node to node.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementHex1
from skfem.helpers import grad

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.equations.helmholtz import mass_and_diffusion
from actuator.linear import SolverName, make_solver


class Metric:
    """The inner product on the vertices of a domain, factorised once.

    Args:
        domain: meshed.
        radius: r, mm.
        threads, solver: of the linear algebra.
    """

    def __init__(self, domain: Domain, radius: float, *, threads: int = 2, solver: SolverName = "auto") -> None:
        mass, diffusion = mass_and_diffusion(domain.mesh)
        upper = sp.csr_array(sp.triu(mass + radius**2 * diffusion, format="csr"))
        upper.sort_indices()
        self._mass = mass
        self._solver = make_solver(
            upper.indptr, upper.indices, symmetric=True, positive_definite=True, threads=threads, name=solver
        )
        self._solver.factorise(upper.data)
        basis = Basis(domain.mesh, ElementHex1(), intorder=3)
        volumes = np.asarray(mass.sum(axis=1)).ravel()
        mean = sp.diags_array(1.0 / volumes)
        self._slopes = [sp.csr_array(mean @ _slope(k).assemble(basis)) for k in range(3)]

    def gradient(self, derivative: Floats) -> Floats:
        """The change of χ that a derivative by χ, (n_vertices,), is in this inner product, (n_vertices,)."""
        return self._solver.solve(self._mass @ self._solver.solve(derivative))

    def slope(self, chi: Floats) -> Floats:
        """∇χ at the vertices, (n_vertices, 3), 1/mm: the mean of the cells around each."""
        return np.column_stack([slope @ chi for slope in self._slopes])


def _slope(axis: int) -> BilinearForm:
    """∫ ∂u/∂X_i v dΩ."""
    return BilinearForm(lambda u, v, _: grad(u)[axis] * v)
