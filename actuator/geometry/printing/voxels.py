"""A closed surface on a regular grid: which voxels have their centre inside.

VTK cuts the surface by the planes of the grid and fills the outlines (vtkPolyDataToImageStencil). A wall that is as
thick as the pitch or thicker lets no path of void voxels through that goes from face to face: each step along it moves
by one pitch at most across the wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from actuator.arrays import Bools, Floats
from actuator.failure import GridTooLarge
from actuator.geometry.zero_set import Surface

#: Most voxels of a grid; what is computed on it needs about 60 bytes for each, together 1.5 GB.
MOST = 25_000_000
#: Fraction of a voxel by which the surface may stick out of the grid, so that rounding adds no layer.
SLACK = 1.0e-3


@dataclass(frozen=True)
class Voxels:
    """A solid on a grid.

    Attributes:
        solid: whether a voxel is solid, (n1, n2, n3); the outermost layer on every side is void.
        origin: centre of voxel (0, 0, 0), (3,), mm.
        pitch: distance of neighbours, mm.
    """

    solid: Bools
    origin: Floats
    pitch: float

    def position(self, index: Floats) -> tuple[float, float, float]:
        """Where an index (3,), whole or not, lies, mm."""
        x, y, z = (self.origin + self.pitch * np.asarray(index)).tolist()
        return x, y, z


def voxelised(surface: Surface, pitch: float) -> Voxels:
    """Put a solid on a grid whose middle is that of its bounding box.

    Args:
        surface: closed, oriented 2-manifold.
        pitch: mm.

    Raises:
        GridTooLarge: if there would be more than :data:`MOST` voxels.
    """
    import pyvista  # slow to load: only where something is measured
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkImagingStencil import vtkImageStencilToImage, vtkPolyDataToImageStencil

    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    inner = np.maximum(np.ceil((high - low) / pitch - SLACK), 1.0)
    size = inner + 2.0
    if size.prod() > MOST:
        enough = 1.05 * pitch * (size.prod() / MOST) ** (1.0 / 3.0)  # rounding to two digits takes up to 5 % off
        raise GridTooLarge(
            f"With a pitch of {pitch:g} mm the grid would have {size.prod():.2g} voxels, more than {MOST:.2g}; "
            f"choose a pitch of {enough:.2g} mm or more."
        )
    shape = size.astype(int)
    origin = 0.5 * (low + high) - 0.5 * (size - 1.0) * pitch
    stencil = vtkPolyDataToImageStencil()
    stencil.SetInputData(pyvista.PolyData.from_regular_faces(surface.vertices, surface.triangles))
    stencil.SetOutputOrigin(*origin.tolist())
    stencil.SetOutputSpacing(pitch, pitch, pitch)
    stencil.SetOutputWholeExtent(0, int(shape[0]) - 1, 0, int(shape[1]) - 1, 0, int(shape[2]) - 1)
    image = vtkImageStencilToImage()
    image.SetInputConnection(stencil.GetOutputPort())
    image.SetInsideValue(1)
    image.SetOutsideValue(0)
    image.SetOutputScalarTypeToUnsignedChar()
    image.Update()
    values = vtk_to_numpy(image.GetOutput().GetPointData().GetScalars())
    return Voxels(np.ascontiguousarray(values.reshape(shape[::-1]).T == 1), origin, pitch)
