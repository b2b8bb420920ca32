"""What the columns of a recorded test hold, by the names and units in its header."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from pipeline.exit_codes import ExitCode, Fault, shown
from pipeline.measured.titles import name_and_unit
from stages.units import PRESSURES, spelling


class Quantity(StrEnum):
    """What a recording may hold; the values are those of the command's options."""

    PRESSURE = "pressure"
    DISPLACEMENT = "displacement"
    TIME = "time"


@dataclass(frozen=True)
class Column:
    """A column of a file.

    Attributes:
        index: from 0.
        title: as the header has it.
        unit: V or mV for voltages.
        factor: of a number to kPa, mm, s or V.
        voltage: whether the factor leads to V.
    """

    index: int
    title: str
    unit: str
    factor: float
    voltage: bool


#: Words in a name that tell the quantity, and names that are it as a whole.
_WORDS = {
    Quantity.PRESSURE: {"pressure"},
    Quantity.DISPLACEMENT: {"displacement", "elongation", "deflection", "travel", "distance"},
    Quantity.TIME: {"time"},
}
_NAMES = {Quantity.PRESSURE: {"p"}, Quantity.DISPLACEMENT: {"d", "u"}, Quantity.TIME: {"t"}}

_VOLTS = {"V": 1.0, "mV": 1e-3}
#: Factors to kPa, mm and s.
_UNITS = {
    Quantity.PRESSURE: PRESSURES,
    Quantity.DISPLACEMENT: {"mm": 1.0, "cm": 10.0, "m": 1e3, "µm": 1e-3, "um": 1e-3},
    Quantity.TIME: {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
}


def named(column: Column) -> str:
    """How sentences name a column."""
    return f"column '{shown(column.title)}'"


def columns_of(where: str, header: list[str], wanted: Mapping[Quantity, str | None]) -> dict[Quantity, Column]:
    """The columns of pressure and displacement, and that of time if there is one.

    Args:
        where: file and line of the header, for messages.
        header: its cells.
        wanted: titles or names given by the user, perhaps with a unit that the header lacks; None to find them.

    Raises:
        Fault: if a column is missing, ambiguous or of unknown unit (ARTIFACT), or a name given is not there (USAGE).
    """
    titles = [cell.strip() for cell in header]
    found = {}
    for quantity in Quantity:
        given = wanted.get(quantity)
        places = _given(where, titles, quantity, given) if given else _places(titles, quantity)
        if len(places) > 1:
            these = ", ".join(f"'{shown(titles[place])}'" for place in places)
            remedy = "rename all but one" if given else f"name one with --{quantity}-column"
            raise Fault(ExitCode.ARTIFACT, f"{where}: the columns {these} may all be the {quantity}; {remedy}.")
        if places:
            unit = name_and_unit(titles[places[0]])[1] or (name_and_unit(given)[1] if given else "")
            found[quantity] = _column(where, places[0], titles[places[0]], unit, quantity)
        elif quantity is not Quantity.TIME:
            known = shown(", ".join(f"'{title}'" for title in titles), 200)
            raise Fault(
                ExitCode.ARTIFACT,
                f"{where}: no column is the {quantity}; write '{quantity} [{next(iter(_UNITS[quantity]))}]' or "
                f"'{quantity}_voltage [V]' into the header, or name one of {known} with --{quantity}-column; lines "
                "above the header must begin with #.",
            )
    pressure, displacement = found[Quantity.PRESSURE], found[Quantity.DISPLACEMENT]
    if pressure.index == displacement.index:
        raise Fault(
            ExitCode.USAGE, f"{where}: {named(pressure)} cannot be pressure and displacement; name another column."
        )
    return found


def _places(titles: list[str], quantity: Quantity) -> list[int]:
    """Columns whose name tells a quantity."""
    found = []
    for place, title in enumerate(titles):
        name = name_and_unit(title)[0].casefold()
        if name in _NAMES[quantity] or _WORDS[quantity] & set(re.split(r"[\W_]+", name)):
            found.append(place)
    return found


def _given(where: str, titles: list[str], quantity: Quantity, given: str) -> list[int]:
    """Columns of a title or name that the user gave."""
    places = [place for place, title in enumerate(titles) if title == given.strip()]
    places = places or [place for place, title in enumerate(titles) if name_and_unit(title)[0] == given.strip()]
    places = places or [place for place, title in enumerate(titles) if title == name_and_unit(given)[0]]
    if not places:
        close = difflib.get_close_matches(given, titles, n=1, cutoff=0.5)
        names = shown(", ".join(f"'{title}'" for title in close or titles), 200)
        raise Fault(ExitCode.USAGE, f"--{quantity}-column: {where} has no column '{given}'; name {names}.")
    return places


def _column(where: str, index: int, title: str, unit: str, quantity: Quantity) -> Column:
    units = _UNITS[quantity] | ({} if quantity is Quantity.TIME else _VOLTS)
    if spelt := spelling(unit, units):
        return Column(index, title, spelt, units[spelt], spelt in _VOLTS)
    fault = f"'{shown(unit)}' is no unit of {quantity} that is known" if unit else "it has no unit"
    name, first = name_and_unit(title)[0], next(iter(units))
    remedy = f"write one of {', '.join(units)} into the header, as in '{shown(name)} [{first}]'"
    if not unit:
        remedy += f", or into the option: --{quantity}-column '{shown(title)} [{first}]'"
    raise Fault(ExitCode.ARTIFACT, f"{where}: column '{shown(title)}': {fault}; {remedy}.")
