"""Titles of columns: a name, and the unit of the numbers below it."""

from __future__ import annotations

import re
from collections.abc import Collection

_UNIT = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<square>[^\]]*)\]|\((?P<round>[^)]*)\)|/\s*(?P<slash>\S+))\s*")


def name_and_unit(title: str, units: Collection[str] = ()) -> tuple[str, str]:
    """Name and unit of a title such as ``stress [kPa]``, ``stress (kPa)`` or ``stress / kPa``; the unit may be empty.

    Args:
        title: of the column.
        units: in lower case, that may also stand bare at the end, as in ``stress_kPa``.
    """
    bare = re.fullmatch(r"(.*\S)[\s_]+(\S+?)\s*", title)
    if bare and bare[2].lower() in units:
        return bare[1].strip(), bare[2]
    match = _UNIT.fullmatch(title)
    if not match:
        return title.strip(), ""
    return match["name"].strip(), (match["square"] or match["round"] or match["slash"] or "").strip()
