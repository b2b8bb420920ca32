"""Names of cases, which become names of files."""

from __future__ import annotations

from stages.chain import STAGES
from stages.formats import FORMATS

#: No folders, nothing hidden.
NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"

#: Names that Windows gives to devices, whatever their ending.
DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(10))}


def reserved_endings() -> tuple[str, ...]:
    """Endings that a name must not have, since other files of a case end so."""
    artifacts = [row.suffix.removesuffix(".h5") for row in STAGES.values()]
    parts = [format.ending for format in FORMATS.values()]
    return (*filter(None, artifacts), ".compare", ".checkpoint", *parts)


def refusal(name: str) -> str:
    """Why a name cannot be that of a case; empty if it can be."""
    if name.partition(".")[0].lower() in DEVICES:
        return f"'{name}' is a device on Windows, not a file"
    reserved = next((ending for ending in reserved_endings() if name.endswith(ending)), None)
    return f"must not end in {reserved}" if reserved else ""
