"""A shape of regions as another program would add one, in one file: a ring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.geometry.zero_set import Surface
from stages.regions import RegionSettings


@dataclass(frozen=True)
class Ring:
    """A torus around the axis of the cylinder; lengths in mm."""

    place: float
    radius: float
    thickness: float

    def depth(self, points: Floats) -> Floats:
        """Distance into the ring, (n,)."""
        radii = np.hypot(points[:, 1], points[:, 2])
        return np.asarray(0.5 * self.thickness - np.hypot(points[:, 0] - self.place, radii - self.radius))


class RingRegion(RegionSettings):
    """A ring around the axis, such as of a fibre."""

    shape: Literal["ring"] = Field(description="which shape")
    place: float = Field(description="its X1 [mm]")
    radius: float = Field(gt=0, description="its radius [mm]")
    thickness: float = Field(gt=0, description="its thickness [mm]")

    def build(self, domain: Domain, body: Surface | None) -> Ring:
        """The ring."""
        return Ring(self.place, self.radius, self.thickness)
