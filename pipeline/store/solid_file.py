"""Reading a solid from a file of any origin."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuator.failure import UnreadableSolid
from pipeline.exit_codes import ExitCode, Fault
from stages.formats import FORMATS, by_ending, decode


@dataclass(frozen=True)
class SolidFile:
    """A file and the triangles in it, as they stand there.

    Attributes:
        vertices: (n, 3), mm.
        triangles: (m, 3).
        sha256: of the file's bytes.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]
    sha256: str


def format_of(part: Path) -> str:
    """Name of the format that the ending of a file tells.

    Raises:
        Fault: if it tells none (USAGE).
    """
    format = by_ending(part.suffix)
    if format is None:
        endings = " or ".join(each.ending for each in FORMATS.values())
        raise Fault(ExitCode.USAGE, f"{part}: the ending must be {endings}; give a solid in one of these formats.")
    return format


def read_bytes(part: Path) -> bytes:
    """The bytes of a file.

    Raises:
        Fault: if it is missing or unreadable (ARTIFACT).
    """
    try:
        return part.read_bytes()
    except OSError as error:
        raise Fault(ExitCode.ARTIFACT, f"{part}: cannot be read ({error.strerror}); give another file.") from None


def read_solid(part: Path) -> SolidFile:
    """Read a file.

    Args:
        part: the file; its ending tells the format.

    Raises:
        Fault: if the ending is unknown (USAGE), or the file is missing or unreadable (ARTIFACT).
    """
    format = format_of(part)
    data = read_bytes(part)
    try:
        mesh = decode(data, format)
    except UnreadableSolid as failure:
        raise Fault(ExitCode.ARTIFACT, f"{part}: {failure}") from None
    if not len(mesh.faces):
        raise Fault(ExitCode.ARTIFACT, f"{part}: holds no triangles; give another file.")
    vertices, triangles = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    return SolidFile(vertices, triangles, hashlib.sha256(data).hexdigest())
