"""The O-grid of a half disk: a core of m x 2 m cells, whose sides bulge towards the circle, and k rings around it.

Points are (X2, X3) with X2 >= 0; the core's points come first, row by row, then the rings from inside outwards.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats, Ints

#: Bulge of the core's sides, 0 straight to 1 circular. 0.3 makes the three angles that meet at a
#: corner of the core nearly equal (118 and 2 x 121 degrees).
CORE_BULGE = 0.3


def half_disk(radius: float, core_cells: int, rings: int) -> tuple[Floats, Ints]:
    """Points (ns, 2) and cells (nc, 2, 2) indexed by the two local axes.

    Args:
        radius: R, mm.
        core_cells: m, cells along each side of a quarter of the core.
        rings: k, cells between the core and the circle.
    """
    m, k = core_cells, rings
    # The core's half side is chosen so that cells of the core and of the rings have about the same size;
    # with few rings its corners must still keep off the wall, or the rings would turn inside out.
    half_side = min(0.7 * m / (k + 0.875 * m), 0.6) * radius
    t, s = np.meshgrid(np.arange(m + 1) / m, np.arange(-m, m + 1) / m, indexing="ij")
    core = half_side * _bulged_square(t, s)
    core_id, ring_id = _numbers(m, k)
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 4 * m + 1)
    wall = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    wall[[0, -1], 0] = 0.0
    inner = core.reshape(-1, 2)[ring_id[0]]
    weight = (np.arange(1, k + 1) / k)[:, None, None]
    points = np.concatenate([core.reshape(-1, 2), ((1.0 - weight) * inner + weight * wall).reshape(-1, 2)])
    return points, np.concatenate([_quads(core_id), _quads(ring_id)])


def prolongation(core_cells: int, rings: int, factor: int) -> sp.csr_array:
    """Bilinear interpolation from the points of a half disk to those with ``factor`` times the cells each way.

    Shape (ns_fine, ns_coarse), rows sum to 1.
    """
    m, k = core_cells, rings
    core, ring = _grid_weights(m, 2 * m, factor), _grid_weights(k, 4 * m, factor)
    core_id, ring_id = _numbers(m, k)
    n = int(ring_id.max()) + 1
    to_section = sp.csr_array((np.ones(ring_id.size), (np.arange(ring_id.size), ring_id.ravel())), (ring_id.size, n))
    pad = sp.csr_array((core.shape[0], n - core_id.size))
    outer = (ring @ to_section).tocsr()[4 * m * factor + 1 :]  # the first row of the rings is the core's outline
    return sp.vstack([sp.hstack([core, pad]), outer])


def _numbers(m: int, k: int) -> tuple[Ints, Ints]:
    """Numbers of the core's points, (m + 1, 2 m + 1), and of the rings', (k + 1, 4 m + 1), the first the outline.

    The outline of the core runs from X3 < 0 over X2 > 0 to X3 > 0.
    """
    core_id = np.arange((m + 1) * (2 * m + 1)).reshape(m + 1, 2 * m + 1)
    outline = np.concatenate([core_id[:-1, 0], core_id[-1, :], core_id[-2::-1, -1]])
    return core_id, np.concatenate([outline[None], core_id.size + np.arange(k * (4 * m + 1)).reshape(k, -1)])


def _bulged_square(t: Floats, s: Floats) -> Floats:
    """Coons patch on [-1, 1]² whose sides bulge towards a circle; returns (X2, X3) per unit half side."""

    def side(x: Floats) -> tuple[Floats, Floats]:
        along = (1.0 - CORE_BULGE) * x + CORE_BULGE * np.sqrt(2.0) * np.sin(0.25 * np.pi * x)
        across = (1.0 - CORE_BULGE) + CORE_BULGE * np.sqrt(2.0) * np.cos(0.25 * np.pi * x)
        return along, across

    along_t, across_t = side(t)
    along_s, across_s = side(s)
    # Opposite sides are mirror images, so the two linear blends and the bilinear corners collapse to:
    x2 = t * across_s + along_t - t
    x3 = s * across_t + along_s - s
    return np.stack([x2, x3], axis=-1)


def _quads(node: Ints) -> Ints:
    """Cells (n, 2, 2) of a structured grid of node numbers."""
    corners = np.stack([np.stack([node[:-1, :-1], node[:-1, 1:]], -1), np.stack([node[1:, :-1], node[1:, 1:]], -1)], -2)
    return corners.reshape(-1, 2, 2)


def line_weights(cells: int, factor: int) -> sp.csr_array:
    """Linear interpolation from ``cells + 1`` equidistant nodes to ``factor * cells + 1``."""
    fine = np.arange(factor * cells + 1)
    left = np.minimum(fine // factor, cells - 1)
    weight = (fine - factor * left) / factor
    rows = np.concatenate([fine, fine])
    columns = np.concatenate([left, left + 1])
    matrix = sp.csr_array((np.concatenate([1.0 - weight, weight]), (rows, columns)), (len(fine), cells + 1))
    matrix.eliminate_zeros()
    return matrix


def _grid_weights(first: int, second: int, factor: int) -> sp.csr_array:
    return sp.kron(line_weights(first, factor), line_weights(second, factor), format="csr")
