"""The study file: a case, and the keys of it that are varied; every combination becomes a case of its own."""

from __future__ import annotations

import difflib
import hashlib
import itertools
import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.case import text as case_text
from pipeline.case.changes import with_values
from pipeline.case.model import Case, examined, mistakes, read_bytes, read_case
from pipeline.case.shipped import shipped_case, shipped_names
from pipeline.case.writer import value_text
from pipeline.exit_codes import ExitCode, Fault, shown
from stages.chain import PART, STAGES

#: Most cases of one study.
MOST_CASES = 10_000
KEYS = ("case", "vary", "combine", "until")
RANGE_KEYS = ("from", "to", "steps", "scale")
#: Keys that a study may not vary, and why.
FIXED = {"name": "every case gets its own name", "compute.threads": "it is the same for all cases, see --threads"}


@dataclass(frozen=True)
class Variant:
    """One case of a study.

    Attributes:
        values: dotted key -> its value.
        case: the complete case, named after these values.
    """

    values: Mapping[str, Any]
    case: Case


@dataclass(frozen=True)
class Study:
    """A study file that has been checked.

    Attributes:
        path: of the file.
        base: the case file that is varied.
        keys: the varied keys, dotted, in the order of the file.
        logarithmic: those whose range is logarithmic.
        grid: whether every value is combined with every other; else the first with the first and so on.
        until: last stage wanted.
        variants: the cases, the last key varying fastest.
    """

    path: Path
    base: Path
    keys: tuple[str, ...]
    logarithmic: frozenset[str]
    grid: bool
    until: str
    variants: tuple[Variant, ...]

    @property
    def name(self) -> str:
        """Stem of the results' names."""
        return self.path.stem


def read_study(path: Path) -> Study:
    """Read and check a study file, and all cases it makes.

    Raises:
        Fault: one sentence for every mistake, with file, line and key (USAGE).
    """
    if path.is_dir():
        raise Fault(ExitCode.USAGE, f"{path}: this is a folder; name a study file in it.")
    return _Checker(path, case_text.parse(read_bytes(path), str(path))).study()


