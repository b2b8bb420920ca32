"""The tangent of the state equations in reduced coordinates (x, p), assembled on a fixed pattern."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats
from actuator.equations.assembly import Gather
from actuator.equations.discretisation import Discretisation
from actuator.equations.kinematics import Kinematics
from actuator.equations.tangent_kernels import PACKED, flow_tangent, tangent
from actuator.material.constants import Constants

_UPPER = np.triu_indices(20)


class Tangent:
    """Blocks K_xx (symmetric, upper triangle), K_xp, K_px, K_pp (symmetric) and K_pχ at one design and state.

    Attributes:
        mechanics: gather of the upper triangle of K_xx; ``xx`` its matrix, (n_x, n_x).
        darcy: gather of the upper triangle of K_pp; ``pp`` its matrix, (n_p, n_p).
        xp, px: coupling blocks, (n_x, n_p) and (n_p, n_x).
        pc: derivative of the flow equations with respect to χ, (n_p, n_vertices).
    """

    def __init__(self, discretisation: Discretisation, kinematics: Kinematics) -> None:
        self._geometry, self._kinematics = discretisation.geometry, kinematics
        geometry, domain = self._geometry, discretisation.domain
        n_cells, n_x, n_p = len(geometry.cells), kinematics.size, domain.mesh.nvertices
        self._tip_cells = domain.tip_cells
        local = np.full(len(domain.nodes), -1)
        local[kinematics.tip] = np.arange(len(kinematics.tip))
        self._tip_local = local[geometry.node_cells[self._tip_cells]]  # (n_tip_cells, 20)
        n_tip = len(self._tip_cells)

        index = kinematics.index.astype(np.int32)[geometry.node_cells]  # (n_cells, 20, 3)
        tip_index = index[self._tip_cells]
        arm = np.arange(n_x, dtype=np.int32)[kinematics.of_arm]
        m = len(arm)
        vertices = geometry.cells.astype(np.int32)
        tip_vertices = vertices[self._tip_cells]

        sizes = [n_cells * PACKED, n_tip * 60 * m, m * m]
        self._uu, self._buffer_xx = _views(sizes)
        rows, columns = _mechanical_targets(index)
        arm_rows = np.broadcast_to(tip_index[..., None], (n_tip, 20, 3, m))
        arm_columns = np.where(arm_rows >= 0, arm, np.int32(-1))
        upper = np.arange(m)[:, None] <= np.arange(m)
        self.mechanics = Gather(
            np.concatenate([rows, arm_rows.ravel(), np.where(upper, arm[:, None], -1).ravel()]),
            np.concatenate([columns, arm_columns.ravel(), np.where(upper, arm, -1).ravel()]),
            (n_x, n_x),
        )
        del rows, columns

        # Coupling blocks share one set of targets; K_px is stored transposed in the buffer's order.
        u_rows = np.broadcast_to(index[..., None], (n_cells, 20, 3, 8)).ravel()
        p_columns = np.broadcast_to(vertices[:, None, None, :], (n_cells, 20, 3, 8)).ravel()
        t_rows = np.broadcast_to(arm[:, None], (n_tip, m, 8)).ravel()
        t_columns = np.broadcast_to(tip_vertices[:, None, :], (n_tip, m, 8)).ravel()
        self._coupling = [n_cells * 480, n_tip * 8 * m]
        self._up, self._buffer_xp = _views(self._coupling)
        self._xp = Gather(np.concatenate([u_rows, t_rows]), np.concatenate([p_columns, t_columns]), (n_x, n_p))
        u_columns = np.broadcast_to(index[:, None], (n_cells, 8, 20, 3)).ravel()
        p_rows = np.broadcast_to(vertices[:, :, None, None], (n_cells, 8, 20, 3)).ravel()
        t_columns = np.broadcast_to(arm, (n_tip, 8, m)).ravel()
        t_rows = np.broadcast_to(tip_vertices[..., None], (n_tip, 8, m)).ravel()
        self._pu, self._buffer_px = _views(self._coupling)
        self._px = Gather(np.concatenate([p_rows, t_rows]), np.concatenate([u_columns, t_columns]), (n_p, n_x))
        self.darcy, self._pc = darcy_gather(discretisation), darcy_gather(discretisation, upper=False)
        self._pp_buffer = np.empty((n_cells, 8, 8))

        self._xx_data = np.empty(self.mechanics.nonzeros)
        self._xp_data, self._px_data = np.empty(self._xp.nonzeros), np.empty(self._px.nonzeros)
        self._pp_data, self._pc_data = np.empty(self.darcy.nonzeros), np.empty(self._pc.nonzeros)
        self.xx = self.mechanics.matrix(self._xx_data)
        self.xp, self.px = self._xp.matrix(self._xp_data), self._px.matrix(self._px_data)
        self.pp, self.pc = self.darcy.matrix(self._pp_data), self._pc.matrix(self._pc_data)

    def assemble(self, source: Floats, c: Constants, chi: Floats, x: Floats, p: Floats, nodal: Floats) -> None:
        """Evaluate all blocks in place.

        Args:
            nodal: nodal residual forces at this state, (n_nodes, 3), N: the arm's rotation brings in their moment.
        """
        kinematics, n_tip = self._kinematics, len(self._tip_cells)
        u = kinematics.displacement(x)
        n_cells = len(self._geometry.cells)
        uu, up = self._uu[0].reshape(n_cells, PACKED), self._up[0].reshape(n_cells, 20, 3, 8)
        pp = self._pp_buffer
        tangent(self._geometry, source, c, chi, u, p, uu, up, pp)

        flat = self._tip_directions(x)
        arm = _unpack(uu[self._tip_cells]) @ flat
        self._uu[1][:] = arm.ravel()
        m = arm.shape[-1]
        corner = flat.reshape(-1, m).T @ arm.reshape(-1, m)
        corner += kinematics.spring_tangent(x) + kinematics.second_variation(x, nodal)
        self._uu[2][:] = corner.ravel()
        self._up[1][:] = (flat.transpose(0, 2, 1) @ up[self._tip_cells].reshape(n_tip, 60, 8)).ravel()

        self.mechanics.data(self._buffer_xx, self._xx_data)
        self._xp.data(self._buffer_xp, self._xp_data)
        self.darcy.data(pp.ravel(), self._pp_data)
        self._flow_data(c, chi, x, p, self._px_data, self._pc_data)

    def flow_blocks(self, c: Constants, chi: Floats, x: Floats, p: Floats) -> tuple[sp.csr_array, sp.csr_array]:
        """K_px and K_pχ at any design and state, in memory of their own."""
        px, pc = np.empty(self._px.nonzeros), np.empty(self._pc.nonzeros)
        self._flow_data(c, chi, x, p, px, pc)
        return self._px.matrix(px), self._pc.matrix(pc)

    def _flow_data(self, c: Constants, chi: Floats, x: Floats, p: Floats, px: Floats, pc: Floats) -> None:
        n_cells, n_tip = len(self._geometry.cells), len(self._tip_cells)
        pu, elements = self._pu[0].reshape(n_cells, 8, 20, 3), self._pp_buffer
        flow_tangent(self._geometry, c, chi, self._kinematics.displacement(x), p, pu, elements)
        self._pu[1][:] = (pu[self._tip_cells].reshape(n_tip, 8, 60) @ self._tip_directions(x)).ravel()
        self._px.data(self._buffer_px, px)
        self._pc.data(elements.ravel(), pc)

    def _tip_directions(self, x: Floats) -> Floats:
        """∂u/∂T in the cells at the tip, (n_tip_cells, 60, m): u of Γ follows T."""
        on_plate = self._kinematics.tip_directions(x)
        m = on_plate.shape[-1]
        directions = np.zeros((len(self._tip_cells), 20, 3, m))
        on_tip = self._tip_local >= 0
        directions[on_tip] = on_plate[self._tip_local[on_tip]]
        return directions.reshape(-1, 60, m)

    def force_block(self, elements: Floats, x: Floats) -> sp.csr_array:
        """Assemble derivatives of forces with respect to a vertex field, as K_xp: (n_x, n_vertices).

        Args:
            elements: (n_cells, 20, 3, 8).
        """
        arm = self._tip_directions(x).transpose(0, 2, 1) @ elements[self._tip_cells].reshape(-1, 60, 8)
        return self._xp.matrix(self._xp.data(np.concatenate([elements.ravel(), arm.ravel()])))

    def multiply(self, dx: Floats, dp: Floats) -> tuple[Floats, Floats]:
        """Tangent times (dx, dp)."""
        return symmetric_product(self.xx, dx) + self.xp @ dp, self.px @ dx + symmetric_product(self.pp, dp)

    def multiply_transposed(self, lx: Floats, lp: Floats) -> tuple[Floats, Floats]:
        """Transpose of the tangent times (lx, lp)."""
        return symmetric_product(self.xx, lx) + self.px.T @ lp, self.xp.T @ lx + symmetric_product(self.pp, lp)


def darcy_gather(discretisation: Discretisation, *, upper: bool = True) -> Gather:
    """Gather of a block on trilinear vertices, or its upper triangle, from element matrices (n_cells, 8, 8)."""
    cells = discretisation.geometry.cells.astype(np.int32)
    rows = np.broadcast_to(cells[:, :, None], (len(cells), 8, 8)).ravel()
    columns = np.broadcast_to(cells[:, None, :], (len(cells), 8, 8)).ravel()
    n = discretisation.domain.mesh.nvertices
    return Gather(np.where(rows <= columns, rows, -1) if upper else rows, columns, (n, n))


def _views(sizes: list[int]) -> tuple[list[Floats], Floats]:
    """One buffer and its consecutive parts."""
    buffer = np.empty(sum(sizes))
    return np.split(buffer, np.cumsum(sizes)[:-1]), buffer


def _mechanical_targets(index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    first, second = index[:, _UPPER[0]], index[:, _UPPER[1]]  # (n_cells, 210, 3)
    shape = (*first.shape, 3)
    rows = np.broadcast_to(first[..., None], shape)
    columns = np.broadcast_to(second[:, :, None, :], shape)
    dropped = (rows < 0) | (columns < 0)
    # A node's own block holds both triangles: keep one.
    own = (_UPPER[0] == _UPPER[1])[:, None, None] & (np.arange(3)[:, None] > np.arange(3))
    low, high = np.minimum(rows, columns), np.maximum(rows, columns)
    low[dropped | own] = -1
    return low.ravel(), high.ravel()


def _unpack(packed: Floats) -> Floats:
    blocks = packed.reshape(-1, 210, 3, 3)
    full = np.empty((len(blocks), 20, 20, 3, 3))
    full[:, _UPPER[1], _UPPER[0]] = blocks.transpose(0, 1, 3, 2)
    full[:, _UPPER[0], _UPPER[1]] = blocks
    return full.transpose(0, 1, 3, 2, 4).reshape(-1, 60, 60)


def symmetric_product(upper: sp.csr_array, v: Floats) -> Floats:
    """A v for a symmetric matrix given by its upper triangle with the whole diagonal stored."""
    diagonal = upper.data[upper.indptr[:-1]]
    return np.asarray(upper @ v + upper.T @ v - diagonal * v)
