"""The case file: one YAML file that holds the settings of every stage."""

from __future__ import annotations

import difflib
import json
import math
import os
import re
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

import stages.export
import stages.mirror
import stages.optimize
import stages.refine
import stages.rig
import stages.simulate
from actuator.solver_name import SolverName
from pipeline.case import text as case_text
from pipeline.case.shipped import shipped_case, shipped_names
from pipeline.exit_codes import ExitCode, Fault
from stages.section import Kinds, Section

#: Names become file names: no folders, nothing hidden, no ending that another artifact of a case uses.
NAME_PATTERN = r"^[A-Za-z0-9][A-Za-z0-9._-]*$"
RESERVED_ENDINGS = (".refined", ".solid", ".simulation", ".compare", ".checkpoint", ".stl", ".3mf")

#: Names that Windows gives to devices, whatever their ending.
DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{number}" for port in ("com", "lpt") for number in range(10))}

#: Most mistakes of a file that are spelt out.
MOST_MISTAKES = 20

#: The schema's name and that of its language.
SCHEMA_ID = "urn:poro:case"
SCHEMA_LANGUAGE = "https://json-schema.org/draft/2020-12/schema"


class ComputeSettings(Section):
    """How to compute; recorded, but no reason to compute again."""

    threads: int = Field(0, ge=0, le=1024, description="threads; 0 for one per available core [-]")
    linear_solver: SolverName = Field("auto", description="direct solver of the linear systems")

    def build(self) -> stages.optimize.Compute:
        """The optimiser's counterpart, with the number of threads decided."""
        return stages.optimize.Compute(threads=self.threads or available_cores(), linear_solver=self.linear_solver)


class Case(stages.optimize.Settings):
    """A complete case: the optimisation's settings, those of the later stages, and how to compute."""

    name: str = Field("case", max_length=100, pattern=NAME_PATTERN, description="stem of all file names")
    refine: stages.refine.Settings = stages.refine.Settings()
    mirror: stages.mirror.Settings = stages.mirror.Settings()
    export: stages.export.Settings = stages.export.Settings()
    rig: stages.rig.Settings = stages.rig.Settings()
    simulate: stages.simulate.Settings = stages.simulate.Settings()
    compute: ComputeSettings = ComputeSettings()

    @cached_property
    def optimize(self) -> stages.optimize.Settings:
        """The part of the case that the optimisation sees."""
        return stages.optimize.Settings(**{key: getattr(self, key) for key in stages.optimize.Settings.model_fields})


def available_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def find_case(argument: Path) -> Path:
    """The case file meant by an argument: that path, else the shipped case of that name.

    Raises:
        Fault: if there is none (USAGE).
    """
    try:
        if argument.is_file():
            return argument
        if argument.is_dir():
            raise Fault(ExitCode.USAGE, f"{argument}: this is a folder; name a case file in it.")
    except OSError as error:
        sentence = f"{case_text.shown(argument)}: cannot be read ({error.strerror}); give the path of a case file."
        raise Fault(ExitCode.USAGE, sentence) from None
    shipped = shipped_case(argument.name)
    if shipped and argument.parent == Path():
        return shipped
    known = ", ".join(shipped_names())
    raise Fault(
        ExitCode.USAGE,
        f"{argument}: there is no such file in {_where(argument)}; give the path of a case file or one of the "
        f"shipped cases ({known}).",
    )


def read_case(path: Path) -> tuple[Case, str]:
    """Read and check a case file; returns the case and the text as the user wrote it.

    Raises:
        Fault: one sentence for every mistake (USAGE).
    """
    text = read_bytes(path)
    return parse_case(text, str(path), path.stem), text.decode("utf-8-sig")


def read_bytes(path: Path) -> bytes:
    """What a YAML file holds, no more of it than shows that it is too large.

    Raises:
        Fault: if it cannot be read (USAGE).
    """
    try:
        with path.open("rb") as file:
            return file.read(case_text.MOST_BYTES + 1)
    except OSError as error:
        raise Fault(ExitCode.USAGE, f"{path}: cannot be read ({error.strerror}); check the file.") from None


