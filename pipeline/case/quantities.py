"""Quantities that a case may have in place of the ratios of its load, such as ``load.pressure: 10 kPa``.

What is kept is the ratio, so that a case with quantities and the equal one with ratios have the same keys and results.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pipeline.case import text as case_text
from pipeline.case.messages import kind_of
from stages.settings import LoadSettings
from stages.units import KINDS, counted, unit_of

#: Path of a key, and a sentence without file, line and full stop.
Mistake = tuple[case_text.Path, str]

_INSTEAD = LoadSettings.instead


def taken_out(data: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float], list[Mistake]]:
    """The data of a case without its quantities, these in the units of their keys, and what is wrong with them."""
    load = data.get("load")
    if not isinstance(load, dict) or not _INSTEAD.keys() & load.keys():
        return dict(data), {}, []
    found: dict[str, float] = {}
    wrong: list[Mistake] = []
    for key, value in load.items():
        if key not in _INSTEAD:
            continue
        ratio, unit = _INSTEAD[key].ratio, unit_of(_INSTEAD[key].description)
        sentence = f"says the same as load.{ratio}; remove one of them" if ratio in load else ""
        try:
            number = counted(value, unit)
        except ValueError as error:
            sentence = sentence or str(error)
        else:
            if isinstance(number, bool) or not isinstance(number, int | float) or not math.isfinite(number):
                kind, examples = KINDS[unit]
                sentence = sentence or f"must be {kind}, not {kind_of(value)}; write it as in {examples}"
            elif number == 0.0 and key == "arm_length":
                sentence = sentence or "must be greater than 0; change the value"
            else:
                found[key] = float(number)
        if sentence:
            wrong.append((("load", key), f"load.{key}: {sentence}"))
    return {**data, "load": {key: value for key, value in load.items() if key not in _INSTEAD}}, found, wrong


def as_written(mistake: Mistake, quantities: Mapping[str, float]) -> Mistake:
    """A mistake of a ratio that was made of a quantity, as one of the quantity."""
    path, sentence = mistake
    for key in quantities:
        if path == ("load", ratio := _INSTEAD[key].ratio):
            return ("load", key), f"load.{key}: as {ratio} it {sentence.partition(': ')[2]}"
    return mistake


def with_quantities(data: Mapping[str, Any], quantities: Mapping[str, float]) -> dict[str, Any]:
    """The data of a case with the quantities that it was given in place of their ratios."""
    if not quantities:
        return dict(data)
    gone = {_INSTEAD[key].ratio for key in quantities}
    load = {key: value for key, value in data["load"].items() if key not in gone}
    return {**data, "load": load | dict(quantities)}


def without_other(data: Mapping[str, Any], key: str) -> dict[str, Any]:
    """The data of a case that is about to get the value of a dotted key, without what says the same."""
    section, _, name = key.partition(".")
    load = data.get("load")
    if section != "load" or not isinstance(load, Mapping):
        return dict(data)
    same = {_INSTEAD[name].ratio} if name in _INSTEAD else {k for k, each in _INSTEAD.items() if each.ratio == name}
    return {**data, "load": {key: value for key, value in load.items() if key not in same}}
