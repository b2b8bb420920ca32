"""A tapered finger for gripper.yaml: a box of hexahedra whose section shrinks to seven tenths at the tip."""

import meshio
import numpy as np

from actuator.domains.interface import HEX_OFFSETS
from actuator.domains.prism import Box

box = Box(length=45.0, width=30.0, height=30.0, edge=4.0, across=6, up=6, rings=3, layers=24, whole=False, refinement=1)
points = box.points.copy()
points[:, 1:] *= 1.0 - 0.3 * points[:, :1] / box.length
x1, x2, _ = points.T
sets = {"fixed": x1 == 0.0, "tip": x1 == box.length, "symmetry": x2 == 0.0}
around = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]  # VTK's order
hexahedra = box.cells[:, [HEX_OFFSETS.tolist().index(list(corner)) for corner in around]]
data = {name: inside.astype(np.int8) for name, inside in sets.items()}
meshio.write("gripper.vtu", meshio.Mesh(points, [("hexahedron", hexahedra)], point_data=data), compression="zlib")
