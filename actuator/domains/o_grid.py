"""O-grids of half a section: a core of cells, whose sides bulge towards the wall, and k rings around it.

Points are (X2, X3) with X2 >= 0; the core's points come first, row by row, then the rings from inside outwards. The
core of a disk has m x 2 m cells; that of any other section m2 x 2 m3.
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
    core_id, ring_id = _numbers(m, m, k)
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 4 * m + 1)
    wall = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    wall[[0, -1], 0] = 0.0
    return _ringed(core.reshape(-1, 2), wall, core_id, ring_id)


def within(wall: Floats, axis: float, core_cells: tuple[int, int], rings: int) -> tuple[Floats, Ints]:
    """Points and cells, as of :func:`half_disk`, inside any wall of which the axis sees every point.

    The core is the transfinite interpolation (Gordon & Hall, doi:10.1002/nme.1620070405) of sides between the straight
    one and the wall itself, both drawn towards the axis.

    Args:
        wall: points of the wall, (2 m2 + 2 m3 + 1, 2), from X3 < 0 over X2 > 0 to X3 > 0; the ends have X2 = 0. The
            core's corners look at the points m2 and m2 + 2 m3.
        axis: X3 of the axis that the core lies around, mm.
        core_cells: m2 and m3, cells along the sides of a quarter of the core.
        rings: k, cells between the core and the wall.
    """
    (m2, m3), origin = core_cells, np.array([0.0, axis])
    mean = 0.5 * (m2 + m3)
    # Cells of the core and of the rings about as large; the core's corners keep off the wall.
    drawn = origin + min(mean / (mean + rings), 0.85) * (wall - origin)
    low, high = drawn[m2], drawn[m2 + 2 * m3]
    s, r = np.arange(m2 + 1)[:, None] / m2, np.arange(2 * m3 + 1)[:, None] / (2 * m3)
    # Below and above, from and to the plane X2 = 0 at the height of the corner.
    below, above = (corner * np.concatenate([s, np.ones_like(s)], axis=1) for corner in (low, high))
    straight = np.concatenate([below[:-1], low + r * (high - low), above[-2::-1]])
    outline = (1.0 - CORE_BULGE) * straight + CORE_BULGE * drawn
    outline[[0, -1], 0] = 0.0
    bottom, side, top = outline[: m2 + 1], outline[m2 : m2 + 2 * m3 + 1], outline[m2 + 2 * m3 :][::-1]
    t, r = s[:, :, None], r[None]
    middle = bottom[0] + r[0] * (top[0] - bottom[0])
    core = (1.0 - r) * bottom[:, None] + r * top[:, None] + (1.0 - t) * middle + t * side
    core -= (1.0 - t) * ((1.0 - r) * bottom[0] + r * top[0]) + t * ((1.0 - r) * bottom[-1] + r * top[-1])
    core_id, ring_id = _numbers(m2, m3, rings)
    points = core.reshape(-1, 2)
    points[core_id[0], 0] = 0.0
    return _ringed(points, wall, core_id, ring_id)


def _ringed(core: Floats, wall: Floats, core_id: Ints, ring_id: Ints) -> tuple[Floats, Ints]:
    """Points and cells of a core and of the rings between its outline and the wall."""
    weight = (np.arange(1, len(ring_id)) / (len(ring_id) - 1))[:, None, None]
    rings = (1.0 - weight) * core[ring_id[0]] + weight * wall
    return np.concatenate([core, rings.reshape(-1, 2)]), np.concatenate([_quads(core_id), _quads(ring_id)])


def prolongation(core_cells: tuple[int, int], rings: int, factor: int) -> sp.csr_array:
    """Bilinear interpolation from the points of an O-grid to those with ``factor`` times the cells each way.

    Shape (ns_fine, ns_coarse), rows sum to 1.
    """
    (m2, m3), k = core_cells, rings
    core, ring = _grid_weights(m2, 2 * m3, factor), _grid_weights(k, 2 * (m2 + m3), factor)
    core_id, ring_id = _numbers(m2, m3, k)
    n = int(ring_id.max()) + 1
    to_section = sp.csr_array((np.ones(ring_id.size), (np.arange(ring_id.size), ring_id.ravel())), (ring_id.size, n))
    pad = sp.csr_array((core.shape[0], n - core_id.size))
    outer = (ring @ to_section).tocsr()[
        2 * (m2 + m3) * factor + 1 :
    ]  # the first row of the rings is the core's outline
    return sp.vstack([sp.hstack([core, pad]), outer])


def _numbers(m2: int, m3: int, k: int) -> tuple[Ints, Ints]:
    """Numbers of the core's points, (m2 + 1, 2 m3 + 1), and of the rings', (k + 1, 2 m2 + 2 m3 + 1), first the outline.

    The outline of the core runs from X3 < 0 over X2 > 0 to X3 > 0.
    """
    core_id = np.arange((m2 + 1) * (2 * m3 + 1)).reshape(m2 + 1, 2 * m3 + 1)
    outline = np.concatenate([core_id[:-1, 0], core_id[-1, :], core_id[-2::-1, -1]])
    return core_id, np.concatenate([outline[None], core_id.size + np.arange(k * len(outline)).reshape(k, -1)])


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
