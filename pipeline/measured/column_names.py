"""What the columns of a recorded test hold, by the names and units in its header."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from pipeline.exit_codes import ExitCode, Fault, shown
from pipeline.measured.titles import name_and_unit, words
from pipeline.measured.units import USUAL, Kind, factor_of
from stages.units import spelling


class Quantity(StrEnum):
    """What a recording may hold; the values are those of the command's options."""

    PRESSURE = "pressure"
    DISPLACEMENT = "displacement"
    ANGLE = "angle"
    FORCE = "force"
    TIME = "time"

    @property
    def kind(self) -> Kind:
        """What its unit is one of."""
        return _KINDS[self]


_KINDS = {
    Quantity.PRESSURE: Kind.PRESSURE,
    Quantity.DISPLACEMENT: Kind.LENGTH,
    Quantity.ANGLE: Kind.ANGLE,
    Quantity.FORCE: Kind.FORCE,
    Quantity.TIME: Kind.TIME,
}
#: What a part may answer to the pressure, the first first: each can be compared with a prediction.
RESPONSES = (Quantity.DISPLACEMENT, Quantity.ANGLE, Quantity.FORCE)


@dataclass(frozen=True)
class Column:
    """A column of a file.

    Attributes:
        index: from 0.
        title: as the header has it.
        unit: V or mV for voltages.
        factor: of a number to kPa, mm, degrees, N, s or V.
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
    Quantity.DISPLACEMENT: {
        *("displacement", "elongation", "deflection", "travel", "distance", "extension", "stroke", "disp", "displ")
    },
    Quantity.ANGLE: {"angle", "theta", "theta2", "θ", "θ2", "rotation", "tilt", "phi", "φ"},
    Quantity.FORCE: {"force", "load", "loadcell"},
    Quantity.TIME: {"time", "timestamp", "datetime", "elapsed"},
}
_NAMES = {
    Quantity.PRESSURE: {"p", "p in"},
    Quantity.DISPLACEMENT: {"d", "u"},
    Quantity.ANGLE: {"alpha", "α"},
    Quantity.FORCE: {"f"},
    Quantity.TIME: {"t", "x value", "millis"},  # X_Value: the first column of LabVIEW's .lvm
}
#: Words of columns that stand beside the one that was measured, or of another pressure than the part's.
_BESIDE = {"setpoint", "set", "target", "command", "commanded", "desired", "reference", "ref", "supply", "ambient"}
_BESIDE |= {"atmospheric", "barometric", "velocity", "speed", "rate"}

_VOLTS = USUAL[Kind.VOLTAGE]


def named(column: Column) -> str:
    """How sentences name a column."""
    return f"column '{shown(column.title)}'"


def is_header(cells: list[str], wanted: Mapping[Quantity, str | None]) -> bool:
    """Whether a line names, each in a cell of its own, the pressure and what a part answers to it."""
    places: dict[Quantity, list[int]] = {}
    for quantity in Quantity:
        given = wanted.get(quantity)
        places[quantity] = _same(cells, given) if given else _places(cells, quantity)
    pressures = set(places[Quantity.PRESSURE])
    answers = {place for quantity in RESPONSES for place in places[quantity]}
    return any(place != other for place in pressures for other in answers)


def columns_of(
    where: str, header: list[str], wanted: Mapping[Quantity, str | None]
) -> tuple[dict[Quantity, Column], list[str]]:
    """The columns of the pressure, of what the part answers to it, and of time if there is one.

    Args:
        where: file and line of the header, for messages.
        header: its cells.
        wanted: titles or names given by the user, perhaps with a unit that the header lacks; None to find them.

    Returns:
        The columns, and sentences about those that were found and cannot be used.

    Raises:
        Fault: if a column is missing, ambiguous or of unknown unit (ARTIFACT), or a name given is not there (USAGE).
    """
    titles = [cell.strip() for cell in header]
    found: dict[Quantity, Column] = {}
    notes: list[str] = []
    for quantity in (Quantity.PRESSURE, *RESPONSES, Quantity.TIME):
        # Beside another answer, an angle or a force that is not understood is passed over, and said.
        spare = quantity in RESPONSES and bool(found.keys() & set(RESPONSES)) and not wanted.get(quantity)
        try:
            if column := _found(where, titles, quantity, wanted.get(quantity)):
                found[quantity] = column
        except Fault as fault:
            if not spare:
                raise
            notes.append(f"the {quantity} is not compared: {str(fault).removeprefix(f'{where}: ').rstrip('.')}")
    pressure, answers = found.get(Quantity.PRESSURE), [found[each] for each in RESPONSES if each in found]
    if pressure is None:
        raise _missing(where, titles, Quantity.PRESSURE)
    if not answers:
        raise _missing(where, titles, Quantity.DISPLACEMENT)
    if pressure.index in {answer.index for answer in answers}:
        raise Fault(
            ExitCode.USAGE, f"{where}: {named(pressure)} cannot be pressure and displacement; name another column."
        )
    return found, notes


def _found(where: str, titles: list[str], quantity: Quantity, given: str | None) -> Column | None:
    """The column of a quantity, if there is one."""
    places = _given(where, titles, quantity, given) if given else _places(titles, quantity)
    if len(places) > 1:
        these = ", ".join(f"'{shown(titles[place])}'" for place in places)
        remedy = "rename all but one" if given else f"name one with --{quantity}-column"
        raise Fault(ExitCode.ARTIFACT, f"{where}: the columns {these} may all be the {quantity}; {remedy}.")
    if not places:
        return None
    unit = _unit(titles[places[0]], quantity) or (_unit(given, quantity) if given else "")
    return _column(where, places[0], titles[places[0]], unit, quantity)


def _missing(where: str, titles: list[str], quantity: Quantity) -> Fault:
    known = shown(", ".join(f"'{title}'" for title in titles), 200)
    return Fault(
        ExitCode.ARTIFACT,
        f"{where}: no column is the {quantity}; write '{quantity} [{quantity.kind}]' or "
        f"'{quantity}_voltage [V]' into the header, or name one of {known} with --{quantity}-column; lines "
        "above the header must begin with #.",
    )


def _places(titles: list[str], quantity: Quantity) -> list[int]:
    """Columns whose name tells a quantity; a ``load displacement [mm]`` is what its unit says."""
    found = []
    for place, title in enumerate(titles):
        name, unit = name_and_unit(title, [quantity.kind, Kind.VOLTAGE])
        if not _tells(name, quantity):
            continue
        others = [each for each in Quantity if each is not quantity and _tells(name, each)]
        if _factor(unit, quantity) is None and any(_factor(unit, each) is not None for each in others):
            continue
        found.append(place)
    measured = [place for place in found if not _BESIDE & set(words(titles[place]))]
    return measured or found


def _tells(name: str, quantity: Quantity) -> bool:
    spelt = words(name)
    return " ".join(spelt) in _NAMES[quantity] or bool(_WORDS[quantity] & set(spelt))


def _same(titles: list[str], given: str) -> list[int]:
    """Columns of a title or name that the user gave."""
    given = given.strip()
    places = [place for place, title in enumerate(titles) if title == given]
    places = places or [place for place, title in enumerate(titles) if name_and_unit(title)[0] == given]
    return places or [place for place, title in enumerate(titles) if title == name_and_unit(given)[0]]


def _given(where: str, titles: list[str], quantity: Quantity, given: str) -> list[int]:
    if places := _same(titles, given):
        return places
    close = difflib.get_close_matches(given, titles, n=1, cutoff=0.5)
    names = shown(", ".join(f"'{title}'" for title in close or titles), 200)
    raise Fault(ExitCode.USAGE, f"--{quantity}-column: {where} has no column '{given}'; name {names}.")


def _unit(title: str, quantity: Quantity) -> str:
    return name_and_unit(title, [quantity.kind, *_electric(quantity)])[1]


def _electric(quantity: Quantity) -> list[Kind]:
    """Voltage, where the command has a sensitivity for it."""
    return [Kind.VOLTAGE] if quantity in (Quantity.PRESSURE, Quantity.DISPLACEMENT) else []


def _factor(unit: str, quantity: Quantity) -> float | None:
    """Factor of a unit, also of a voltage's."""
    found = factor_of(unit, quantity.kind)
    volts = [factor_of(unit, kind) for kind in _electric(quantity)]
    return next((each for each in (found, *volts) if each is not None), None)


def _column(where: str, index: int, title: str, unit: str, quantity: Quantity) -> Column:
    usual = USUAL[quantity.kind] | (_VOLTS if _electric(quantity) else {})
    factor = _factor(unit, quantity)
    if factor is not None:
        return Column(index, title, spelling(unit, usual) or unit, factor, factor_of(unit, quantity.kind) is None)
    if quantity is Quantity.TIME and words(title) == ["millis"]:  # of an Arduino
        return Column(index, title, "ms", 1e-3, False)
    if quantity is Quantity.TIME and not unit:
        return Column(index, title, "", 1.0, False)
    fault = f"'{shown(unit)}' is no unit of {quantity} that is known" if unit else "it has no unit"
    name, first = name_and_unit(title)[0], next(iter(usual))
    remedy = f"write one of {', '.join(usual)} into the header, as in '{shown(name)} [{first}]'"
    if not unit:
        remedy += f", or into the option: --{quantity}-column '{shown(title)} [{first}]'"
    raise Fault(ExitCode.ARTIFACT, f"{where}: column '{shown(title)}': {fault}; {remedy}.")