@dataclass
class _Checker:
    """Collects all mistakes of a study file before it complains."""

    path: Path
    document: case_text.Document
    problems: list[tuple[int, str]] = field(default_factory=list)

    def study(self) -> Study:
        data = self.document.data
        if not isinstance(data, dict):
            sentence = "a study is made of the lines 'case:' and 'vary:'; see docs/use/sweeps.md"
            raise Fault(ExitCode.USAGE, f"{self.path}:1: {sentence}.")
        for key in data:
            if key not in KEYS:
                close = difflib.get_close_matches(str(key), KEYS, n=1)
                remedy = f"write '{close[0]}' if that was meant" if close else f"use {', '.join(KEYS)}"
                self.wrong((key,), f"unknown key; {remedy}")
        combine = self.word(data, "combine", ("grid", "zip"))
        until = self.word(data, "until", (PART, *(name for name in STAGES if name != PART)))
        base, case = self.base(data)
        values, logarithmic = self.varied(data, case)
        chosen = tuple(self.combinations(values, combine == "grid")) if not self.problems else ()
        variants = tuple(self.variants(case, base, chosen)) if case and not self.problems else ()
        if self.problems:
            sentences = [text if line == 0 else f"{self.path}:{line}: {text}." for line, text in sorted(self.problems)]
            raise Fault(ExitCode.USAGE, "\n".join(sentences))
        return Study(self.path, base, tuple(values), frozenset(logarithmic), combine == "grid", until, variants)

    def wrong(self, path: case_text.Path, sentence: str) -> None:
        self.problems.append((self.document.line(path), f"{case_text.dotted(path)}: {sentence}"))

    def word(self, data: dict[str, Any], key: str, known: tuple[str, ...]) -> str:
        """A word of the file; the first of the known ones if there is none."""
        found = data.get(key, known[0])
        if found not in known:
            self.wrong((key,), f"must be {' or '.join(known)}, not '{shown(found)}'; write one of these")
            return known[0]
        return str(found)

    def base(self, data: dict[str, Any]) -> tuple[Path, Case | None]:
        name = data.get("case")
        if not isinstance(name, str):
            self.wrong(("case",), "must be the path of a case file or a shipped case; write one, such as quick.yaml")
            return self.path, None
        beside = self.path.parent / name
        found = beside if beside.is_file() else shipped_case(name) if Path(name).name == name else None
        if not found:
            known = ", ".join(shipped_names())
            self.wrong(("case",), f"there is no file {beside}; give its path from the study file, or one of {known}")
            return self.path, None
        try:
            return found, read_case(found)[0]
        except Fault as fault:  # has file and line of its own
            self.problems.append((0, str(fault)))
            return found, None

    def varied(self, data: dict[str, Any], case: Case | None) -> tuple[dict[str, list[Any]], set[str]]:
        vary = data.get("vary")
        if not isinstance(vary, dict) or not vary:
            self.wrong(
                ("vary",),
                "must be a section of keys with their values; write at least one, such as mirror.threshold: [0.0, 0.1]",
            )
            return {}, set()
        values: dict[str, list[Any]] = {}
        logarithmic = set()
        for key, wanted in vary.items():
            if key in FIXED:
                self.wrong(("vary", key), f"cannot be varied, as {FIXED[key]}; remove it")
                continue
            found = self.range(key, wanted) if isinstance(wanted, dict) else self.listed(key, wanted)
            if isinstance(wanted, dict) and wanted.get("scale") == "log":
                logarithmic.add(key)
            values[key] = found
            if case:
                self.fitting(case, key, found, listed=isinstance(wanted, list))
        return values, logarithmic

    def listed(self, key: str, wanted: Any) -> list[Any]:
        if not isinstance(wanted, list) or not wanted:
            self.wrong(
                ("vary", key), "must be a list of values [a, b, …] or a range {from: a, to: b, steps: n}; write one"
            )
            return []
        for i, value in enumerate(wanted):
            if isinstance(value, list | dict):
                self.wrong(("vary", key, i), "must be a single value; remove the brackets")
            elif any(_in_a_name(value) == _in_a_name(other) and type(value) is type(other) for other in wanted[:i]):
                self.wrong(("vary", key, i), f"{shown(value)} is there twice; remove one of them")
        return wanted

    def range(self, key: str, wanted: dict[str, Any]) -> list[Any]:
        before = len(self.problems)
        for name in wanted:
            if name not in RANGE_KEYS:
                self.wrong(("vary", key, name), f"unknown key of a range; use {', '.join(RANGE_KEYS)}")
        ends: list[Any] = [wanted.get(name) for name in ("from", "to")]
        for name, end in zip(("from", "to"), ends, strict=True):
            if isinstance(end, bool) or not isinstance(end, int | float):
                self.wrong(("vary", key, name), "must be a number; write one such as 0.1 or 1.0e-3")
        steps: Any = wanted.get("steps")
        scale = wanted.get("scale", "linear")
        if isinstance(steps, bool) or not isinstance(steps, int) or not 2 <= steps <= MOST_CASES:
            self.wrong(("vary", key, "steps"), f"must be a whole number from 2 to {MOST_CASES}; write one")
        if scale not in ("linear", "log"):
            self.wrong(("vary", key, "scale"), "must be linear or log; write one of these")
        if len(self.problems) > before:
            return []
        low, high = ends
        if low == high:
            self.wrong(("vary", key), "from and to are the same; write two different numbers")
        if scale == "log" and not (low > 0 and high > 0):
            self.wrong(("vary", key), "a range with scale log needs from and to above 0; change them")
        return [] if len(self.problems) > before else spaced(low, high, steps, scale == "log")

    def fitting(self, case: Case, key: str, values: list[Any], *, listed: bool) -> None:
        """Try every value alone in the case."""
        for i, value in enumerate(values):
            place = ("vary", key, i) if listed else ("vary", key)
            found = mistakes(with_values(case, {key: value}))
            for _, sentence in found[:1]:
                self.problems.append((self.document.line(place), f"vary.{sentence}"))
            if found and (not listed or "unknown key" in found[0][1]):
                return

    def combinations(self, values: dict[str, list[Any]], grid: bool) -> Iterator[dict[str, Any]]:
        count = math.prod(map(len, values.values())) if grid else max(map(len, values.values()))
        if not grid and len({len(found) for found in values.values()}) > 1:
            lengths = ", ".join(f"{key} has {len(found)}" for key, found in values.items())
            self.wrong(("vary",), f"with combine: zip all keys need as many values ({lengths}); change them")
        elif count > MOST_CASES:
            self.wrong(("vary",), f"makes {count} cases, more than {MOST_CASES}; give fewer values")
        else:
            together = itertools.product(*values.values()) if grid else zip(*values.values(), strict=True)
            for chosen in together:
                yield dict(zip(values, chosen, strict=True))

    def variants(self, case: Case, base: Path, chosen: tuple[dict[str, Any], ...]) -> Iterator[Variant]:
        names = variant_names(base.stem, chosen)
        for name, values in zip(names, chosen, strict=True):
            made, wrong = examined(with_values(case, {"name": name, **values}))
            for _, sentence in wrong[:1]:
                self.problems.append((self.document.line(("vary",)), f"vary: {name}: {sentence}"))
            if made and not self.problems:
                yield Variant(values, made)


def spaced(low: float, high: float, steps: int, logarithmic: bool) -> list[Any]:
    """Evenly spaced numbers from one end to the other, whole ones where all are whole."""
    if logarithmic:
        found = [low * (high / low) ** (i / (steps - 1)) for i in range(steps)]
    else:
        found = [low + (high - low) * i / (steps - 1) for i in range(steps)]
    if isinstance(low, int) and isinstance(high, int) and all(float(value).is_integer() for value in found):
        return [round(value) for value in found]
    # Six digits between the ends, so that names and files stay readable.
    return [float(low), *(float(f"{value:.6g}") for value in found[1:-1]), float(high)]


def _in_a_name(value: Any) -> str:
    """A value in a file name, ``10kPa`` and ``0.05N-mm``."""
    return re.sub(r"[^A-Za-z0-9._-]", "", value_text(value).replace("/", "-"))


def variant_names(stem: str, chosen: tuple[dict[str, Any], ...]) -> list[str]:
    """Readable names, ``quick.pressure_ratio-0.02``; where they are too long, a hash of the values instead."""
    keys = list(chosen[0]) if chosen else []
    last = [key.rpartition(".")[2] for key in keys]
    short = {key: name if last.count(name) == 1 else key for key, name in zip(keys, last, strict=True)}
    names = [
        ".".join([stem, *(f"{short[key]}-{_in_a_name(value)}" for key, value in values.items())]) for values in chosen
    ]
    if max(map(len, names), default=0) <= 100:
        return names
    return [f"{stem}.{hashlib.sha256(json.dumps(values).encode()).hexdigest()[:12]}" for values in chosen]
