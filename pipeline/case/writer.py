"""A case as a commented case file: every key with its meaning, unit and default, from the case's own model."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pipeline.case.changes import changed, parsed
from pipeline.case.messages import number_text
from pipeline.case.model import Case, case_schema, find_case, mistakes, parse_case, read_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import atomic
from stages.section import Section
from stages.units import unit_of

SCHEMA_FILE = "case.schema.json"
#: Width of what stands before a comment.
COMMENTS = 36
UNITS = (
    "# Units: mm, N, MPa = N/mm², s, or those that stand behind a value, as in 70 kPa; [-] is a number without a unit."
)


def case_text(case: Case, head: str, schema: str | None = None) -> str:
    """The text of a case file that holds a case in full.

    Args:
        case: the case.
        head: first line, without ``#``.
        schema: file of the schema as seen from the case file, for editors.
    """
    modeline = [f"# yaml-language-server: $schema={schema}"] if schema else []
    lines = [*modeline, f"# {head}", UNITS, ""]
    for name, field in type(case).model_fields.items():
        value = getattr(case, name)
        if isinstance(value, Section):
            lines += ["", *_section(name, value, case)]
        elif isinstance(value, list):
            lines += ["", *_list(name, value, field)]
        else:
            lines.insert(len(modeline) + 3, _line(name, value, field, default=False))
    return "\n".join(lines) + "\n"


def write_new(
    name: str, like: str, output: Path | None, *, force: bool, schema: bool, settings: Iterable[str] = ()
) -> list[Path]:
    """Write a new case with the values of a shipped or own one; returns the files.

    Args:
        name: of the case; the file is ``name.yaml`` unless ``output`` says otherwise.
        like: name or path of the case it begins as; the ending may be left out.
        output: the file.
        force: whether to replace files that are there.
        schema: whether to write the schema beside it and to name it to editors.
        settings: what it says instead of that one, ``key=value`` each.

    Raises:
        Fault: if a value is wrong, a name is not usable, a file is in the way or a folder is missing (USAGE).
        OSError: if the folder or the disk does not take a file.
    """
    name = name.removesuffix(".yaml")
    origin = find_case(Path(like if like.endswith((".yaml", ".yml")) else f"{like}.yaml"))
    wrong = mistakes({"name": name})
    if wrong:
        raise Fault(ExitCode.USAGE, f"{wrong[0][1]}.")
    case = changed(read_case(origin)[0], {**parsed(settings), "name": name}, {})
    target = output or Path(f"{name}.yaml")
    if not target.parent.is_dir():
        raise Fault(ExitCode.USAGE, f"{target}: there is no folder {target.parent}; make it or choose another.")
    head = f"Made by `poro new` from {origin.name}; every key is here, with its meaning, unit and default."
    text = case_text(case, head, SCHEMA_FILE if schema else None)
    parse_case(atomic.encoded(text), str(target), name)  # what is written can be read
    texts = {target: text}
    if schema:
        texts[target.with_name(SCHEMA_FILE)] = case_schema() + "\n"
    for path, wanted in texts.items():
        if path.is_dir():
            raise Fault(ExitCode.USAGE, f"{path}: this is a folder; name a file in it with --output.")
        if path.exists() and not force and path.read_bytes() != atomic.encoded(wanted):
            raise Fault(ExitCode.USAGE, f"{path}: there is such a file; choose another name, or replace it by --force.")
    for path, wanted in texts.items():
        atomic.write_text(path, wanted)
    return list(texts)


def _section(name: str, section: Section, case: Case) -> Iterator[str]:
    meaning = (type(section).__doc__ or "").strip().splitlines()[0]
    yield f"{f'{name}:':<{COMMENTS}}  # {meaning}"
    for key, field in type(section).model_fields.items():
        value, known = getattr(section, key), COMMENTS - 2
        other = next((other for other, instead in section.instead.items() if instead.ratio == key), "")
        given = other in case.given
        line = _line(key, value, field, width=known - 2 * given)
        yield f"  # {line}" if given else f"  {line}"
        if other:
            description = section.instead[other].description
            text = f"{other}: {value_text(case.quantities()[other])} {unit_of(description)}"
            yield f"  {text:<{known}}  # {description}" if given else f"  # {text:<{known - 2}}  # or {description}"


def _list(name: str, entries: list[Section], field: FieldInfo) -> Iterator[str]:
    yield f"{f'{name}:' if entries else f'{name}: []':<{COMMENTS}}  # {field.description}"
    for entry in entries:
        for row, (key, each) in enumerate(type(entry).model_fields.items()):
            yield f"  {' ' if row else '-'} {_line(key, getattr(entry, key), each, width=COMMENTS - 4, default=False)}"


def _line(key: str, value: Any, field: FieldInfo, *, width: int = COMMENTS, default: bool = True) -> str:
    told = f"; default {value_text(field.default)}" if default else ""
    return f"{f'{key}: {value_text(value)}':<{width}}  # {field.description}{told}"


def value_text(value: Any) -> str:
    """A value as every YAML reader takes it."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, BaseModel):
        return value_text(value.model_dump())
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {value_text(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(value_text, value))}]"
    if isinstance(value, float):
        brief = f"{value:g}"
        return number_text(brief if "e" in brief and float(brief) == value else repr(value))
    return str(value)
