"""Reading a solid from an STL or 3MF file of any origin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuator.failure import UnreadableSolid
from pipeline.exit_codes import ExitCode, Fault
from stages import export

FORMATS: dict[str, export.Format] = {".stl": "stl", ".3mf": "3mf"}


def read_solid(part: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (n, 3), mm, and triangles (m, 3) as they stand in a file.

    Args:
        part: the file; its ending tells the format.

    Raises:
        Fault: if the ending is unknown (USAGE), or the file is missing or unreadable (ARTIFACT).
    """
    format = FORMATS.get(part.suffix.lower())
    if format is None:
        endings = " or ".join(FORMATS)
        raise Fault(ExitCode.USAGE, f"{part}: the ending must be {endings}; give a solid in one of these formats.")
    try:
        data = part.read_bytes()
    except OSError as error:
        raise Fault(ExitCode.ARTIFACT, f"{part}: cannot be read ({error.strerror}); give another file.") from None
    try:
        mesh = export.decode(data, format)
    except UnreadableSolid as failure:
        raise Fault(ExitCode.ARTIFACT, f"{part}: {failure}") from None
    if not len(mesh.faces):
        raise Fault(ExitCode.ARTIFACT, f"{part}: holds no triangles; give another file.")
    return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
