"""Shapes of regions by their signed distance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from actuator.arrays import Floats
from actuator.geometry.distance import distance, signed_distance
from actuator.geometry.zero_set import Surface


class Shape(Protocol):
    """A part of space."""

    def depth(self, points: Floats) -> Floats:
        """Distance of points (n, 3) from the surface of the shape, (n,), mm; positive inside, negative outside."""


@dataclass(frozen=True)
class Box:
    """A box with sides along the axes.

    Attributes:
        low, high: its corners with the smallest and the largest coordinates, (3,), mm.
    """

    low: Floats
    high: Floats

    def depth(self, points: Floats) -> Floats:
        """See :class:`Shape`."""
        return _within(np.abs(points - 0.5 * (self.low + self.high)) - 0.5 * (self.high - self.low))


@dataclass(frozen=True)
class Cylinder:
    """A round cylinder with flat ends.

    Attributes:
        start, end: centres of its ends, (3,), mm.
        radius: mm.
    """

    start: Floats
    end: Floats
    radius: float

    def depth(self, points: Floats) -> Floats:
        """See :class:`Shape`."""
        axis, ray = self.end - self.start, points - self.start
        length = float(np.linalg.norm(axis))
        along = ray @ (axis / length)
        across = np.linalg.norm(ray - along[:, None] * (axis / length), axis=1)
        return _within(np.column_stack([across - self.radius, np.abs(along - 0.5 * length) - 0.5 * length]))


@dataclass(frozen=True)
class Sphere:
    """A sphere.

    Attributes:
        centre: (3,), mm.
        radius: mm.
    """

    centre: Floats
    radius: float

    def depth(self, points: Floats) -> Floats:
        """See :class:`Shape`."""
        return np.asarray(self.radius - np.linalg.norm(points - self.centre, axis=1))


@dataclass(frozen=True)
class Skin:
    """What lies within a distance of a surface, on both of its sides.

    Attributes:
        surface: need not be closed.
        thickness: that distance, mm.
    """

    surface: Surface
    thickness: float

    def depth(self, points: Floats) -> Floats:
        """See :class:`Shape`."""
        return self.thickness - distance(points, self.surface)


@dataclass(frozen=True)
class Body:
    """The inside of a closed surface.

    Attributes:
        surface: closed, oriented outwards.
    """

    surface: Surface

    def depth(self, points: Floats) -> Floats:
        """See :class:`Shape`."""
        return -signed_distance(points, self.surface)


def _within(beyond: Floats) -> Floats:
    """Depth in an intersection of slabs at right angles, (n,), from how far points lie beyond each, (n, k)."""
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return np.asarray(-(outside + np.minimum(beyond.max(axis=1), 0.0)))