def parse_case(text: bytes, origin: str, stem: str) -> Case:
    """Check the text of a case file.

    Args:
        text: YAML, UTF-8.
        origin: name of the file for messages.
        stem: name of the case unless the text has one.

    Raises:
        Fault: one sentence for every mistake (USAGE).
    """
    document = case_text.parse(text, origin)
    if not isinstance(document.data, dict):
        kind = _kind(document.data)
        raise Fault(
            ExitCode.USAGE, f"{origin}:1: a case is made of 'section:' lines, not of {kind}; see `poro schema`."
        )
    data = {"name": stem} | document.data
    if wrong := mistakes(data):
        found = sorted((document.line(path), sentence) for path, sentence in wrong)
        sentences = [f"{origin}:{line}: {sentence}." for line, sentence in found[:MOST_MISTAKES]]
        if more := found[MOST_MISTAKES:]:
            sentences.append(f"{origin}:{more[0][0]}: {len(more)} more mistakes follow; mend the others first.")
        raise Fault(ExitCode.USAGE, "\n".join(sentences))
    return Case.model_validate(data, strict=True)


def mistakes(data: dict[str, Any]) -> list[tuple[case_text.Path, str]]:
    """What is wrong with the values of a case: path of the key, and a sentence without file, line and full stop."""
    try:
        case = Case.model_validate(data, strict=True)
    except ValidationError as error:
        return [(_section(detail["loc"])[1], _sentence(detail)) for detail in error.errors()]
    if case.name.partition(".")[0].lower() in DEVICES:
        return [(("name",), f"name: '{case.name}' is a device on Windows, not a file; choose another name")]
    reserved = next((ending for ending in RESERVED_ENDINGS if case.name.endswith(ending)), None)
    return [(("name",), f"name: must not end in {reserved}; choose another name")] if reserved else []


def changed(case: Case, option: str, section: str, key: str, value: Any) -> Case:
    """The case with one value from the command line.

    Raises:
        Fault: if the value is out of range (USAGE).
    """
    data = getattr(case, section).model_dump() | {key: value}
    try:
        return case.model_copy(update={section: type(getattr(case, section)).model_validate(data)})
    except ValidationError as error:
        wrong = _sentence(error.errors()[0]).partition(": ")[2]
        raise Fault(ExitCode.USAGE, f"{option}: {wrong}.") from None


def stored_case(resolved: dict[str, Any], origin: Path) -> Case:
    """The case inside an artifact.

    Raises:
        Fault: if this version of the program does not understand it (ARTIFACT).
    """
    try:
        return Case.model_validate(resolved)
    except ValidationError as error:
        raise Fault(
            ExitCode.ARTIFACT,
            f"{origin}: the case stored inside is not understood ({_sentence(error.errors()[0])}); "
            "make the artifact again from its case file.",
        ) from None


def case_schema() -> str:
    """JSON Schema of the case file, for editors and other programs."""
    found = Case.model_json_schema()
    for section, field in found["properties"].items():
        for each in (field, *field.get("oneOf", ())):
            if reference := each.get("$ref"):
                # The model's own title is the name of a Python class.
                found["$defs"][reference.rpartition("/")[2]]["title"] = f"Section {section}"
    endings = "|".join(map(re.escape, RESERVED_ENDINGS))
    found["properties"]["name"]["not"] = {"pattern": f"({endings})$"}
    named = {"$schema": SCHEMA_LANGUAGE, "$id": SCHEMA_ID} | found | {"title": "Case file of poro"}
    return json.dumps(named, indent=2, ensure_ascii=False)


# ------------------------------------------------------------------------------------------------ messages


def _where(argument: Path) -> str:
    return str(argument.parent) if argument.parent != Path() else f"the working folder {Path.cwd()}"


