"""What is wrong with a value of a case file, and the remedy, in a sentence without file, line and full stop."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from pipeline.case import text as case_text
from pipeline.exit_codes import shown
from stages.section import Kinds


@dataclass(frozen=True)
class Messages:
    """Sentences about the values of a model.

    Attributes:
        model: the type of cases; its sections are models too.
    """

    model: type[BaseModel]

    def sentence(self, detail: ErrorDetails) -> str:
        """What is wrong and the remedy, without file, line and full stop."""
        path, kind, value = detail["loc"], detail["type"], detail["input"]
        context = detail.get("ctx", {})
        key = case_text.dotted(self.section(path)[1])
        if kind == "list_type":
            if len(path) == 1:
                return f"{key}: must be a list, not {kind_of(value)}; begin each of its entries by a dash"
            return f"{key}: must be a list such as [1.0, 2.0], not {kind_of(value)}; put brackets around it"
        if kind == "missing":
            return f"{key}: is missing; write it, see `poro schema`"
        if kind == "value_error":
            return f"{key}: {context['error']}"
        if kind in ("union_tag_invalid", "union_tag_not_found"):
            name, found = context["discriminator"].strip("'"), context.get("tag")
            known = context.get("expected_tags") or ", ".join(f"'{each}'" for each in self._kinds(path))
            wrong = f"'{shown(found)}' is unknown" if found else "is missing"
            return f"{key}.{name}: {wrong}; write one of {known}"
        if kind in ("too_short", "too_long"):
            least, most = (context.get(f"{end}_length") for end in ("min", "max"))
            due = f"{'at least' if least else 'at most'} {least or most}"
            return f"{key}: must have {due} entries, not {context['actual_length']}; change the list"
        if kind == "extra_forbidden":
            return f"{key}: {self._unknown_key(path)}"
        if kind in ("model_type", "model_attributes_type", "dict_type"):
            names = ", ".join(self._keys(path)[:3])
            return f"{key}: must be a section of keys ({names}, …), not {kind_of(value)}; indent its keys below it"
        if kind in ("float_type", "int_type", "float_parsing", "int_parsing", "int_from_float"):
            due = "number" if kind.startswith("float") else "whole number"
            return f"{key}: must be a {due}, not {kind_of(value)}; {_number_remedy(value, due)}"
        if kind == "string_type":
            return f"{key}: must be a word, not {kind_of(value)}; put it in quotes"
        if kind == "string_pattern_mismatch":
            return f"{key}: '{shown(value)}' may only have letters, digits and . _ -; write another name"
        if kind == "literal_error":
            return f"{key}: must be {context['expected']}, not {kind_of(value)}; write one of these"
        limits = {"greater_than": "gt", "greater_than_equal": "ge", "less_than": "lt", "less_than_equal": "le"}
        if kind in limits:
            words = {"gt": "greater than", "ge": "at least", "lt": "less than", "le": "at most"}[limits[kind]]
            limit = context[limits[kind]]
            return f"{key}: must be {words} {limit:g}, not {shown(value)}; change the value"
        return f"{key}: {detail['msg'][0].lower()}{detail['msg'][1:]}; see `poro schema`"

    def _unknown_key(self, path: case_text.Path) -> str:
        known = self._keys(path[:-1])
        section, _ = self.section(path[:-1])
        if section and (remedy := getattr(section, "gone", {}).get(path[-1])):
            return f"unknown key; {remedy}"
        close = difflib.get_close_matches(str(path[-1]), known, n=1, cutoff=0.6)
        if close:
            return f"unknown key; write '{close[0]}' if that was meant, else remove it"
        elsewhere = [section for section in self.model.model_fields if path[-1] in self._keys((section,))]
        if elsewhere:
            return f"unknown key here; it belongs below '{elsewhere[0]}:'"
        return f"unknown key; remove it or use one of {', '.join(known)}"

    def section(self, path: case_text.Path) -> tuple[type[BaseModel] | None, case_text.Path]:
        """The section at a path of pydantic's, if there is one, and the path as the user wrote it.

        Where a section comes in several kinds, pydantic's path also has the name of the kind.
        """
        model: Any = self.model
        written: list[str | int] = []
        parts = iter(path)
        for part in parts:
            written.append(part)
            field = model.model_fields.get(part) if _is_section(model) else None
            model = field.annotation if field else None
            if field and (kinds := _kinds_of(field)):
                if _is_list(field) and (number := next(parts, None)) is not None:
                    written.append(number)
                model = kinds.get(next(parts, None))
            elif field and (held := _held(field)):
                model = held
                if (number := next(parts, None)) is not None:
                    written.append(number)
        return model if _is_section(model) else None, tuple(written)

    def _kinds(self, path: case_text.Path) -> Mapping[Any, type[BaseModel]]:
        of = path[:-1] if isinstance(path[-1], int) else path
        parent, _ = self.section(of[:-1])
        field = parent.model_fields.get(str(of[-1])) if parent else None
        return _kinds_of(field) if field else {}

    def _keys(self, path: case_text.Path) -> list[str]:
        """The keys a section may have."""
        model, _ = self.section(path)
        kinds = [model] if model else list(self._kinds(path).values()) if path else []
        return list(dict.fromkeys(key for kind in kinds for key in (*kind.model_fields, *getattr(kind, "instead", ()))))


def _is_section(model: Any) -> bool:
    return isinstance(model, type) and issubclass(model, BaseModel)


def _kinds_of(field: FieldInfo) -> Mapping[Any, type[BaseModel]]:
    """The kinds by name of a section that comes in several, or of those in a list; none if it does not."""
    marks = [*field.metadata, *(mark for inner in _inside(field.annotation) for mark in inner)]
    return next((mark.known for mark in marks if isinstance(mark, Kinds)), {})


def _inside(annotation: Any) -> Iterator[tuple[Any, ...]]:
    """The metadata of what a list, or a list that may be left out, holds."""
    for inner in get_args(annotation):
        if get_origin(annotation) is list:
            yield getattr(inner, "__metadata__", ())
        else:
            yield from _inside(inner)


def _held(field: FieldInfo) -> type[BaseModel] | None:
    """The section of which a list holds several."""
    inner = get_args(field.annotation) if get_origin(field.annotation) is list else ()
    return next(filter(_is_section, inner), None)


def _is_list(field: FieldInfo) -> bool:
    return any(True for _ in _inside(field.annotation))


def kind_of(value: Any) -> str:
    """What a value is, for a message."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"the text '{shown(value)}'"
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "a section"
    return shown(value)


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
