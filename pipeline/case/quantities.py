"""Quantities that a case may have in place of the ratios of its load, such as ``load.pressure: 10 kPa``.

What is kept is the ratio, so that a case with quantities and the equal one with ratios have the same keys and results.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pipeline.case import text as case_text
from pipeline.case.messages import kind_of
from stages.section import Instead
from stages.settings import LoadCaseSettings, LoadSettings
from stages.units import KINDS, counted, unit_of

#: Path of a key, and a sentence without file, line and full stop.
Mistake = tuple[case_text.Path, str]

_INSTEAD = LoadSettings.instead


def taken_out(data: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float], list[Mistake]]:
    """The data of a case without its quantities, these in the units of their keys, and what is wrong with them.

    Quantities are found by their keys inside ``load``, those of load cases as ``cases.0.pressure``.
    """
    load = data.get("load")
    if not isinstance(load, dict):
        return dict(data), {}, []
    bare, found, wrong = _without(load, _INSTEAD, ("load",))
    if isinstance(cases := load.get("cases"), list):
        bare["cases"] = []
        for number, case in enumerate(cases):
            if not isinstance(case, dict):
                bare["cases"].append(case)
                continue
            rest, own, mistakes = _without(case, LoadCaseSettings.instead, ("load", "cases", number))
            bare["cases"].append(rest)
            found |= {f"cases.{number}.{key}": value for key, value in own.items()}
            wrong += mistakes
    return {**data, "load": bare}, found, wrong


def _without(
    section: Mapping[str, Any], known: Mapping[str, Instead], path: case_text.Path
) -> tuple[dict[str, Any], dict[str, float], list[Mistake]]:
    """The same of one section."""
    found: dict[str, float] = {}
    wrong: list[Mistake] = []
    for key, value in section.items():
        if key not in known:
            continue
        ratio, unit = known[key].ratio, unit_of(known[key].description)
        sentence = (
            f"says the same as {case_text.dotted((*path, ratio))}; remove one of them" if ratio in section else ""
        )
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
            wrong.append(((*path, key), f"{case_text.dotted((*path, key))}: {sentence}"))
    return {key: value for key, value in section.items() if key not in known}, found, wrong


def with_values(load: Mapping[str, Any], values: Mapping[str, float]) -> dict[str, Any]:
    """The section ``load`` with values by their keys, those of load cases as ``cases.0.pressure_ratio``."""
    own = {key: value for key, value in values.items() if "." not in key}
    made = {**load, **own}
    for key, value in values.items():
        if key not in own:
            _, number, name = key.split(".")
            made["cases"] = [
                {**case, name: value} if place == int(number) else case for place, case in enumerate(made["cases"])
            ]
    return made


def ratio_of(key: str) -> str:
    """The key of the ratio that a quantity stands for."""
    place, dot, name = key.rpartition(".")
    return f"{place}{dot}{_INSTEAD[name].ratio}"


def as_written(mistake: Mistake, quantities: Mapping[str, float]) -> Mistake:
    """A mistake of a ratio that was made of a quantity, as one of the quantity."""
    path, sentence = mistake
    for key in quantities:
        if case_text.dotted(path) == f"load.{ratio_of(key)}":
            ratio = _INSTEAD[key.rpartition(".")[2]].ratio
            said = f"load.{key}: as {ratio} it {sentence.partition(': ')[2]}"
            return (*path[:-1], key.rpartition(".")[2]), said
    return mistake


def with_quantities(data: Mapping[str, Any], quantities: Mapping[str, float]) -> dict[str, Any]:
    """The data of a case with the quantities that it was given in place of their ratios."""
    if not quantities:
        return dict(data)
    load = with_values(data["load"], quantities)
    gone = {ratio_of(key) for key in quantities}
    load = {key: value for key, value in load.items() if key not in gone}
    if "cases" in load:
        load["cases"] = [
            {key: value for key, value in case.items() if f"cases.{number}.{key}" not in gone}
            for number, case in enumerate(load["cases"])
        ]
    return {**data, "load": load}


def without_other(data: Mapping[str, Any], key: str) -> dict[str, Any]:
    """The data of a case that is about to get the value of a dotted key, without what says the same."""
    section, _, name = key.partition(".")
    load = data.get("load")
    if section != "load" or not isinstance(load, Mapping):
        return dict(data)
    same = {_INSTEAD[name].ratio} if name in _INSTEAD else {k for k, each in _INSTEAD.items() if each.ratio == name}
    return {**data, "load": {key: value for key, value in load.items() if key not in same}}
