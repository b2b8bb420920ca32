"""A design domain from outside the product: a box with graded cells, of which a half or the whole is modelled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Literal

import numpy as np
from pydantic import Field
from skfem import MeshHex

from actuator.arrays import Floats
from actuator.domains.interface import HEX_OFFSETS, Domain, Parameter
from actuator.domains.smooth_minimum import smooth_minimum
from stages.domains import DomainSettings


@dataclass(frozen=True)
class Box(Domain):
    """The box 0 <= X1 <= length, |X2| <= width / 2, |X3| <= height / 2, or its half X2 >= 0.

    Args:
        length, width, height: mm.
        along, across, up: cells along X1, X3, and across the half along X2.
        growth: how much larger the cells are at the tip, at the sides and at the top than at the other end of a row.
        whole: whether both halves are modelled.
    """

    shape: ClassVar[str] = "graded-box"

    length: float
    width: float
    height: float
    along: int
    across: int
    up: int
    growth: float
    whole: bool

    @property
    def size(self) -> float:
        return 0.5 * self.height

    @property
    def mirrored(self) -> bool:
        return not self.whole

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        sizes = {name: (getattr(self, name), "mm", f"{name} of the box") for name in ("length", "width", "height")}
        counts = {name: (getattr(self, name), "1", f"cells {name}") for name in ("along", "across", "up")}
        rest = {
            "growth": (self.growth, "1", "of the cells"),
            "whole": (self.whole, "1", "whether both halves are there"),
        }
        return {name: Parameter(*found) for name, found in (sizes | counts | rest).items()}

    @cached_property
    def mesh(self) -> MeshHex:
        x1, half = self.length * self._graded(self.along), 0.5 * self.width * self._graded(self.across)
        x2 = np.concatenate([-half[:0:-1], half]) if self.whole else half
        x3 = self.height * (self._graded(self.up) - 0.5)
        numbers = np.arange(len(x1) * len(x2) * len(x3)).reshape(len(x1), len(x2), len(x3))
        n1, n2, n3 = (n - 1 for n in numbers.shape)
        cells = np.stack([numbers[i : i + n1, j : j + n2, k : k + n3].ravel() for i, j, k in HEX_OFFSETS])
        points = np.stack([x.ravel() for x in np.meshgrid(x1, x2, x3, indexing="ij")])
        return MeshHex(points, cells)

    def _graded(self, cells: int) -> Floats:
        """Points from 0 to 1 along a smooth curve, so that those of a finer mesh lie between those of this one."""
        steps = np.arange(cells + 1) / cells
        if self.growth == 1.0:
            return steps
        graded = (self.growth**steps - 1.0) / (self.growth - 1.0)
        graded[-1] = 1.0
        return graded

    def refined(self, factor: int) -> Box:
        return replace(self, along=factor * self.along, across=factor * self.across, up=factor * self.up)

    def _from_axis(self, points: Floats) -> Floats:
        """Distance from the axis by sides: 1 at the nearest side, (...)."""
        return np.maximum(2.0 * np.abs(points[..., 1]) / self.width, 2.0 * np.abs(points[..., 2]) / self.height)

    def inlet(self, points: Floats) -> Floats:
        ramp = np.clip(10.0 * self._from_axis(points) - 1.5, 0.0, 1.0)
        return np.asarray(1.0 - np.sin(0.5 * np.pi * ramp) ** 2)

    def passive_bound(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        outwards = self._from_axis(points)
        return 8.0 / interface_width * self.size * np.minimum(1.0 - outwards, outwards - 0.3)

    def initial_design(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """A channel along X1 with a closed wall from 0.45 to 0.95 of the way to the sides, a little thinner above."""
        outwards = self.size * self._from_axis(points)
        width = interface_width / length_unit
        wall = smooth_minimum(0.95 * self.size - outwards, outwards - 0.45 * self.size, width)
        bound = self.passive_bound(points, interface_width, length_unit)
        return smooth_minimum(8.0 / (3.0 * width) * wall - 0.1 * np.maximum(points[..., 2], 0.0), bound, width)


class BoxSettings(DomainSettings):
    """A box with graded cells."""

    lengths: ClassVar[tuple[str, ...]] = ("length", "width", "height")
    counts: ClassVar[tuple[str, ...]] = ("along", "across", "up")

    shape: Literal["graded-box"] = Field("graded-box", description="which design domain")
    length: float = Field(15.0, gt=0, description="L, length [mm]")
    width: float = Field(24.0, gt=0, description="W, width [mm]")
    height: float = Field(20.0, gt=0, description="H, height [mm]")
    along: int = Field(3, ge=1, description="cells along X1 [-]")
    across: int = Field(3, ge=1, description="cells along X2 in each half [-]")
    up: int = Field(6, ge=1, description="cells along X3 [-]")
    growth: float = Field(1.5, gt=0, description="last cell over first [-]")
    whole: bool = Field(False, description="whether both halves are modelled")

    @property
    def size(self) -> float:
        return 0.5 * self.height

    @property
    def cells(self) -> int:
        return self.along * self.across * self.halves * self.up

    @property
    def halves(self) -> int:
        return 2 if self.whole else 1

    @classmethod
    def domain_type(cls) -> Callable[..., Domain]:
        return Box
