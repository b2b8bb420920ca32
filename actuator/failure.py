"""Failures a user can act on: each is one full sentence that ends with the remedy."""

from __future__ import annotations


class Failure(Exception):
    """Base of all expected failures; ``str(failure)`` is one full sentence that says what to change."""


class InvalidField(Failure):
    """A field has the wrong size or holds values that are not finite."""


class EmptySolid(Failure):
    """No vertex of the domain is solid, so there is nothing to extract."""


class NotManifold(Failure):
    """The triangles do not bound a solid and could not be repaired."""


class LooseBodies(Failure):
    """The solid is of several bodies, and that was to be refused."""


class UnusableRecording(Failure):
    """A recorded test holds nothing that can be compared with a prediction."""


class GridTooLarge(Failure):
    """A grid would have more voxels than the memory should be asked for."""


class SolveFailure(Failure):
    """A linear system could not be solved to the accuracy asked for."""


class OutOfMemory(Failure):
    """The memory does not suffice; a smaller step would need as much."""


class UnreadableSolid(Failure):
    """Bytes that should hold a solid hold none."""


class InvalidSettings(Failure):
    """The settings ask for what cannot be done with this case or on this machine."""


class InvalidRegion(InvalidSettings):
    """A region of the case cannot be kept as it is.

    Args:
        number: which one, counted from 0 in the order of the case.
        sentence: what is wrong and what to change, without its key and full stop.
    """

    def __init__(self, number: int, sentence: str) -> None:
        super().__init__(f"regions.{number}: {sentence}.")
        self.number, self.sentence = number, sentence


class NotInflatable(Failure):
    """A solid is not one body that two plates close to an air chamber, or has walls that its mesh cannot show."""


class Leaking(NotInflatable):
    """Two plates do not close a solid to an air chamber."""
