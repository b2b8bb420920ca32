"""Normals of triangles."""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats


def triangle_normals(corners: Floats) -> Floats:
    """Normals of triangles by the right-hand rule, (m, 3), as long as twice the triangle's area, mm².

    Args:
        corners: of the triangles, (m, 3, 3), mm; the second axis counts the corners.
    """
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
