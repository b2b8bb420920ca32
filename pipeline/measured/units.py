"""Units of columns, as people and instruments spell them."""

from __future__ import annotations

import re
from enum import StrEnum
from functools import cache

from stages.units import PRESSURES, parsed, registry, spelling


class Kind(StrEnum):
    """What a unit may be one of; the values are the units that everything is converted to."""

    PRESSURE = "kPa"
    LENGTH = "mm"
    TIME = "s"
    ANGLE = "deg"
    FORCE = "N"
    STRESS = "MPa"
    STRAIN = ""
    AREA = "mm²"
    VOLTAGE = "V"


#: Factors of the usual units; the first few are what messages propose. Others are looked up in a library.
USUAL: dict[Kind, dict[str, float]] = {
    Kind.PRESSURE: PRESSURES,
    Kind.LENGTH: {"mm": 1.0, "cm": 10.0, "m": 1e3, "µm": 1e-3, "um": 1e-3},
    Kind.TIME: {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    Kind.ANGLE: {"deg": 1.0, "°": 1.0},
    Kind.FORCE: {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    Kind.STRESS: {name: 1e-3 * factor for name, factor in PRESSURES.items()} | {"N/mm²": 1.0, "N/mm2": 1.0},
    Kind.STRAIN: {"": 1.0, "-": 1.0, "1": 1.0, "mm/mm": 1.0, "%": 0.01},
    Kind.AREA: {"mm²": 1.0, "mm2": 1.0, "mm^2": 1.0, "cm²": 100.0, "cm2": 100.0},
    Kind.VOLTAGE: {"V": 1.0, "mV": 1e-3},
}

#: What is written for what the library calls otherwise; of forces, where a load in kilograms is a weight.
_ALIASES = {"sec": "s", "secs": "s", "msec": "ms", "volts": "V", "mins": "min", "degrees": "deg", "degs": "deg"}
_ALIASES |= {name.casefold(): name for name in ("mmHg", "inHg", "mmH2O", "cmH2O", "inH2O")}
_ALIASES |= {"in h2o": "inH2O", "inwc": "inH2O", "inwg": "inH2O"}
_WEIGHTS = {"g": "gf", "kg": "kgf", "lb": "lbf", "lbs": "lbf", "oz": "ozf", "kp": "kgf"}
#: Longest unit in a cell of its own; more are words.
LONGEST = 12
_PERCENT = {"percent", "pct", "[%]", "in/in", "m/m"}


def factor_of(unit: str, kind: Kind) -> float | None:
    """What one of a unit is in the unit of a kind; None if it is no such unit.

    Pressures may say what they are measured against, as in ``psig`` or ``kPa (abs)``: the zero is taken at rest.
    """
    text = " ".join(unit.replace("μ", "µ").split())
    usual = USUAL[kind]
    if spelt := spelling(text, usual):
        return usual[spelt]
    text = _ALIASES.get(text.casefold(), text)
    if text in usual:
        return usual[text]
    if kind is Kind.STRAIN:
        return (0.01 if text.casefold() in ("percent", "pct") else 1.0) if text.casefold() in _PERCENT else None
    if kind is Kind.FORCE:
        text = _WEIGHTS.get(text.casefold(), text)
    if kind is Kind.PRESSURE and (bare := re.fullmatch(r"(.*\w)[\s_]*\(?(?:gauge|gage|abs|rel|[gar])\)?", text)):
        found = factor_of(bare[1], kind)
        if found is not None:
            return found
    # A usual unit of something else need not be looked up.
    return None if any(spelling(text, other) for other in USUAL.values()) else _looked_up(text, kind)


@cache
def _looked_up(text: str, kind: Kind) -> float | None:
    if text.startswith("mPa"):  # a thousandth of a pascal nobody measures here: it is a slip for MPa
        return None
    for unit in (parsed(text), parsed(text.casefold())):
        # Dimensions come second: nothing else loads the library for words that are no units.
        if unit is not None and unit.dimensionality == (due := registry().parse_units(_target(kind))).dimensionality:
            return float(registry().Quantity(1.0, unit).m_as(due))
    return None


def _target(kind: Kind) -> str:
    return "mm**2" if kind is Kind.AREA else kind.value


def is_unit(text: str) -> bool:
    """Whether a cell, with or without brackets, holds nothing but a unit."""
    bare = without_brackets(text)
    return 0 < len(bare) <= LONGEST and any(factor_of(bare, kind) is not None for kind in Kind)


def is_usual(text: str) -> bool:
    """Whether it is a usual unit, which needs no looking up."""
    bare = without_brackets(text)
    bare = _ALIASES.get(bare.casefold(), bare)
    return bool(bare) and any(spelling(bare, usual) for usual in USUAL.values())


def without_brackets(text: str) -> str:
    """A unit that may stand in brackets."""
    return text.strip().strip("[]()").strip()
