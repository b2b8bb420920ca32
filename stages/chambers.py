"""The domain as a case poses it: with its own inlet, or with the channels of several chambers."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from actuator.failure import InvalidSettings
from stages.settings import ProblemSettings

if TYPE_CHECKING:
    from actuator.domains.chambers import Chambered
    from actuator.domains.interface import Domain


def posed(problem: ProblemSettings) -> Domain:
    """The meshed domain with the inlets that a case gives it."""
    return _chambered(problem) if problem.load.chambers else problem.domain.build()


def _chambered(problem: ProblemSettings) -> Chambered:
    from actuator.domains.chambers import Chambered, Channel  # scikit-fem: only where a mesh is wanted

    channels = [Channel(each.name, (each.centre[0], each.centre[1]), each.radius) for each in problem.load.chambers]
    return Chambered(problem.domain.build(), channels)


def refuse_joined(problem: ProblemSettings) -> None:
    """Refuse chambers for whose walls there is no room; the problem is in the units of the case.

    Raises:
        actuator.failure.InvalidSettings: if a channel holds no vertex, or an interface is wider than what is left.
    """
    if not problem.load.chambers:
        return
    domain, least = _chambered(problem), problem.objective.interface_width
    remedy = f"an interface takes {least:g} mm (objective.interface_width)"
    for channel in domain.channels:
        if not (channel.radii(domain.points) < channel.radius).any():
            raise InvalidSettings(
                f"load.chambers: no vertex of the mesh lies in the channel of chamber '{channel.name}'; move it into "
                "the domain, make it wider, or take a finer mesh."
            )
        if (room := domain.room(channel)) < least:
            raise InvalidSettings(
                f"load.chambers: chamber '{channel.name}' is joined to the outside: its channel leaves {room:.3g} mm "
                f"for a wall, and {remedy}; move it inwards or make it thinner."
            )
    for one, other in combinations(domain.channels, 2):
        if (room := one.room(other)) < least:
            raise InvalidSettings(
                f"load.chambers: chambers '{one.name}' and '{other.name}' are joined: their channels leave {room:.3g} "
                f"mm for a wall, and {remedy}; move them apart or make them thinner."
            )
