"""Titles of columns: a name, and the unit of the numbers below it."""

from __future__ import annotations

import re
from collections.abc import Collection

from pipeline.measured.units import Kind, factor_of, is_usual

#: Longest unit of letters alone that may stand without brackets, but for the usual ones: psi, Torr, mmHg.
SHORT = 4

_BRACKETS = re.compile(r"\[([^\]]*)\]|\(([^()]*(?:\([^()]*\))?[^()]*)\)|/\s*([^\s()\[\]]+)\s*$")
#: Between a name and a unit without brackets: pressure_kPa, Pressure kPa, Pressure, kPa, pressure.kPa, Pressure in kPa.
_BARE = re.compile(r"(.*?[^\W_])(?:[\s_,.:;-]+in\s+|[\s_,.:;-]+)(\S+?)\s*")


def name_and_unit(title: str, kinds: Collection[Kind] = ()) -> tuple[str, str]:
    """Name and unit of a title such as ``stress [kPa]``, ``stress (kPa)`` or ``stress / kPa``; the unit may be empty.

    Args:
        title: of the column.
        kinds: of units that may also stand without brackets at the end, as in ``stress_kPa``, and that are looked for
            first where there are several brackets, as in ``Strain (extension) (%)``.
    """
    found = list(_BRACKETS.finditer(title))
    units = [" ".join(next(group for group in match.groups() if group is not None).split()) for match in found]
    known = [i for i, unit in enumerate(units) if unit and any(factor_of(unit, kind) is not None for kind in kinds)]
    if known:
        last = found[known[-1]]
        return " ".join(f"{title[: last.start()]} {title[last.end() :]}".split()), units[known[-1]]
    bare = _BARE.fullmatch(title)
    # Other words are not worth looking up.
    short = bare is not None and (len(bare[2]) <= SHORT or not bare[2].isalpha() or is_usual(bare[2]))
    if bare and short and any(factor_of(bare[2], kind) is not None for kind in kinds):
        return bare[1].strip(), bare[2]
    if found:
        return title[: found[-1].start()].strip(), units[-1]
    return title.strip(), ""


def words(title: str) -> list[str]:
    """The words of a title in lower case; ``InletPressure_1`` has three."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", title)
    return [word for word in re.split(r"[\W_]+", apart.casefold()) if word]
