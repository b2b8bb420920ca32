"""Cells of recorded tests: numbers, words that stand for a lost one, and times of day."""

from __future__ import annotations

import math
import re

#: What programs and instruments write where there is no number.
_NONE = {"", "nan", "inf", "-inf", "+inf", "infinity", "-infinity", "null", "none", "n/a", "na", "#n/a", "#na", "nil"}
_NONE |= {"-", "--", "---", "?", "*", "ol", "-ol", "+ol", "ovl", "ovld", "ovfl", "ovrflw", "over", "+over", "-over"}
_NONE |= {"overflow", "overload", "overrange", "over range", "out of range", "underflow", "underrange", "unfl"}
_NONE |= {"invalid", "missing", "lost", "no data", "error", "err", "timeout", "time out", "#num!", "#value!", "#div/0!"}
_NONE |= {"#ref!", "1.#inf", "-1.#inf", "1.#qnan", "-1.#ind", "1.#ind", "nan(ind)", "-nan", "-nan(ind)"}
#: IEEE 488.2 has 9.91E37 for no number and 9.9E37 for an overload; no sensor shows as much.
LARGEST = 9.8e37

_CLOCK = re.compile(r"(?<!\d)(\d{1,3}):(\d{2})(?::(\d{2}))?(?:[.,](\d+))?(?!:?\d)\s*([AaPp]\.?[Mm])?")


def number_of(text: str, *, decimal_comma: bool) -> float | None:
    """A cell as a number; NaN if it stands for a lost one; None if it is neither."""
    try:
        value = float(text.replace(",", ".") if decimal_comma else text)
    except ValueError:
        bare = text.strip().strip("*").casefold() if len(text) < 40 else text
        if bare in _NONE:
            return math.nan
        return number_of(text.replace("−", "-"), decimal_comma=decimal_comma) if "−" in text else None
    return value if abs(value) < LARGEST else math.nan


def is_value(text: str) -> bool:
    """Whether a cell may stand in a row of numbers."""
    return number_of(text.strip().strip('"'), decimal_comma=True) is not None or clock(text) is not None


def clock(text: str) -> float | None:
    """Seconds since midnight, or since the hour in ``mm:ss.0``, of a time stamp in any usual spelling; None if none.

    The date, if there is one, is not looked at: who reads the rows counts the midnights.
    """
    found = _CLOCK.search(text)
    if not found:
        return None
    first, second, third, fraction, half = found.groups()
    if third is None and half is None:
        return 60.0 * int(first) + int(second) + float(f"0.{fraction or 0}")
    hours = int(first) if half is None else int(first) % 12 + (12 if half[0] in "Pp" else 0)
    return 3600.0 * hours + 60.0 * int(second) + int(third or 0) + float(f"0.{fraction or 0}")
