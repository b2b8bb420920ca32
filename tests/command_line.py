"""What tests of the command line share: a tiny case, and how a call of the program ended."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

#: 24 cells: the smallest mesh on which everything still happens.
TINY = """\
domain:
  core_cells: 2
  rings: 1
  layers: 3
optimizer:
  max_updates: 1
"""


@dataclass(frozen=True)
class Ended:
    """How a command line ended."""

    code: int
    out: str
    err: str


Poro = Callable[..., Ended]
