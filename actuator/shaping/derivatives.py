"""How figures of an inflated body change with its shape: exact derivatives of what is computed, by adjoint states.

What moves is a fixed mesh: derivatives are by the places of its nodes, (n_nodes, 3), and hold for motions that keep
the plates and the symmetry plane. They are integrals over the body, which are of a higher order than those over its
boundary that they equal in the limit (Hiptmair, Paganini & Sargheini 2015, doi:10.1007/s10543-014-0515-z).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats
from actuator.body import chamber
from actuator.body.inflation import Inflation
from actuator.body.mesh import BodyMesh
from actuator.body.meshing import rim_of
from actuator.equations.assembly import scatter_vector
from actuator.parameters import Load
from actuator.shaping.kernels import energy_weighed, work_by_shape
from actuator.terms.goals.interface import Goal

#: Relative residual of adjoint states; the flow needs no more digits than its meshes have.
ADJOINT_TOLERANCE = 1e-8


@dataclass(frozen=True)
class Functional:
    """A function of state and shape.

    Attributes:
        value: of the function.
        by_state: its derivative by the unknowns, (size,).
        by_shape: its derivative by the nodes with the unknowns held, (n_nodes, 3).
    """

    value: float
    by_state: Floats
    by_shape: Floats


def main_objective(inflation: Inflation, z: Floats, goal: Goal, load: Load) -> Functional:
    """C_0 of the part, dimensionless.

    Args:
        inflation: of the part.
        z: its state.
        goal: what C_0 is.
        load: pressure, arm and spring.
    """
    arm, by_state = inflation.arm, np.zeros(inflation.size)
    motion = arm.full(z[inflation.of_arm])
    by_state[inflation.of_arm] = arm.free(goal.gradient(motion, load))
    return Functional(goal.value(motion, load), by_state, np.zeros(inflation.mesh.nodes.shape))


def strain_aggregate(
    inflation: Inflation, z: Floats, load: float, *, limit: float, power: float, weight: Floats
) -> Functional:
    """The p-mean (∫ w (Ψ / Ψ_lim)^p dV / ∫ w dV)^(1/p) of the strain energy over its limit, dimensionless.

    Args:
        inflation: of the part.
        z, load: its state.
        limit: Ψ_lim, N/mm².
        power: p.
        weight: w of the cells, (n_cells,); it moves with them.
    """
    ratio, volumes = inflation.state(z, load).density / limit, inflation.points.volumes
    w = np.broadcast_to(weight[:, None], ratio.shape)
    total = float(np.sum(w * volumes))
    mean = float(np.sum(w * ratio**power * volumes)) / total
    value = mean ** (1.0 / power)
    # d mean = d ∫ w (r^p - mean) dV / ∫ w dV, as the volume changes too.
    factor = value / (mean * power * total) * w
    density, slope = factor * (ratio**power - mean), factor * power * ratio ** (power - 1.0) / limit
    return _of_energy(inflation, z, value, density, slope)


def _of_energy(inflation: Inflation, z: Floats, value: float, density: Floats, slope: Floats) -> Functional:
    """A functional that changes as ∫ φ(Ψ) dV does, with φ (n_cells, 4) and dφ/dΨ (n_cells, 4)."""
    mesh, cells = inflation.mesh, inflation.mesh.cells
    n, n_nodes = len(cells), len(mesh.nodes)
    f, g, by_shape = np.empty((n, 10, 3)), np.empty((n, 4)), np.empty((n, 10, 3))
    energy_weighed(
        inflation.constants,
        inflation.mixed,
        inflation.points,
        cells,
        inflation.displacement(z),
        inflation.mean_stress(z),
        density,
        slope,
        f,
        g,
        by_shape,
    )
    nodal = scatter_vector(f, cells, n_nodes)
    by_state = inflation.reduced(z, nodal)
    if inflation.mixed:
        by_state[inflation.of_stress] = scatter_vector(g, cells[:, :4], mesh.vertices)
    return Functional(value, by_state, scatter_vector(by_shape, cells, n_nodes) + _with_plate(inflation, z, nodal))


def shape_gradient(inflation: Inflation, z: Floats, load: float, functional: Functional) -> Floats:
    """The derivative by the places of the nodes of a functional of the equilibrium, (n_nodes, 3).

    The tangent must have been made at z and the load (:meth:`Inflation.linearise`).

    Raises:
        actuator.failure.SolveFailure: if the adjoint state is not found.
    """
    adjoint = inflation.solve(-functional.by_state, ADJOINT_TOLERANCE)
    return functional.by_shape + _work_by_shape(inflation, z, load, adjoint)


def _work_by_shape(inflation: Inflation, z: Floats, load: float, adjoint: Floats) -> Floats:
    """∂(∂Π/∂z · λ)/∂X, (n_nodes, 3)."""
    mesh, arm, T, of_arm = inflation.mesh, inflation.arm, z[inflation.of_arm], adjoint[inflation.of_arm]
    cells, walls = mesh.cells, mesh.walls
    state, v = inflation.state(z, load), inflation.variation(z, adjoint)
    by_shape, changed = np.empty((len(cells), 10, 3)), np.empty((len(cells), 10, 3))
    work_by_shape(
        inflation.constants,
        inflation.shearing,
        inflation.mixed,
        inflation.points,
        cells,
        state.displacement,
        inflation.mean_stress(z),
        v,
        inflation.mean_stress(adjoint),
        by_shape,
        changed,
    )
    n, x, p = len(mesh.nodes), mesh.nodes + state.displacement, load * inflation.pressure
    hessian = chamber.hessian(x, walls).reshape(len(walls), 18, 18)
    of_air = p * scatter_vector((hessian @ v[walls].reshape(-1, 18, 1)).reshape(-1, 6, 3), walls, n)
    force_change = scatter_vector(changed, cells, n) - of_air
    found = scatter_vector(by_shape, cells, n) - of_air + _with_plate(inflation, z, force_change)
    force = state.nodal - p * scatter_vector(chamber.gradient(x, walls), walls, n)
    _, dR, _ = arm.rotations(T)
    found[mesh.tip] += force[mesh.tip] @ np.einsum("j,jik->ik", of_arm, dR)
    found -= p * float(arm.chamber(T)[1] @ of_arm) / arm.opening * opening_by_shape(mesh)
    return found


def _with_plate(inflation: Inflation, z: Floats, nodal: Floats) -> Floats:
    """By the places of the nodes on the arm's plate, which move by u = T + (R - 1) (X - X_c), of forces on them."""
    R, _, _ = inflation.arm.rotations(z[inflation.of_arm])
    by_shape, tip = np.zeros(nodal.shape), inflation.mesh.tip
    by_shape[tip] = nodal[tip] @ (R - np.eye(3))
    return by_shape


def opening_by_shape(mesh: BodyMesh) -> Floats:
    """Derivative of :attr:`BodyMesh.opening` by the places of the nodes, (n_nodes, 3), mm."""
    start, middle, end = rim_of(mesh.nodes, mesh.walls, mesh.length)
    by_shape, twice = np.zeros(mesh.nodes.shape), 0.0
    for one, other, factor in ((start, middle, 2.0 / 3.0), (middle, end, 2.0 / 3.0), (start, end, -0.5 / 3.0)):
        a, b = mesh.nodes[one], mesh.nodes[other]
        twice += factor * float(np.sum(a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]))
        np.add.at(by_shape, one, factor * np.column_stack([np.zeros(len(a)), b[:, 2], -b[:, 1]]))
        np.add.at(by_shape, other, factor * np.column_stack([np.zeros(len(a)), -a[:, 2], a[:, 1]]))
    return np.sign(twice) * by_shape