def _sentence(detail: ErrorDetails) -> str:
    """What is wrong and the remedy, without file, line and full stop."""
    path, kind, value = detail["loc"], detail["type"], detail["input"]
    context = detail.get("ctx", {})
    key = case_text.dotted(_section(path)[1])
    if kind == "list_type":
        return f"{key}: must be a list such as [1.0, 2.0], not {_kind(value)}; put brackets around it"
    if kind == "missing":
        return f"{key}: is missing; write it, see `poro schema`"
    if kind == "value_error":
        return f"{key}: {context['error']}"
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        name, found = context["discriminator"].strip("'"), context.get("tag")
        known = context.get("expected_tags") or ", ".join(f"'{each}'" for each in _kinds(path))
        wrong = f"'{case_text.shown(found)}' is unknown" if found else "is missing"
        return f"{key}.{name}: {wrong}; write one of {known}"
    if kind == "extra_forbidden":
        return f"{key}: {_unknown_key(path)}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        names = ", ".join(_keys(path)[:3])
        return f"{key}: must be a section of keys ({names}, …), not {_kind(value)}; indent its keys below it"
    if kind in ("float_type", "int_type", "float_parsing", "int_parsing", "int_from_float"):
        due = "number" if kind.startswith("float") else "whole number"
        return f"{key}: must be a {due}, not {_kind(value)}; {_number_remedy(value, due)}"
    if kind == "string_type":
        return f"{key}: must be a word, not {_kind(value)}; put it in quotes"
    if kind == "string_pattern_mismatch":
        return f"{key}: '{case_text.shown(value)}' may only have letters, digits and . _ -; write another name"
    if kind == "literal_error":
        return f"{key}: must be {context['expected']}, not {_kind(value)}; write one of these"
    limits = {"greater_than": "gt", "greater_than_equal": "ge", "less_than": "lt", "less_than_equal": "le"}
    if kind in limits:
        words = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}[limits[kind]]
        limit = context[limits[kind]]
        return f"{key}: must be {words} {limit:g}, not {case_text.shown(value)}; change the value"
    if kind == "value_error":
        return f"{key}: {context['error']}, not {case_text.shown(value)}; change the value"
    return f"{key}: {detail['msg'][0].lower()}{detail['msg'][1:]}; see `poro schema`"


def _unknown_key(path: case_text.Path) -> str:
    known = _keys(path[:-1])
    close = difflib.get_close_matches(str(path[-1]), known, n=1, cutoff=0.6)
    if close:
        return f"unknown key; write '{close[0]}' if that was meant, else remove it"
    elsewhere = [section for section in Case.model_fields if path[-1] in _keys((section,))]
    if elsewhere:
        return f"unknown key here; it belongs below '{elsewhere[0]}:'"
    return f"unknown key; remove it or use one of {', '.join(known)}"


def _section(path: case_text.Path) -> tuple[type[BaseModel] | None, case_text.Path]:
    """The section at a path of pydantic's, if there is one, and the path as the user wrote it.

    Where a section comes in several kinds, pydantic's path also has the name of the kind.
    """
    model: Any = Case
    written: list[str | int] = []
    parts = iter(path)
    for part in parts:
        written.append(part)
        field = model.model_fields.get(part) if _is_section(model) else None
        model = field.annotation if field else None
        if field and (kinds := _kinds_of(field)):
            model = kinds.get(next(parts, None))
    return model if _is_section(model) else None, tuple(written)


def _is_section(model: Any) -> bool:
    return isinstance(model, type) and issubclass(model, BaseModel)


def _kinds_of(field: FieldInfo) -> Mapping[Any, type[BaseModel]]:
    """The kinds by name of a section that comes in several; none if it does not."""
    return next((mark.known for mark in field.metadata if isinstance(mark, Kinds)), {})


def _kinds(path: case_text.Path) -> Mapping[Any, type[BaseModel]]:
    parent, _ = _section(path[:-1])
    field = parent.model_fields.get(str(path[-1])) if parent else None
    return _kinds_of(field) if field else {}


def _keys(path: case_text.Path) -> list[str]:
    """The keys a section may have."""
    model, _ = _section(path)
    if model is None:
        return list(dict.fromkeys(key for kind in _kinds(path).values() for key in kind.model_fields)) if path else []
    return list(model.model_fields)


def _kind(value: Any) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"the text '{case_text.shown(value)}'"
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "a section"
    return case_text.shown(value)


def _number_remedy(value: Any, due: str) -> str:
    if isinstance(value, float) and value.is_integer():
        return f"write {value:.0f}"
    if not isinstance(value, str):
        return f"write a {due}"
    try:
        number = float(value)
    except ValueError:
        return f"write a {due} without units or quotes"
    if not math.isfinite(number):
        return f"write a finite {due}"
    whole = due == "whole number" and number.is_integer() and abs(number) < 1e15
    return f"write {number:.0f}" if whole else f"write {number_text(value)}"


def number_text(text: str) -> str:
    """A number as every YAML reader takes it: with a point, and with a sign in the exponent; ``1e-6`` to ``1.0e-6``."""
    mantissa, _, exponent = text.lower().replace("_", "").strip().partition("e")
    mantissa = mantissa if "." in mantissa else f"{mantissa}.0"
    return f"{mantissa}e{int(exponent):+d}" if exponent else mantissa
