"""The stages by name; a module of its own, so that the command line need not load them to know them."""

from enum import StrEnum


class Stage(StrEnum):
    """The stages, in order."""

    OPTIMIZE = "optimize"
    REFINE = "refine"
    MIRROR = "mirror"
    EXPORT = "export"


STAGES = tuple(stage.value for stage in Stage)
