"""A body under air pressure, as a problem that :mod:`actuator.solve.path` follows.

Equilibrium is stationary energy, Π(x) = ∫ Ψ dV + spring - λ p_in V(x), with V the volume of the chamber: a follower
pressure on its walls and plates. Unknowns are the free displacements, in the mixed form the mean stress at the
vertices, and the arm's motion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.body import chamber
from actuator.body.arm import Arm
from actuator.body.element import PAIRS, forces, points_of, tangents, unpacked
from actuator.body.mesh import BodyMesh
from actuator.equations.arm import COORDINATES, OF_HALF, is_angle
from actuator.equations.assembly import Gather, scatter_vector
from actuator.failure import SolveFailure
from actuator.linear import DirectSolver, SolverName, gmres, make_solver
from actuator.linear.pattern import Product
from actuator.material.constants import constants_of_law
from actuator.parameters import Material
from actuator.solve.path import Point

#: Poisson's ratio above which the mean stress is an unknown. Plain cells do not lock at the paper's 0.48, but on a mesh
#: of 42,000 unknowns of its 14 % part they are 1.1 % too stiff where mixed ones are 0.3 %.
MOST_PLAIN_POISSON_RATIO = 0.45
#: Displacement, in lengths of the body, that counts as much along the path as the whole pressure.
LARGE_DISPLACEMENT = 0.1
#: dλ/ds below which a point is a limit point, where nothing has a derivative by λ.
LEAST_SLOPE = 1e-3
#: Krylov iterations after which older factors are given up for new ones.
MOST_KRYLOV = 25


@dataclass(frozen=True)
class State:
    """A state of a body.

    Attributes:
        displacement: u of the nodes, (n_nodes, 3), mm.
        motion: free coordinates of the arm, (m,), mm and rad.
        nodal: internal forces of the nodes, (n_nodes, 3), N.
        density: Ψ at the points of the cells, (n_cells, 4), N/mm².
        volume: of the chamber, mm³, of the modelled half or whole.
        stored, spring: energies of body and spring, N mm, of the modelled half or whole.
    """

    displacement: Floats
    motion: Floats
    nodal: Floats
    density: Floats
    volume: float
    stored: float
    spring: float


class Inflation:
    """States of a body at all load factors λ.

    Args:
        mesh: the body; a half moves without leaving its symmetry plane.
        material: moduli and law, N/mm²; what belongs to the void does not count.
        pressure: p_in, N/mm², at λ = 1.
        reach, stiffness: L_arm, mm, and the spring of what is modelled, N/mm.
        threads, solver: of the linear algebra.
        mixed: whether the mean stress is an unknown; by Poisson's ratio if None.
    """

    def __init__(
        self,
        mesh: BodyMesh,
        material: Material,
        *,
        pressure: float,
        reach: float,
        stiffness: float,
        threads: int = 2,
        solver: SolverName = "auto",
        mixed: bool | None = None,
    ) -> None:
        self.mesh, self.pressure = mesh, pressure
        self.arm = Arm(mesh.length, reach, stiffness, OF_HALF if mesh.half else COORDINATES, mesh.opening)
        poisson = (3.0 * material.bulk - 2.0 * material.shear) / (6.0 * material.bulk + 2.0 * material.shear)
        self.mixed = poisson > MOST_PLAIN_POISSON_RATIO + 1e-12 if mixed is None else mixed
        self.constants = constants_of_law(material.law)._replace(bulk=material.bulk, shear=material.shear)
        self.shearing = self.constants._replace(bulk=0.0) if self.mixed else self.constants
        self.points = points_of(mesh.nodes, mesh.cells)
        self._number()
        # Factors only precondition: single precision halves their time and memory. The mixed form needs all digits.
        self._solver: DirectSolver = make_solver(
            self._gather.indptr,
            self._gather.indices,
            symmetric=True,
            precision="double" if self.mixed else "single",
            threads=threads,
            name=solver,
        )
        self._product = Product(self._gather.indptr, self._gather.indices, symmetric=True)
        self._factorised = False
        self._fresh = False
        self.load_derivative: Floats = np.zeros(self.size)
        self._seen: tuple[Floats, float, State] | None = None
        self._scale = float(np.linalg.norm(self._weighted(self._air_force(self.rest)))) or 1.0

    # ------------------------------------------------------------------------ unknowns

    def _number(self) -> None:
        mesh, free = self.mesh, self.mesh.free
        self._free: Ints = np.flatnonzero(free.ravel())
        # Half the memory of 64 bits, which no solver behind takes anyway.
        self._index = np.full(free.shape, -1, dtype=np.int32)
        self._index.ravel()[self._free] = np.arange(len(self._free))
        self.displacements = len(self._free)
        self.stresses = mesh.vertices if self.mixed else 0
        self.size = self.displacements + self.stresses + len(self.arm.names)
        self.of_arm = slice(self.size - len(self.arm.names), None)
        self._arm_index = np.arange(self.size, dtype=np.int32)[self.of_arm]
        self._tip_row = np.full(len(mesh.nodes), -1, dtype=np.int64)
        self._tip_row[mesh.tip] = np.arange(len(mesh.tip))
        # Cells and walls that hang on the arm's plate: their nodes there follow its coordinates.
        self._cells_at_tip = np.flatnonzero((self._tip_row[mesh.cells] >= 0).any(axis=1))
        self._walls_at_tip = np.flatnonzero((self._tip_row[mesh.walls] >= 0).any(axis=1))
        entries = [self._packed_targets(), self._block_targets(mesh.walls)]
        entries += [
            self._arm_targets(mesh.cells[self._cells_at_tip]),
            self._arm_targets(mesh.walls[self._walls_at_tip]),
        ]
        m = len(self.arm.names)
        entries.append((np.repeat(self._arm_index, m), np.tile(self._arm_index, m)))
        if self.mixed:
            entries += self._stress_targets()
        # Every diagonal entry is stored, also where nothing is added to it.
        diagonal = np.arange(self.size, dtype=np.int32)
        entries.append((diagonal, diagonal))
        ends = np.cumsum([len(part) for part, _ in entries])
        self._buffer = np.zeros(ends[-1])
        self._parts = np.split(self._buffer, ends[:-1])
        rows, columns = (np.concatenate(part) for part in zip(*entries, strict=True))
        below = rows > columns
        rows, columns = np.where(below, columns, rows), np.where(below, rows, columns)
        self._gather = Gather(rows, columns, (self.size, self.size))

    def _packed_targets(self) -> tuple[Ints, Ints]:
        """Of the blocks of node pairs; of a node with itself one triangle."""
        index = self._index[self.mesh.cells]
        rows = np.broadcast_to(index[:, PAIRS[:, 0], :, None], (len(index), len(PAIRS), 3, 3)).copy()
        columns = np.broadcast_to(index[:, PAIRS[:, 1], None, :], rows.shape)
        twice = (PAIRS[:, 0] == PAIRS[:, 1])[:, None, None] & (np.arange(3)[:, None] > np.arange(3))
        rows[:, twice] = -1
        return rows.ravel(), columns.ravel()

    def _block_targets(self, elements: Ints) -> tuple[Ints, Ints]:
        """Of full symmetric blocks, one triangle."""
        index = self._index[elements].reshape(len(elements), 3 * elements.shape[1])
        rows = np.broadcast_to(index[:, :, None], (*index.shape, index.shape[1]))
        columns = np.broadcast_to(index[:, None, :], rows.shape)
        return np.where(rows <= columns, rows, -1).ravel(), columns.ravel()

    def _arm_targets(self, elements: Ints) -> tuple[Ints, Ints]:
        index = self._index[elements].reshape(len(elements), 3 * elements.shape[1])
        shape = (*index.shape, len(self.arm.names))
        return np.broadcast_to(index[:, :, None], shape).ravel(), np.broadcast_to(self._arm_index, shape).ravel()

    def _stress_targets(self) -> list[tuple[Ints, Ints]]:
        cells = self.mesh.cells
        vertex = (self.displacements + cells[:, :4]).astype(np.int32)
        index = self._index[cells].reshape(len(cells), 30)
        shape = (len(cells), 4, 30)
        coupled = np.broadcast_to(index[:, None, :], shape), np.broadcast_to(vertex[:, :, None], shape)
        rows = np.broadcast_to(vertex[:, :, None], (len(cells), 4, 4))
        columns = np.broadcast_to(vertex[:, None, :], rows.shape)
        of_tip = vertex[self._cells_at_tip]
        shape = (*of_tip.shape, len(self.arm.names))
        with_arm = np.broadcast_to(of_tip[:, :, None], shape), np.broadcast_to(self._arm_index, shape)
        upper = np.where(rows <= columns, rows, -1)
        return [(a.ravel(), b.ravel()) for a, b in (coupled, (upper, columns), with_arm)]

    @property
    def rest(self) -> Floats:
        """z of the undeformed body."""
        return np.zeros(self.size)

    def unknowns(self, displacement: Floats, mean_stress: Floats, motion: Floats) -> Floats:
        """z of u of all nodes (n_nodes, 3), mm, π at the vertices (n_vertices,) and the arm's motion (m,)."""
        z = np.zeros(self.size)
        z[: self.displacements] = displacement.ravel()[self._free]
        z[self.of_arm] = motion
        if self.mixed:
            z[self.of_stress] = mean_stress
        return z

    def displacement(self, z: Floats) -> Floats:
        """u of all nodes, (n_nodes, 3), mm."""
        u = np.zeros(self.mesh.nodes.shape)
        u.ravel()[self._free] = z[: self.displacements]
        u[self.mesh.tip] = self.arm.displacement(z[self.of_arm], self.mesh.nodes[self.mesh.tip])
        return u

    def variation(self, z: Floats, dz: Floats) -> Floats:
        """The change of u of all nodes, (n_nodes, 3), with a change of z."""
        v = np.zeros(self.mesh.nodes.shape)
        v.ravel()[self._free] = dz[: self.displacements]
        v[self.mesh.tip] = self.arm.directions(z[self.of_arm], self.mesh.nodes[self.mesh.tip]) @ dz[self.of_arm]
        return v

    def reduced(self, z: Floats, nodal: Floats) -> Floats:
        """Forces on the unknowns, of nodal forces (n_nodes, 3)."""
        force = np.zeros(self.size)
        force[: self.displacements] = nodal.ravel()[self._free]
        directions = self.arm.directions(z[self.of_arm], self.mesh.nodes[self.mesh.tip])
        force[self.of_arm] = np.einsum("nij,ni->j", directions, nodal[self.mesh.tip])
        return force

    # ------------------------------------------------------------------------ equilibrium

    def state(self, z: Floats, load: float) -> State:
        """The state at z, converged or not."""
        if self._seen is None or self._seen[0] is not z or self._seen[1] != load:
            self.residual(z, load)
        assert self._seen is not None
        return self._seen[2]

    def residual(self, z: Floats, load: float) -> Floats:
        """∂Π/∂z, (size,); infinite where a cell is inside out."""
        u, cells = self.displacement(z), self.mesh.cells
        f, g = np.empty((len(cells), 10, 3)), np.empty((len(cells), 4))
        density, log_J = np.empty((len(cells), 4)), np.empty((len(cells), 4))
        arguments = self.constants, self.mixed, self.points, cells, u
        forces(*arguments, self.mean_stress(z), f, g, density, log_J)
        nodal = scatter_vector(f, cells, len(u))
        T = z[self.of_arm]
        spring, spring_force, _ = self.arm.spring(T)
        volume = chamber.volume(self.mesh.nodes + u, self.mesh.walls) + self.arm.chamber(T)[0]
        stored = float(np.sum(density * self.points.volumes))
        self._seen = z, load, State(u, T, nodal, density, volume, stored, spring)
        if np.isnan(log_J).any():
            return np.full(self.size, np.inf)
        residual = self.reduced(z, nodal) - load * self._air_force(z)
        residual[self.of_arm] += spring_force
        if self.mixed:
            residual[self.of_stress] = scatter_vector(g, cells[:, :4], self.mesh.vertices)
        return residual

    @property
    def of_stress(self) -> slice:
        """Where the mean stress stands among the unknowns; empty in the plain form."""
        return slice(self.displacements, self.displacements + self.stresses)

    def mean_stress(self, z: Floats) -> Floats:
        """π at the vertices, (n_vertices,), N/mm²; of no meaning in the plain form."""
        return z[self.of_stress] if self.mixed else np.zeros(1)

    def _air_force(self, z: Floats) -> Floats:
        """p_in ∂V/∂z."""
        x = self.mesh.nodes + self.displacement(z)
        nodal = scatter_vector(chamber.gradient(x, self.mesh.walls), self.mesh.walls, len(x))
        force = self.reduced(z, nodal)
        force[self.of_arm] += self.arm.chamber(z[self.of_arm])[1]
        return self.pressure * force

    def reactions(self, z: Floats, load: float) -> Floats:
        """Forces that hold the nodes against stress and air, (n_nodes, 3), N, of what is modelled.

        They are zero at nodes that nothing holds. On a rim the air's share is its traction, which ∂V/∂x is not before
        it is added to that of the plate.
        """
        state = self.state(z, load)
        walls = self.mesh.walls
        air = scatter_vector(chamber.tractions(self.mesh.nodes + state.displacement, walls), walls, len(state.nodal))
        return state.nodal - load * self.pressure * air

    def volume_slope(self, point: Point) -> float:
        """dV/dλ of the chamber along the path, mm³; NaN at a limit point."""
        if self.pressure == 0.0 or abs(point.slope) < LEAST_SLOPE:
            return np.nan
        return float(self._air_force(point.z) @ point.direction) / (self.pressure * point.slope)

    def norm(self, residual: Floats) -> float:
        """Size of a residual relative to the air's forces at λ = 1 on the undeformed body."""
        if not np.isfinite(residual).all():
            return np.inf
        return float(np.linalg.norm(self._weighted(residual))) / self._scale

    def _weighted(self, residual: Floats) -> Floats:
        """Forces: moments over the body's length, volumes times the pressure over the length."""
        weighted = residual.copy()
        turns = [k for k, name in enumerate(self.arm.names) if is_angle(name)]
        weighted[self._arm_index[turns]] /= self.mesh.length
        weighted[self.of_stress] *= self.constants.shear / self.mesh.length
        return weighted

    # ------------------------------------------------------------------------ tangent

    def linearise(self, z: Floats, load: float, *, fresh: bool) -> None:
        """Assemble ∂²Π/∂z² at z; ``fresh`` factorises it, else older factors precondition it while they do."""
        self._product.data = self._tangent(z, load)
        self.load_derivative = -self._air_force(z)
        if fresh or not self._factorised:
            self._factorise()
        else:
            self._fresh = False

    def _factorise(self) -> None:
        assert self._product.data is not None
        self._solver.factorise(self._product.data)
        self._factorised = self._fresh = True

    def _tangent(self, z: Floats, load: float) -> Floats:
        u, cells, T = self.displacement(z), self.mesh.cells, z[self.of_arm]
        # Views of the buffer, in the order of `_number`.
        of_cells, of_walls, cells_at_arm, walls_at_arm, of_arm, *of_stress = self._parts[:-1]
        K = of_cells.reshape(len(cells), len(PAIRS), 3, 3)
        B, C = np.empty((0, 4, 10, 3)), np.empty((0, 4, 4))
        if self.mixed:
            B, C = of_stress[0].reshape(-1, 4, 10, 3), of_stress[1].reshape(-1, 4, 4)
        arguments = self.shearing, self.mixed, self.points, cells, u
        tangents(self.constants, *arguments, self.mean_stress(z), K, B, C)
        x = self.mesh.nodes + u
        walls = -load * self.pressure * chamber.hessian(x, self.mesh.walls).reshape(len(self.mesh.walls), 18, 18)
        cells_tip, cells_arm = self._on_arm(T, cells[self._cells_at_tip], unpacked(K[self._cells_at_tip]))
        walls_tip, walls_arm = self._on_arm(T, self.mesh.walls[self._walls_at_tip], walls[self._walls_at_tip])
        arm = cells_arm + walls_arm + self.arm.spring(T)[2] - load * self.pressure * self.arm.chamber(T)[2]
        arm += self.arm.second_variation(T, self.mesh.nodes[self.mesh.tip], self._tip_force(z, load))
        arm[np.tril_indices(len(arm), -1)] = 0.0
        of_walls[:], cells_at_arm[:], walls_at_arm[:] = walls.ravel(), cells_tip.ravel(), walls_tip.ravel()
        of_arm[:] = arm.ravel()
        if self.mixed:
            at_tip = B[self._cells_at_tip].reshape(-1, 4, 30)
            of_stress[2][:] = (at_tip @ self._arm_columns(T, cells[self._cells_at_tip])).ravel()
        return self._gather.data(self._buffer)

    def _tip_force(self, z: Floats, load: float) -> Floats:
        """Forces of body and air on the nodes of the arm's plate, (n_tip, 3), N."""
        state = self.state(z, load)
        x = self.mesh.nodes + state.displacement
        walls = self.mesh.walls[self._walls_at_tip]
        air = scatter_vector(chamber.gradient(x, walls), walls, len(x))
        return state.nodal[self.mesh.tip] - load * self.pressure * air[self.mesh.tip]

    def _arm_columns(self, T: Floats, elements: Ints) -> Floats:
        """∂u/∂T of the nodes of elements, zero off the plate, (n, 3 n_local, m)."""
        directions = self.arm.directions(T, self.mesh.nodes[self.mesh.tip])
        columns = np.zeros((*elements.shape, 3, len(self.arm.names)))
        rows = self._tip_row[elements]
        columns[rows >= 0] = directions[rows[rows >= 0]]
        return columns.reshape(len(elements), 3 * elements.shape[1], len(self.arm.names))

    def _on_arm(self, T: Floats, elements: Ints, blocks: Floats) -> tuple[Floats, Floats]:
        """Columns (n, 3 n_local, m) and diagonal block (m, m) of the arm, of element blocks."""
        columns = self._arm_columns(T, elements)
        products = blocks @ columns
        return products, np.einsum("nij,nik->jk", columns, products)

    def solve(self, right: Floats, tolerance: float, guess: Floats | None = None) -> Floats:
        """Solve ∂²Π/∂z² dz = right, at the z of the last :meth:`linearise`.

        Raises:
            SolveFailure: if the relative residual is not reached.
        """
        while True:
            found = gmres(
                lambda x: self._product(x[:, None], False)[:, 0],
                right,
                precondition=lambda r: self._solver.solve(r, check=None),
                tolerance=tolerance,
                x0=guess,
                max_iterations=MOST_KRYLOV,
            )
            if found.converged:
                return found.x
            if self._fresh:
                raise SolveFailure(
                    f"The tangent of the body could not be solved beyond a relative residual of "
                    f"{found.relative_residual:.1e}: choose another size of the tetrahedra."
                )
            self._factorise()

    def inner(self, a: Floats, b: Floats) -> float:
        """Mean product of displacements over :data:`LARGE_DISPLACEMENT` squared, and that of the arm."""
        large = LARGE_DISPLACEMENT * self.mesh.length
        mean = float(a[: self.displacements] @ b[: self.displacements]) / max(self.displacements, 1)
        weights = np.array([self.mesh.length**2 if is_angle(name) else 1.0 for name in self.arm.names])
        return (mean + float(np.sum(weights * a[self.of_arm] * b[self.of_arm])) / len(weights)) / large**2

    def settled(self, z: Floats, load: float) -> Floats:
        """z itself: nothing is solved for beside the others."""
        return z

    def negative_eigenvalues(self) -> int | None:
        """Directions in which the energy falls; those that the mean stress makes negative do not count."""
        negative = self._solver.statistics.negative_eigenvalues
        return None if negative is None else negative - self.stresses
