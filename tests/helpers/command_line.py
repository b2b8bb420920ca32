"""What tests of the command line share: a tiny case, and how a call of the program ended."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import pytest

from pipeline.store import seal

#: 48 cells: the smallest mesh on which everything still happens.
TINY = """\
domain:
  core_cells: 2
  rings: 1
  layers: 3
objective:
  strain_energy_shift: 4/L_i
optimizer:
  max_updates: 1
"""

#: Its part is inflated in as few and as large steps and cells as will do.
COARSE = "inflate: {size: 4.0, max_load: 1.0, points: 1}\n"

#: Inflating its part takes seconds: where that is not the question, a run ends with the part.
TO_PART = ("--until", "export")


@dataclass(frozen=True)
class Ended:
    """How a command line ended."""

    code: int
    out: str
    err: str


Poro = Callable[..., Ended]

#: Of tests that end a process by SIGINT, SIGTERM or SIGKILL: Windows has no such signals. One mark for four test files.
POSIX_SIGNALS = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

#: Starts the program in a process of its own.
PROGRAM = [sys.executable, "-m", "poro"]


def environment() -> dict[str, str]:
    """Of such a process, wherever it works."""
    return os.environ | {"PYTHONUNBUFFERED": "1", "PYTHONPATH": os.pathsep.join(entry for entry in sys.path if entry)}


@contextmanager
def edited(path: Path) -> Iterator[h5py.File]:
    """An artifact to be changed by hand and sealed again, as if the program had written it so."""
    with h5py.File(path, "a") as file:
        yield file
    data = path.read_bytes()[seal.SIZE :]
    path.write_bytes(seal.block(data) + data)
