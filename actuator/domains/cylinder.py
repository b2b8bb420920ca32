"""The whole cylinder: the half cylinder's mesh and its mirror image, for which no symmetry is assumed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Parameter


class Cylinder(HalfCylinder):
    """Both halves of a cylinder as one mesh: sizes, inlet, bound and initial design are those of the half cylinder.

    The vertices of every section are those of the half, then the images of those off the plane X2 = 0.
    """

    shape: ClassVar[str] = "cylinder"

    @property
    def mirrored(self) -> bool:
        """No: both halves are meshed."""
        return False

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """The arguments it is made from."""
        found = super().parameters
        return {
            name: parameter._replace(meaning=parameter.meaning.replace("half cylinder", "cylinder"))
            for name, parameter in found.items()
        }

    def outline(self) -> Floats:
        """The disk with a round wall, whatever the mesh, (n, 2), mm."""
        half = super().outline()
        return np.concatenate([half, half[-2:0:-1] * (-1.0, 1.0)])
