"""Prisms along X1 whose section is star-shaped, a box with rounded edges among them, half of them or whole.

The inlet is a channel along X1. Where the paper has the radius R of its cylinder, a prism has the distance of the
channel's axis from the wall; distances from the wall take the place of R - r.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats, Ints
from actuator.domains import channel, o_grid, outline
from actuator.domains.interface import Parameter
from actuator.domains.swept import Swept


@dataclass(frozen=True)
class Walled(channel.ByDepth, Swept):
    """A domain swept along X1 inside a wall.

    Args:
        length: L, mm.
        across, up: m2 and m3, cells along the sides of a quarter of the section's core, along X2 and X3.
        rings: k, cells between the core and the wall.
        layers: N1, cells along X1.
        whole: whether both halves are meshed.
        refinement: into how many cells each of the section is divided along either side.
    """

    length: float
    across: int
    up: int
    rings: int
    layers: int
    whole: bool
    refinement: int

    @property
    @abstractmethod
    def wall(self) -> Floats:
        """The wall of the half X2 >= 0, see :mod:`actuator.domains.outline`; a cached property."""

    @property
    @abstractmethod
    def axis(self) -> float:
        """X3 of the inlet's axis, mm."""

    @property
    def _fixed(self) -> Ints | None:
        """Points of the wall that the core's corners look at."""
        return None

    @property
    def mirrored(self) -> bool:
        """Whether half of the solid is meshed."""
        return not self.whole

    @property
    def size(self) -> float:
        """Half the height along X3, mm."""
        return 0.5 * float(np.ptp(self.wall[:, 1]))

    @cached_property
    def reach(self) -> float:
        """Distance of the inlet's axis from the wall, mm: the R of Eqs. (18), (21) and (22)."""
        return float(outline.distance(self.wall, np.array([0.0, self.axis])))

    @property
    def _mesh_parameters(self) -> dict[str, Parameter]:
        counts = {
            "across": "cells along X2 of a quarter of the section's core",
            "up": "cells along X3 of a quarter of the section's core",
            "rings": "rings of cells between the core and the wall",
            "layers": "cells along X1",
            "whole": "whether both halves are meshed",
            "refinement": "into how many each cell of the section is divided along either side",
        }
        return {name: Parameter(getattr(self, name), "1", meaning) for name, meaning in counts.items()}

    @cached_property
    def half_section(self) -> tuple[Floats, Ints]:
        """An O-grid inside the wall."""
        return outline.meshed(self.wall, self.axis, (self.across, self.up), self.rings, self.refinement, self._fixed)

    def half_section_prolongation(self, factor: int) -> sp.csr_array:
        """Interpolation in the reference coordinates of the O-grid's cells."""
        cells = self.across * self.refinement, self.up * self.refinement
        return o_grid.prolongation(cells, self.rings * self.refinement, factor)

    def outline(self) -> Floats:
        """The wall around what is modelled, (n, 2), mm."""
        return np.concatenate([self.wall, self.wall[-2:0:-1] * (-1.0, 1.0)]) if self.whole else self.wall

    def refined(self, factor: int) -> Self:
        """The same domain with ``factor`` times the cells in all three directions; new vertices lie on the wall."""
        if factor < 1:
            raise ValueError("the refinement factor must be at least 1")
        return replace(self, layers=factor * self.layers, refinement=factor * self.refinement)

    # ------------------------------------------------------------- functions of the place

    def inlet(self, points: Floats) -> Floats:
        """Profile of Eq. (18) around the inlet's axis, (...)."""
        return channel.inlet(self._radii(points), self.reach)

    def _radii(self, points: Floats) -> Floats:
        return np.asarray(np.hypot(points[..., 1], points[..., 2] - self.axis))

    def _distances(self, points: Floats, unit: float) -> tuple[Floats, Floats, float]:
        """From the inlet's axis, from the wall, and of one from the other."""
        return self._radii(points) / unit, outline.distance(self.wall, points[..., 1:]) / unit, self.reach / unit


@dataclass(frozen=True)
class Box(Walled):
    """A box, 0 <= X1 <= length, |X2| <= width / 2, |X3| <= height / 2, or its half X2 >= 0.

    Args:
        width, height: W and H, mm.
        edge: radius of the edges along X1, mm.

    Raises:
        ValueError: if a cell would be turned inside out.
    """

    shape: ClassVar[str] = "box"

    width: float
    height: float
    edge: float

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """The arguments it is made from."""
        return {
            "length": Parameter(self.length, "mm", "length of the box"),
            "width": Parameter(self.width, "mm", "width of the box, of both halves"),
            "height": Parameter(self.height, "mm", "height of the box"),
            "edge": Parameter(self.edge, "mm", "radius of its edges along X1"),
            **self._mesh_parameters,
        }

    @property
    def axis(self) -> float:
        """The middle."""
        return 0.0

    @cached_property
    def _wall(self) -> tuple[Floats, Ints]:
        return outline.box(self.width, self.height, self.edge)

    @property
    def wall(self) -> Floats:
        """Three sides and the edges between them."""
        return self._wall[0]

    @property
    def _fixed(self) -> Ints:
        """The middles of the two edges."""
        return self._wall[1]


@dataclass(frozen=True)
class Prism(Walled):
    """A prism whose section is star-shaped, or its half X2 >= 0.

    Args:
        profile: the wall of the half X2 >= 0, points (X2, X3), mm.
        inlet_height: X3 of the inlet's axis, mm.

    Raises:
        ValueError: if the wall is not one, or a cell would be turned inside out.
    """

    shape: ClassVar[str] = "prism"

    profile: tuple[tuple[float, float], ...]
    inlet_height: float

    def __post_init__(self) -> None:
        points = np.asarray(self.profile, dtype=np.float64)
        if wrong := outline.fault(points, self.inlet_height):
            raise ValueError(wrong)
        object.__setattr__(self, "profile", tuple((x2, x3) for x2, x3 in points.tolist()))

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """The arguments it is made from."""
        return {
            "length": Parameter(self.length, "mm", "length of the prism"),
            "profile": Parameter(self.wall, "mm", "points (X2, X3) of the wall of the half X2 >= 0"),
            "inlet_height": Parameter(self.inlet_height, "mm", "X3 of the inlet's axis"),
            **self._mesh_parameters,
        }

    @property
    def axis(self) -> float:
        """X3 of the inlet's axis, mm."""
        return self.inlet_height

    @cached_property
    def wall(self) -> Floats:
        """The profile."""
        return np.array(self.profile)
