"""From which level on a voxel has a way out: a flood that rises from the border of the grid.

Every voxel has a level, and a way out is as high as the highest voxel on it. The lowest way out of every voxel is found
by a priority flood (Barnes, Lehman & Mulla, "Priority-flood", Computers & Geosciences 62, 117 (2014)), here in three
dimensions with one bucket for each level.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Levels = NDArray[np.int32]


def flooded(level: Levels) -> tuple[Levels, Levels]:
    """Height of the lowest way out, and the next voxel on it.

    Args:
        level: (n1, n2, n3), from 0; negative where nothing passes. Open voxels on the border are outside.

    Returns:
        The height of the lowest way out over the faces of voxels, at least the voxel's own level, and -1 where there is
        none; and the number of the next voxel on it in C order, -1 outside. Both are (n1, n2, n3). From a voxel that is
        lower than its way out, this way stays lower up to the place where it leaves the basin.
    """
    height, following = _flooded(np.ascontiguousarray(level, dtype=np.int32), int(level.max(initial=0)) + 1)
    return height, following


@njit(cache=True)
def _flooded(level: Levels, levels: int) -> tuple[Levels, Levels]:
    n1, n2, n3 = level.shape
    own = level.ravel()
    height = np.full(own.size, -1, np.int32)
    following = np.full(own.size, -1, np.int32)
    # Buckets as linked lists: the first voxel of each, and after a voxel the next one in the same bucket.
    first = np.full(levels, -1, np.int32)
    after = np.full(own.size, -1, np.int32)
    # What lies lower than the way to it comes before the rest of the level, so that the ways out of a basin leave it
    # where it overflows first.
    basin = -1
    for v in range(own.size):
        i, j, k = v // (n2 * n3), v // n3 % n2, v % n3
        border = i in (0, n1 - 1) or j in (0, n2 - 1) or k in (0, n3 - 1)
        if border and own[v] >= 0:
            height[v] = own[v]
            after[v], first[own[v]] = first[own[v]], v
    for reached in range(levels):
        while basin >= 0 or first[reached] >= 0:
            if basin >= 0:
                v, basin = basin, after[basin]
            else:
                v, first[reached] = first[reached], after[first[reached]]
            place = (v // (n2 * n3), v // n3 % n2, v % n3)
            for axis in range(3):
                step = (n2 * n3, n3, 1)[axis]
                last = (n1, n2, n3)[axis] - 1
                for side in (-1, 1):
                    if place[axis] == (0 if side < 0 else last):
                        continue
                    w = v + side * step
                    if own[w] < 0 or height[w] >= 0:
                        continue
                    height[w] = max(reached, own[w])
                    following[w] = v
                    if own[w] < reached:
                        after[w], basin = basin, w
                    else:
                        after[w], first[own[w]] = first[own[w]], w
    return height.reshape(level.shape), following.reshape(level.shape)
