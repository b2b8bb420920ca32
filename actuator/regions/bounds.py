"""Bounds on χ that keep regions of the domain void or solid, of the kind of C_χ's, Eq. (21).

A bound is the signed distance to the surface of the regions times 8 / L_i, the slope that C_i allows: χ = 0 lies on
that surface, and a design is not bounded farther away from it than |χ| L_i / 8. Signed distances are combined by minima
and maxima, which leaves them exact on one side of the surface and right in sign on the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import ROUNDING, Domain
from actuator.domains.smooth_minimum import smooth_minimum
from actuator.failure import InvalidRegion
from actuator.regions.shapes import Shape

Kind = Literal["void", "solid", "free"]

#: By how much of χ a lower bound stays below an upper one in the optimisation: a sixteenth of an interface width. At a
#: border of void and solid, and at an outer wall, the two are one function, and the interior point method of the
#: subproblems needs room between them.
GAP = 0.5


class Region(NamedTuple):
    """A region.

    Attributes:
        kind: void, solid, or free, which undoes what earlier ones say of the same place.
        shape: where it is.
    """

    kind: Kind
    shape: Shape


class Bounds(NamedTuple):
    """Bounds on χ at points, dimensionless, in any shape; None where no region is of that kind.

    Attributes:
        lower: of solid regions, positive inside of them.
        upper: of void regions, negative inside of them.
    """

    lower: Floats | None
    upper: Floats | None

    def kept(self, chi: Floats, level: float = 0.0) -> Floats:
        """χ moved inside the bounds, which are for solids {χ > level}; the upper one counts where they cross."""
        lower, upper = self.at(level)
        if lower is not None:
            chi = np.maximum(chi, lower)
        return chi if upper is None else np.minimum(chi, upper)

    def at(self, level: float) -> Bounds:
        """The same for solids {χ > level}."""
        return Bounds(*(each if each is None or not level else each + level for each in self))

    def also(self, other: Bounds) -> Bounds:
        """These bounds and others."""
        return Bounds(_either(np.maximum, self.lower, other.lower), _either(np.minimum, self.upper, other.upper))

    def around(self, chi: Floats) -> Bounds:
        """The same, widened to a design that lies beyond them."""
        lower, upper = self
        return Bounds(
            None if lower is None else np.minimum(lower, chi), None if upper is None else np.maximum(upper, chi)
        )


def _either(choose: Callable[[Floats, Floats], Floats], one: Floats | None, other: Floats | None) -> Floats | None:
    return one if other is None else other if one is None else choose(one, other)


class _Depths(NamedTuple):
    """How deep points lie in the regions, in the order of the case, and in all of a kind; (n,) each, mm."""

    each: list[Floats]
    void: Floats
    solid: Floats


class Regions:
    """The regions of a design domain.

    Where half of a solid is modelled, each counts together with its mirror image across X2 = 0.

    Args:
        domain: the meshed domain.
        regions: later ones win where they are free.
    """

    def __init__(self, domain: Domain, regions: Sequence[Region] = ()) -> None:
        self._domain, self._regions = domain, regions

    @property
    def bind(self) -> bool:
        """Whether there is any void or solid region."""
        return any(region.kind != "free" for region in self._regions)

    def bounds(self, points: Floats, interface_width: float, length_unit: float = 1.0, gap: float = 0.0) -> Bounds:
        """Bounds on χ at points (..., 3), (...).

        Where a solid region reaches a void one or the domain's own bound, as at an outer wall, the lower bound gives
        way; without a gap it keeps its sign there.

        Args:
            points: mm.
            interface_width: L_i, mm.
            length_unit: see :meth:`Domain.passive_bound`.
            gap: least distance of the two bounds, in χ.
        """
        found = self._depths(points.reshape(-1, 3))
        slope, shape = 8.0 / interface_width, points.shape[:-1]
        upper = None if np.isneginf(found.void).all() else (-slope * found.void).reshape(shape)
        if np.isneginf(found.solid).all():
            return Bounds(None, upper)
        least = self._domain.passive_bound(points, interface_width, length_unit)
        least = least if upper is None else np.minimum(least, upper)
        return Bounds(np.minimum((slope * found.solid).reshape(shape), least - gap), upper)

    def all_bounds(self, interface_width: float, length_unit: float = 1.0) -> Bounds:
        """Bounds for the optimisation at the vertices, (n_vertices,): the domain's own too, and a gap between them.

        Between the vertices they are meant to be as linear in the cells as χ is. A design that keeps them at the
        vertices then keeps them everywhere, on any mesh; exact ones, of a hole in cells as wide as it, none may keep.
        """
        domain = self._domain
        lower, upper = self.bounds(domain.points, interface_width, length_unit, GAP)
        own = domain.passive_bound(domain.points, interface_width, length_unit)
        return Bounds(lower, own if upper is None else np.minimum(own, upper))

    def clipped(self, chi: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """A design at the vertices, (n_vertices,), moved inside all bounds; without regions the same."""
        return self.all_bounds(interface_width, length_unit).kept(chi) if self.bind else chi

    def fitted(self, chi: Floats, interface_width: float, length_unit: float = 1.0) -> Floats:
        """The same by the smooth minimum and maximum of Eq. (20), and only what they leave beyond the bounds is cut."""
        if not self.bind:
            return chi
        width = interface_width / length_unit
        bounds = self.bounds(self._domain.points, interface_width, length_unit, GAP)
        if bounds.lower is not None:
            chi = -smooth_minimum(-chi, -bounds.lower, width)
        if bounds.upper is not None:
            chi = smooth_minimum(chi, bounds.upper, width)
        return self.clipped(chi, interface_width, length_unit)

    def check(self, interface_width: float, length_unit: float = 1.0) -> None:
        """Refuse regions that the mesh cannot show, or that cannot all be kept.

        The latter is looked for at vertices and in the middle of edges and cells.

        Raises:
            InvalidRegion: if one contains no vertex, a void and a solid one overlap, or a solid one covers the inlet
                or other places that the domain itself keeps void.
        """
        if not self._regions:
            return
        domain, tiny = self._domain, ROUNDING * self._domain.size
        places = np.concatenate([domain.nodes, domain.points[domain.cells].mean(axis=1)])
        found = self._depths(places)
        for number, depth in enumerate(found.each):
            if not (depth[: len(domain.points)] > tiny).any():
                sentence = "contains no vertex of the mesh; make the region larger, or take a finer mesh"
                raise InvalidRegion(number, sentence)
        solid = found.solid > tiny
        if (both := solid & (found.void > tiny)).any():
            at = int(np.argmax(np.where(both, np.minimum(found.void, found.solid), -np.inf)))
            first, last = sorted(self._latest(found, kind, at) for kind in ("void", "solid"))
            raise InvalidRegion(
                last,
                f"is {self._regions[last].kind} and overlaps regions.{first}, which is {self._regions[first].kind}, at "
                f"{_text(places[at])}; move one of them, or let a free region between them in the list undo the first",
            )
        for taken, what in (
            (solid & (domain.inlet(places) > 0.0), "covers the inlet, which would lie outside the void"),
            (
                solid & (domain.passive_bound(places, interface_width, length_unit) < -tiny),
                "covers places that the domain keeps void around its inlet",
            ),
        ):
            if taken.any():
                at = int(np.argmax(np.where(taken, found.solid, -np.inf)))
                raise InvalidRegion(
                    self._latest(found, "solid", at),
                    f"is solid and {what}, at {_text(places[at])}; leave that place out, or let a free region after it "
                    "cut it out",
                )

    def _depths(self, points: Floats) -> _Depths:
        each = [region.shape.depth(points) for region in self._regions]
        if self._domain.mirrored:
            image = points * (1.0, -1.0, 1.0)
            each = [
                np.maximum(depth, region.shape.depth(image)) for depth, region in zip(each, self._regions, strict=True)
            ]
        void = solid = np.full(len(points), -np.inf)
        for depth, region in zip(each, self._regions, strict=True):
            if region.kind == "void":
                void = np.maximum(void, depth)
            elif region.kind == "solid":
                solid = np.maximum(solid, depth)
            else:
                void, solid = np.minimum(void, -depth), np.minimum(solid, -depth)
        return _Depths(each, void, solid)

    def _latest(self, found: _Depths, kind: Kind, at: int) -> int:
        """Number of the last region of a kind that a place lies in."""
        return max(
            number
            for number, (region, depth) in enumerate(zip(self._regions, found.each, strict=True))
            if region.kind == kind and depth[at] > 0.0
        )


def _text(place: Floats) -> str:
    return "({:.3g}, {:.3g}, {:.3g}) mm".format(*place)
