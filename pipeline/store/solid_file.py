"""Reading a solid from a file of any origin."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from actuator.failure import UnreadableSolid
from pipeline.exit_codes import ExitCode, Fault
from stages.formats import FORMATS, OWN, by_ending, decode
from stages.words import Unit

#: Millimetres of each.
MILLIMETRES: dict[Unit, float] = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4, "ft": 304.8}
#: Longest sides, mm, between which nobody is asked whether a part is in mm, and those that are likely in another unit;
#: chosen: an actuator shorter than 3 mm is less likely than one of 3 inches, one longer than 10 m than one of 10000 um.
PLAUSIBLE, LIKELY = (3.0, 10_000.0), (5.0, 1000.0)


@dataclass(frozen=True)
class SolidFile:
    """A file and the triangles in it, as they stand there.

    Attributes:
        vertices: (n, 3), mm, in the unit that the file or the user says.
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


def read_solid(part: Path, unit: Unit | None = None) -> SolidFile:
    """Read a file.

    Args:
        part: the file; its ending tells the format.
        unit: of a file that does not say its own; mm by default, unless the part would be of no likely size.

    Raises:
        Fault: if the ending is unknown or there are two units (USAGE), the file is missing or unreadable (ARTIFACT), or
            its unit is doubtful (BAD_SOLID).
    """
    format = format_of(part)
    if unit and FORMATS[format].has_unit:
        raise Fault(ExitCode.USAGE, f"--unit {unit}: {part} says its unit itself; leave the option out.")
    data = read_bytes(part)
    try:
        mesh = decode(data, format)
    except UnreadableSolid as failure:
        raise Fault(ExitCode.ARTIFACT, f"{part}: {failure}") from None
    if not len(mesh.faces):
        raise Fault(ExitCode.ARTIFACT, f"{part}: holds no triangles; give another file.")
    vertices, triangles = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    if unit:
        vertices = MILLIMETRES[unit] * vertices
    elif not (FORMATS[format].has_unit or data.startswith(OWN)):
        _ask(part, float(np.ptp(vertices, axis=0).max()))
    return SolidFile(vertices, triangles, hashlib.sha256(data).hexdigest())


def _ask(part: Path, size: float) -> None:
    """Do nothing if a part whose unit nobody said is likely to be in mm.

    Raises:
        Fault: with what it would be in other units (BAD_SOLID).
    """
    if not np.isfinite(size) or PLAUSIBLE[0] <= size <= PLAUSIBLE[1]:
        return
    least, most = LIKELY
    likely = [f"{unit} ({size * mm:.3g} mm)" for unit, mm in MILLIMETRES.items() if least <= size * mm <= most]
    guess = f" Is it in {' or '.join(likely)}?" if likely else ""
    raise Fault(
        ExitCode.BAD_SOLID,
        f"{part}: the part would be {size:.3g} mm long, and the file does not say its unit.{guess} Name it by --unit; "
        "--unit mm if that is right.",
    )
