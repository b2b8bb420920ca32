"""Units that quantities of the rig may be given in."""

from __future__ import annotations

import re
from collections.abc import Mapping

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


def spelling(unit: str, units: Mapping[str, float]) -> str:
    """A unit as a table spells it; empty if it has none such."""
    # mPa and MPa, mV and MV are not the same: such units must be written exactly.
    folded = {name.casefold(): name for name in units if name not in ("MPa", "mV")}
    spelt = unit.replace("μ", "µ")
    return spelt if spelt in units else folded.get(spelt.casefold(), "")


def in_kpa(text: str) -> float:
    """A pressure with its unit, such as ``20 kPa``, in kPa.

    Raises:
        ValueError: if it is none, as the end of a sentence.
    """
    found = re.fullmatch(r"\s*(.*?)\s*([A-Za-z]*)\s*", text, re.DOTALL)
    number, unit = found.groups() if found else ("", "")
    try:
        return float(number) * PRESSURES[spelling(unit, PRESSURES)]
    except (KeyError, ValueError):
        raise ValueError(f"must be a number with one of the units {', '.join(PRESSURES)}, as in '20 kPa'") from None
