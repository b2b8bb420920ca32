"""Reading STL, binary and ASCII, strictly: what is cut short or damaged is told, never read as far as it goes.

Neither form has a check sum. A binary file has exactly as many bytes as the number of triangles in its header asks
for, whatever its first word is; every solid of an ASCII file ends with ``endsolid``. Parsers that overlook either take
half a part for a whole one.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from actuator.arrays import Floats
from actuator.failure import UnreadableSolid

if TYPE_CHECKING:  # slow to load: only where a file is read
    import trimesh

#: Bytes of free text that a binary file begins with, and of each triangle after the number of triangles.
HEADER, TRIANGLE = 80, 50
#: Bytes in which a binary file has a zero, in the number of its triangles if nowhere before, and a text has none.
LOOKED_AT = 1000
#: The words of a facet in an ASCII file; None stands for a number.
FACET = (
    *("facet", "normal", None, None, None, "outer", "loop"),
    *(3 * ("vertex", None, None, None)),
    *("endloop", "endfacet"),
)
#: Where the coordinates of a facet stand among them.
COORDINATES = (8, 9, 10, 12, 13, 14, 16, 17, 18)


def read(data: bytes) -> trimesh.Trimesh:
    """The triangles of a file, three vertices each.

    Raises:
        UnreadableSolid: if the file is cut short, longer than it says, or has what is no number.
    """
    import trimesh

    corners = _binary(data)
    if corners is None:
        corners = _ascii(_text(data))
    return trimesh.Trimesh(corners.reshape(-1, 3), np.arange(len(corners) * 3).reshape(-1, 3), process=False)


def _binary(data: bytes) -> Floats | None:
    """Corners (n, 3, 3) in a binary file; None if it is a text."""
    start = HEADER + 4
    count = int.from_bytes(data[HEADER:start], "little") if len(data) >= start else 0
    expected = start + TRIANGLE * count
    if len(data) < start or len(data) != expected:
        if _is_text(data):
            return None
        if len(data) < start:
            raise UnreadableSolid(
                f"The bytes are no stl: {len(data)} of them are fewer than a binary stl has, and text begins with "
                "'solid'; export the part again."
            )
        wrong = "is cut short" if len(data) < expected else "goes on after its end"
        raise UnreadableSolid(
            f"The stl {wrong}: its header promises {count} triangles in {expected} bytes, and there are {len(data)} "
            "bytes; copy or export the part again."
        )
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    corners = np.frombuffer(data, record, count, start)["corners"].astype(np.float64)
    lost = np.flatnonzero(~np.isfinite(corners).all(axis=(1, 2)))
    if len(lost):
        raise UnreadableSolid(
            f"Triangle {lost[0] + 1} of the stl has a coordinate that is not finite; export the part again."
        )
    return corners


def _is_text(data: bytes) -> bool:
    begin = data[:LOOKED_AT]
    return b"\0" not in begin and (
        begin.lstrip(b"\xef\xbb\xbf \t\r\n")[:5].lower() == b"solid" or b"facet" in begin.lower()
    )


def _text(data: bytes) -> str:
    # Names may be in any encoding; all else is ASCII.
    return data.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")


def _ascii(text: str) -> Floats:
    """Corners (n, 3, 3) of all solids of an ASCII file."""
    found, end, line = [], 0, 1
    opened: re.Match[str] | None = None
    for mark in re.finditer(r"^[ \t]*(end[ \t]*)?solid\b[^\n]*", text, re.MULTILINE | re.IGNORECASE):
        between = text[end : mark.start()]
        if bool(mark[1]) is (opened is None):
            line += between.count("\n")
            if opened:
                raise UnreadableSolid(
                    f"The stl is cut short: the solid before line {line} does not end with 'endsolid'; export the part "
                    "again."
                )
            _refuse_stray(between, line - between.count("\n"))
            raise UnreadableSolid(f"Line {line} of the stl ends a solid that nothing began; export the part again.")
        if opened:
            found.append(_facets(between, line))
        else:
            _refuse_stray(between, line)
        line += between.count("\n")
        opened, end = (None if opened else mark), mark.end()
    if opened:
        _facets(text[end:], line, whole=False)
        raise UnreadableSolid(
            f"The stl is cut short: the solid of line {line} does not end with 'endsolid'; export the part again."
        )
    _refuse_stray(text[end:], line)
    return np.concatenate([np.empty((0, 3, 3)), *found])


def _refuse_stray(between: str, line: int) -> None:
    """Do nothing if only blank space stands between solids."""
    if words := between.split():
        line += between[: between.index(words[0])].count("\n")
        raise UnreadableSolid(
            f"Line {line} of the stl has '{_shown(words[0])}' where only 'solid' can stand; export the part again."
        )


def _facets(body: str, line: int, *, whole: bool = True) -> Floats:
    """Corners (n, 3, 3) of the facets between ``solid`` and ``endsolid``; ``line`` is the one of ``solid``."""
    words = body.split()
    step = len(FACET)
    regular = len(words) % step == 0 and all(
        {word.lower() for word in set(words[place::step])} <= {expected}
        for place, expected in enumerate(FACET)
        if expected
    )
    if not regular:
        _complain(body, line, whole=whole)
        return np.empty((0, 3, 3))
    try:
        corners = np.array([list(map(float, words[place::step])) for place in COORDINATES])
    except ValueError:
        corners = np.full(1, np.nan)
    if not np.isfinite(corners).all():
        _complain(body, line, whole=whole)
    return np.ascontiguousarray(corners.T).reshape(-1, 3, 3)


def _complain(body: str, first: int, *, whole: bool) -> None:
    """Raise what is wrong first in a body; do nothing if it only ends too early and that is told elsewhere."""
    words = [(line, word) for line, text in enumerate(body.split("\n"), first) for word in text.split()]
    # The last word of what is cut short may be cut itself.
    for place, (line, word) in enumerate(words if whole else words[:-1]):
        expected = FACET[place % len(FACET)]
        if expected and word.lower() != expected:
            raise UnreadableSolid(
                f"Line {line} of the stl has '{_shown(word)}' where '{expected}' should stand; export the part again."
            )
        if place % len(FACET) in COORDINATES and not _is_finite(word):
            raise UnreadableSolid(
                f"Line {line} of the stl has '{_shown(word)}' for a coordinate; export the part again."
            )
    if whole:
        raise UnreadableSolid(
            f"The stl is cut short: a facet of the solid of line {first} is not whole; export the part again."
        )


def _is_finite(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def _shown(word: str) -> str:
    return (word if word.isprintable() else ascii(word)[1:-1])[:20]
