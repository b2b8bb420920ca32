"""The leak of a state by second-order elements, to judge what the fitted trilinear pressure says of it.

In solid the pressure dies out over 0.03 mm, far less than a cell. An optimisation that weighs the leak finds whatever
errors of the elements cancel at the wall, so that another discretisation has to judge its designs. Where much pressure
stands on the wall, second-order elements on the same mesh come within 10 % of finer ones; in tight walls they alternate
in sign and leave about 0.1 % of p_in, more than finer meshes do (docs/explain/readings.md).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from skfem import BilinearForm, ElementHexS2, FacetBasis

from actuator.arrays import Floats
from actuator.equations.assembly import Gather
from actuator.equations.tangent_kernels import darcy_metric
from actuator.linear import make_solver
from actuator.material.ersatz import drainage, permeability
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.state import State


class Leak(NamedTuple):
    """How much pressure stands on the outer wall.

    Attributes:
        largest: largest |p| / p_in there, dimensionless.
        mean_square: mean of (p / p_in)² over the wall; C_p is half its weight times this.
    """

    largest: float
    mean_square: float


def second_order_leak(equilibrium: Equilibrium, state: State) -> Leak:
    """Solve Eq. (5) with 20-node pressure at the displacements of a state; the quadrature stays the 14-point rule.

    Raises:
        actuator.failure.SolveFailure: if its matrix cannot be factorised.
    """
    domain, source_pressure = equilibrium.domain, equilibrium.coefficients.pressure
    if source_pressure == 0.0:
        return Leak(0.0, 0.0)
    matrix, inflow = _elements(equilibrium, state)
    cells, n = equilibrium.geometry.node_cells.astype(np.int32), len(domain.nodes)
    rows = np.broadcast_to(cells[:, :, None], matrix.shape).ravel()
    columns = np.broadcast_to(cells[:, None, :], matrix.shape).ravel()
    gather = Gather(np.where(rows <= columns, rows, -1), columns, (n, n))
    solver = make_solver(
        gather.indptr,
        gather.indices,
        symmetric=True,
        positive_definite=True,
        name=equilibrium.solver,
        threads=equilibrium.threads,
    )
    solver.factorise(gather.data(matrix.ravel()))
    p = solver.solve(np.bincount(cells.ravel(), inflow.ravel(), n)) / source_pressure
    solver.release()
    wall = FacetBasis(domain.mesh, ElementHexS2(), facets=domain.outside.facets, intorder=4)
    mass = BilinearForm(lambda u, v, _: u * v).assemble(wall)
    on_wall = wall.get_dofs(domain.outside.facets).all()
    return Leak(float(np.abs(p[on_wall]).max()), float(p @ (mass @ p)) / float(wall.dx.sum()))


def _elements(equilibrium: Equilibrium, state: State) -> tuple[Floats, Floats]:
    """Element matrices (n_cells, 20, 20), mm⁵/(N s), and inflows (n_cells, 20), mm³/s."""
    geometry, c = equilibrium.geometry, equilibrium.coefficients
    n_cells, n_q = len(geometry.cells), len(geometry.shape)
    metric = np.empty((n_cells, n_q, 6))
    darcy_metric(geometry, state.displacement, metric)
    element = ElementHexS2()
    shape20 = np.stack([element.lbasis(equilibrium.discretisation.rule[0], a)[0] for a in range(20)], axis=-1)
    chi = state.chi[geometry.cells] @ geometry.shape.T
    k, out = (np.array([law(x, c)[0] for x in chi.ravel()]).reshape(chi.shape) for law in (permeability, drainage))
    matrix, inflow = np.zeros((n_cells, 20, 20)), np.zeros((n_cells, 20))
    for q in range(n_q):
        tensor = k[:, q, None, None] * metric[:, q][:, [[0, 5, 4], [5, 1, 3], [4, 3, 2]]]
        gradient, shape = geometry.gradient20[geometry.cell_class, q], shape20[q]
        volume, source = geometry.volume[geometry.cell_class, q], equilibrium.source[geometry.cell_class, q]
        fed = equilibrium.fed[geometry.cell_class, q]
        matrix += gradient @ tensor @ gradient.transpose(0, 2, 1)
        matrix += (volume * (source + out[:, q]))[:, None, None] * np.outer(shape, shape)
        inflow += (volume * fed * c.pressure)[:, None] * shape
    return matrix, inflow
