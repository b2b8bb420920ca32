"""The reference of the case file as a Markdown page, made from the JSON Schema that the case's own model gives.

    python -m pipeline.case.reference docs/reference/case-file.md

Whatever sections, keys and kinds of a section the program has, registered ones included, are on the page.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pipeline.case.model import case_schema
from pipeline.case.writer import value_text
from pipeline.store.atomic import write_bytes
from pipeline.store.tables import as_markdown, markdown_cell

#: How the committed page is renewed.
RENEWAL = "python -m pipeline.case.reference docs/reference/case-file.md"

#: A part of a JSON Schema.
Schema = dict[str, Any]

_HEAD = f"""\
# Case file

<!-- Made by `{RENEWAL}`; do not edit. -->

Every section and key of a case file. All of them may be left out: a key that is not written takes its default.
`poro new` writes a file with every key, `poro schema` prints the same as JSON Schema for editors, and
[How to](../use/howto.md#your-own-case) says which keys to change first. Numbers are written so that every YAML reader
takes them for numbers: `1.0e-3`, not `1e-3`. A *quantity* is a number with a unit of its own, `1.5 cm`, `70 kPa`,
`3 psi` or `0.05 N/mm`; a number alone counts in the unit of its key.
"""

_WORDS = {
    "number": "number",
    "integer": "whole number",
    "string": "word",
    "boolean": "true or false",
    "null": "null",
    "object": "section",
}
_BOUNDS = (("exclusiveMinimum", ">"), ("minimum", "≥"), ("exclusiveMaximum", "<"), ("maximum", "≤"))
_UNIT = re.compile(r" ?\[([^\]]+)\]")


def reference(schema: Schema) -> str:
    """All sections and keys of a case file: type, unit, default, bounds and meaning.

    Args:
        schema: of the case file; see :func:`pipeline.case.model.case_schema`.
    """
    alone = {name: key for name, key in schema["properties"].items() if not _kinds(key, schema)}
    sections = {name: key for name, key in schema["properties"].items() if name not in alone}
    contents = []
    for name, section in sections.items():
        kinds = _kinds(section, schema)
        # Of several kinds what is said of the one that is meant where a case does not say which.
        default = section.get("default")
        named = default.values() if isinstance(default, dict) else ()
        meant = next((kind for kind in kinds if kind in named), next(iter(kinds)))
        meaning = section.get("description") or kinds[meant].get("description", "")
        contents.append((f"[`{name}`](#{name})", meaning))
    beside = "Beside the sections stands one key:" if len(alone) == 1 else "Beside the sections:"
    parts = [as_markdown(("section", "what it holds"), contents), beside, _table(alone, schema)]
    for name, section in sections.items():
        parts += _section(name, section, schema)
    return "\n\n".join([_HEAD.strip(), *parts]) + "\n"


def _section(name: str, section: Schema, schema: Schema, depth: int = 2) -> Iterator[str]:
    """Heading and keys of a section, those of its kinds and of the sections inside it after it."""
    yield f"{'#' * depth} {name}"
    kinds = _kinds(section, schema)
    if len(kinds) > 1:
        each = "A list, each entry one of" if section.get("type") == "array" else "One of"
        yield f"{each} {', '.join(f'`{kind}`' for kind in kinds)}:"
    for kind, model in kinds.items():
        if len(kinds) > 1:
            yield f"{'#' * (depth + 1)} {name}: {kind}"
        yield markdown_cell(model.get("description", ""))
        yield _table(model["properties"], schema, model.get("required", ()))
        for key, inside in model["properties"].items():
            if _kinds(inside, schema):
                yield from _section(f"{name}.{key}", inside, schema, depth + 1)


def _table(keys: Schema, schema: Schema, required: Any = ()) -> str:
    rows = []
    for name, key in keys.items():
        unit = _UNIT.search(key.get("description", ""))
        default = "required" if name in required else f"`{value_text(_brief(key.get('default')))}`"
        if key.get("default") is None and name not in required:
            default = "none"
        cells = (
            f"`{name}`",
            _type(key, schema),
            unit[1] if unit else "",
            default,
            "; ".join(dict.fromkeys(_bounds(key))),
            _UNIT.sub("", key.get("description", "")),
        )
        rows.append(cells)
    return as_markdown(("key", "type", "unit", "default", "bounds", "meaning"), rows)


def _brief(default: Any) -> Any:
    """A section whose only key is its name, as that name."""
    return default["name"] if isinstance(default, dict) and set(default) == {"name"} else default


def _type(key: Schema, schema: Schema) -> str:
    if kinds := _kinds(key, schema):
        held = "list of sections" if "items" in key else "section or list of them" if _has_list(key) else "section"
        return held if len(kinds) == 1 else f"{held}, one of " + ", ".join(f"`{kind}`" for kind in kinds)
    if "anyOf" in key:
        choices = [_type(choice, schema) for choice in key["anyOf"] if choice.get("type") != "null"]
        return " or ".join(dict.fromkeys(choices))
    if "const" in key or "enum" in key:
        return ", ".join(f"`{value}`" for value in key.get("enum", [key.get("const")]))
    if key.get("type") == "array":
        inside = _type(key["items"], schema)
        several = inside.replace("list", "lists") if inside.startswith("list") else f"{inside}s"
        return f"list of {several}".replace("number or quantitys", "numbers or quantities")
    return "quantity" if key.get("format") == "quantity" else _WORDS[key["type"]]


def _bounds(key: Schema) -> Iterator[str]:
    found = [f"{sign} {key[name]:g}" for name, sign in _BOUNDS if name in key]
    if found:
        yield ", ".join(found)
    if "minItems" in key or "maxItems" in key:
        least, most = key.get("minItems", 0), key.get("maxItems")
        yield "at least one" if most is None else f"{most} of them" if least == most else f"{least} to {most} of them"
    if "maxLength" in key:
        yield f"at most {key['maxLength']} characters"
    for choice in [*key.get("anyOf", ()), *([key["items"]] if "items" in key else [])]:
        yield from _bounds(choice)


def _kinds(key: Schema, schema: Schema) -> dict[str, Schema]:
    """The models of a key that is a section or a list of them, by the name that chooses; none of any other key."""
    if "$ref" in key:
        name = key["$ref"].rpartition("/")[2]
        return {name: schema["$defs"][name]}
    if mapping := key.get("discriminator", {}).get("mapping"):
        return {name: schema["$defs"][each.rpartition("/")[2]] for name, each in sorted(mapping.items())}
    choices = [*key.get("anyOf", ()), *([key["items"]] if "items" in key else [])]
    return {name: model for choice in choices for name, model in _kinds(choice, schema).items()}


def _has_list(key: Schema) -> bool:
    return any("items" in choice for choice in (key, *key.get("anyOf", ())))


def main(path: Path) -> None:
    """Write the reference of the program."""
    write_bytes(path, reference(json.loads(case_schema())).encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
