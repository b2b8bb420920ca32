"""Several chambers: channels along X1 that each bring in air of a pressure of their own and must stay apart.

They take the place of the one inlet that a domain has itself. Eqs. (18), (21) and (22) hold around each channel, in
proportion to its radius, with the distance from the domain's outside in place of R - r.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from skfem import MeshHex

from actuator.arrays import Floats, Ints
from actuator.domains import channel as channel_laws
from actuator.domains.interface import ROUNDING, Boundary, Domain, Parameter
from actuator.domains.outline import from_pieces
from actuator.domains.smooth_minimum import smooth_minimum
from actuator.domains.tetrahedra import Tetrahedra

#: How far the initial chamber reaches beyond its channel, in radii of that: the paper's from 0.3 R to 0.45 R.
CLEARANCE = (channel_laws.INNER - channel_laws.FREE) / channel_laws.FREE
#: Share of the room between two channels that each of their initial chambers takes at most: half stays wall.
TAKEN = 0.25


@dataclass(frozen=True)
class Channel:
    """A channel that is kept void, in the middle of which the air comes in.

    Attributes:
        name: of the chamber.
        centre: X2 and X3 of its axis, mm.
        radius: mm.
    """

    name: str
    centre: tuple[float, float]
    radius: float

    @property
    def reach(self) -> float:
        """The R of Eqs. (18), (21) and (22), of which the channel is the part that stays void, mm."""
        return self.radius / channel_laws.FREE

    def radii(self, points: Floats) -> Floats:
        """Distance from its axis, (...), mm."""
        return np.asarray(np.hypot(points[..., 1] - self.centre[0], points[..., 2] - self.centre[1]))

    def room(self, other: Channel) -> float:
        """Distance of two channels, mm; negative if they overlap."""
        return float(np.hypot(*np.subtract(self.centre, other.centre))) - self.radius - other.radius


class Chambered(Domain):
    """A domain with the inlets of several channels in place of its own; its sides run along X1, as they do.

    Args:
        base: the domain.
        channels: one for each chamber.
    """

    shape: ClassVar[str] = "chambered"

    def __init__(self, base: Domain, channels: Sequence[Channel]) -> None:
        self.base, self.channels, self.length = base, tuple(channels), base.length
        ring = base.outline()
        sides = np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)
        on_plane = np.abs(sides[..., 0]).max(axis=1) <= ROUNDING * base.size
        self._sides: Floats = sides[~(on_plane & base.mirrored)]

    # ---------------------------------------------------------------------------------------- those of the base

    @property
    def size(self) -> float:
        """R of the base, mm."""
        return self.base.size

    @property
    def mirrored(self) -> bool:
        """Whether half of the solid is modelled."""
        return self.base.mirrored

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Those of the base."""
        return self.base.parameters

    @property
    def mesh(self) -> MeshHex:
        """The base's."""
        return self.base.mesh

    @property
    def representatives(self) -> Ints:
        """The base's: channels are the same in cells that are translates of each other along X1."""
        return self.base.representatives

    @property
    def cell_class(self) -> Ints:
        """The base's."""
        return self.base.cell_class

    @property
    def fixed(self) -> Boundary:
        """The base's."""
        return self.base.fixed

    @property
    def tip(self) -> Boundary:
        """The base's."""
        return self.base.tip

    @property
    def symmetry(self) -> Boundary:
        """The base's."""
        return self.base.symmetry

    @property
    def outside(self) -> Boundary:
        """The base's."""
        return self.base.outside

    def refined(self, factor: int) -> Chambered:
        """The base refined, with the same channels."""
        return Chambered(self.base.refined(factor), self.channels)

    def prolongation(self, factor: int) -> sp.csr_array:
        """The base's."""
        return self.base.prolongation(factor)

    def tetrahedra(self) -> Tetrahedra:
        """The base's."""
        return self.base.tetrahedra()

    def outline(self) -> Floats:
        """The base's."""
        return self.base.outline()

    # ---------------------------------------------------------------------------------- functions of the place

    def depth(self, points: Floats) -> Floats:
        """Distance from the outside, (...), mm: from the sides of the section at X1 = 0, but for a symmetry plane."""
        return from_pieces(((start, end) for start, end in self._sides), points[..., 1:])

    def room(self, channel: Channel) -> float:
        """Distance of a channel from the outside, mm."""
        return float(self.depth(np.array([0.0, *channel.centre]))) - channel.radius

    def profiles(self, points: Floats) -> Floats:
        """Profile of the source of each channel, Eq. (18), (n_channels, ...)."""
        return np.stack([channel_laws.inlet(channel.radii(points), channel.reach) for channel in self.channels])

    def inlet(self, points: Floats) -> Floats:
        """Profile of all sources, which do not overlap; (...)."""
        return np.asarray(self.profiles(points).sum(axis=0))

    def passive_bound(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """The bound on χ in C_χ as in Eq. (21), around every channel; (...)."""
        width, depth = interface_width / length_unit, self.depth(points) / length_unit
        bounds = [
            channel_laws.passive_bound(channel.radii(points) / length_unit, depth, channel.reach / length_unit, width)
            for channel in self.channels
        ]
        return np.asarray(np.minimum.reduce(bounds))

    def initial_design(self, points: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """χ at t = 0 as in Eq. (22): solid but for a chamber around every channel, with walls between them; (...)."""
        width, depth = interface_width / length_unit, self.depth(points) / length_unit
        free = [(channel.radii(points) - channel.radius) / length_unit for channel in self.channels]
        solid = [own - self._clearance(channel) / length_unit for own, channel in zip(free, self.channels, strict=True)]
        wall = _least([depth - (1.0 - channel_laws.OUTER) * self.size / length_unit, *solid], width)
        return smooth_minimum(8.0 / (3.0 * width) * wall, 8.0 / width * _least([depth, *free], width), width)

    def _clearance(self, channel: Channel) -> float:
        """How far the initial chamber of a channel reaches beyond it, mm."""
        rooms = [channel.room(other) for other in self.channels if other is not channel]
        return min(CLEARANCE * channel.radius, TAKEN * min(rooms, default=np.inf))


def _least(distances: Sequence[Floats], width: float) -> Floats:
    return reduce(lambda one, other: smooth_minimum(one, other, width), distances)
