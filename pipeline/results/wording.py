"""How numbers are written where people read them; a case file's are written by :mod:`pipeline.case.writer`."""

from __future__ import annotations

from typing import Any


def formatted(value: Any, digits: int = 6, none: str = "none") -> str:
    """A value of a summary, a setting or a table.

    Args:
        value: a number, a word, yes or no, or None.
        digits: of a number that is not whole.
        none: stands for None.
    """
    if value is None:
        return none
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def duration(seconds: float) -> str:
    """A time in seconds, or as ``h:mm:ss`` from a minute upwards."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"


def byte_size(size: float) -> str:
    """A size in bytes, in the unit in which it has one to three digits before the point."""
    for unit in ("bytes", "kB", "MB"):
        if size < 999.5:
            return f"{size:.0f} {unit}" if unit == "bytes" else f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.4g} GB"


def count(number: int, what: str) -> str:
    """A number of things, in the singular or the plural."""
    return f"{number} {what}{'' if number == 1 else 's'}"
