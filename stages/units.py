"""Quantities with units, as people write them, in the unit that a key or an option counts in."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pint

#: kPa of each. psi: pound-force per square inch, exactly 0.45359237 kg · 9.80665 m/s² over (25.4 mm)².
PRESSURES = {
    "kPa": 1.0,
    "Pa": 1e-3,
    "hPa": 0.1,
    "MPa": 1e3,
    "bar": 100.0,
    "mbar": 0.1,
    "psi": 1e3 * 0.45359237 * 9.80665 / 25.4**2,
}

#: What is due where a number counts in a unit, and how it may be written.
KINDS = {
    "mm": ("a length", "'15 mm', '1.5 cm' or '0.6 in'"),
    "kPa": ("a pressure", "'20 kPa', '0.2 bar' or '3 psi'"),
    "N/mm²": ("a stress or modulus", "'70 kPa', '0.07 MPa' or '10 psi'"),
    "N/mm": ("a stiffness", "'0.05 N/mm' or '50 N/m'"),
    "1/s": ("a rate", "'1000 1/s'"),
}
#: Spellings that people use and that mean one thing alone, beside those that differ in upper and lower case.
SPELLINGS = {name.casefold(): name for name in (*PRESSURES, "GPa", "mm", "cm", "in", "inch", "ft", "N/mm", "N/m")}
#: Digits that are kept, two less than a double has: 54.72 kPa over 2.736 N/mm² is 0.02, and 1.5 cm are 15 mm.
DIGITS = 13

_UNIT = re.compile(r"\[([^\]]+)\]")
_NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
_QUANTITY = re.compile(rf"({_NUMBER})\s*((?:[^\W\d_]|1/).*)", re.DOTALL)
# Names of units with small powers, multiplied and divided: nothing that takes pint time to work out.
_NAME = r"[^\W\d_]\w{0,30}(?:\^-?[1-3])?"
_UNITS = re.compile(rf"(?:1/)?{_NAME}(?: ?[·*/ ] ?{_NAME}){{0,3}}")
#: The same for a JSON Schema.
PATTERN = rf"^\s*{_NUMBER}\s*([A-Za-zµμ]|1/).*$"


def spelling(unit: str, units: Mapping[str, float]) -> str:
    """A unit as a table spells it; empty if it has none such."""
    # mPa and MPa, mV and MV are not the same: such units must be written exactly.
    folded = {name.casefold(): name for name in units if name not in ("MPa", "mV")}
    spelt = unit.replace("μ", "µ")
    return spelt if spelt in units else folded.get(spelt.casefold(), "")


def unit_of(description: str | None) -> str:
    """The unit in brackets in the description of a key; empty if it is a number without one."""
    found = _UNIT.search(description or "")
    return found[1] if found and found[1] in KINDS else ""


def rounded(value: float) -> float:
    """A number without the last digits, which conversions leave."""
    return float(f"{value:.{DIGITS}g}")


def counted(value: Any, unit: str) -> Any:
    """A value of a key that counts in a unit: text with a unit as a number, everything else as it is.

    Raises:
        ValueError: if text is neither a number nor such a quantity, as the end of a sentence.
    """
    # Of words, and of numbers written as text, others say what is wrong.
    begins = isinstance(value, str) and bool(re.match(r"\s*[-+]?\.?[0-9]", value))
    return quantity(value, unit) if begins and not _is_number(value) else value


def is_quantity(value: Any) -> bool:
    """Whether a value is a number with something behind it that may be its unit."""
    return isinstance(value, str) and bool(_QUANTITY.fullmatch(value.strip())) and not _is_number(value)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def quantity(text: str, unit: str) -> float:
    """A number with its unit, such as ``20 kPa`` or ``3 psi``, counted in a unit of :data:`KINDS`.

    Raises:
        ValueError: if it is none, or has another dimension, as the end of a sentence.
    """
    kind, examples = KINDS[unit]
    found = _QUANTITY.fullmatch(text.strip())
    if not found:
        raise ValueError(f"must be {kind}, not '{text[:40]}'; write a number with its unit, as in {examples}")
    number, given = float(found[1]), _unit(found[2], kind, examples)
    due = registry().parse_units(unit)
    if given.dimensionality != due.dimensionality:
        what = next((name for other, (name, _) in KINDS.items() if _same(given, other)), "something else")
        raise ValueError(f"must be {kind}, and '{text}' is {what}; write it as in {examples}")
    value = rounded(registry().Quantity(number, given).m_as(due))
    if not math.isfinite(value):
        raise ValueError(f"must be {kind} of finite size, not '{text}'; write it as in {examples}")
    return value


def _unit(text: str, kind: str, examples: str) -> pint.Unit:
    if text in ("mPa", "mpa"):  # of air, nobody means the thousandth of a pascal
        raise ValueError(f"must be {kind}, and {text} is the thousandth of a pascal; write MPa if that was meant")
    found = parsed(SPELLINGS.get(text.casefold(), text))
    if found is None:
        raise ValueError(f"must be {kind}, and '{text[:40]}' is no unit; write it as in {examples}")
    return found


def parsed(text: str) -> pint.Unit | None:
    """A unit of pint's; None if it is none. Powers may be written ``N/mm^2``, ``N/mm2`` or ``N/mm²``."""
    bare = text.replace("²", "2").replace("³", "3")
    spelt = re.sub(r"(?<=[A-Za-z])([23])(?!\w)", r"^\1", bare)
    try:
        return registry().parse_units(spelt) if _UNITS.fullmatch(spelt) else None
    except Exception:  # pint raises errors of Python's own parser too
        return None


def _same(given: pint.Unit, unit: str) -> bool:
    return bool(given.dimensionality == registry().parse_units(unit).dimensionality)


@cache
def registry() -> Any:
    """The units that pint knows."""
    import pint  # half a second: only where a unit is written

    return pint.get_application_registry()
