"""The reference of the case file is the program's, whatever sections and keys it has."""

from __future__ import annotations

import json
import re
from pathlib import Path

from pydantic import BaseModel

from pipeline.case.model import case_schema, case_type
from pipeline.case.reference import RENEWAL, main, reference

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "case-file.md"


def test_committed_page_is_what_the_program_says(tmp_path: Path) -> None:
    main(tmp_path / "page.md")
    made, committed = (path.read_text(encoding="utf-8") for path in (tmp_path / "page.md", PAGE))
    assert committed == made, f"docs/reference/case-file.md is out of date; renew it: {RENEWAL}"


def test_page_has_every_section_and_key() -> None:
    """Of the models themselves, not of the schema that the page is made from."""
    sections = re.split(r"^## ", reference(json.loads(case_schema())), flags=re.MULTILINE)
    text = {section.partition("\n")[0]: section for section in sections[1:]}
    models = {
        name: field.annotation
        for name, field in case_type().model_fields.items()
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel)
    }
    assert models.keys() <= text.keys()
    for name, model in models.items():
        for key in model.model_fields:
            assert f"\n| `{key}` | " in text[name], f"{name}.{key}"
    assert "\n| `name` | word | " in sections[0]


def test_type_unit_default_and_bounds_are_told() -> None:
    schema = {
        "$defs": {
            "Box": {
                "description": "A box.",
                "properties": {
                    "kind": {"const": "box", "type": "string"},
                    "side": {
                        "type": "number",
                        "exclusiveMinimum": 0,
                        "maximum": 9,
                        "default": 1e-6,
                        "description": "a, its side [mm]; all are equal",
                    },
                },
                "required": ["kind"],
            },
            "Ball": {"description": "A ball.", "properties": {"kind": {"const": "ball"}}, "required": ["kind"]},
        },
        "properties": {
            "name": {"type": "string", "default": "case", "maxLength": 5, "description": "this | that"},
            "shape": {
                "discriminator": {"mapping": {"box": "#/$defs/Box", "ball": "#/$defs/Ball"}, "propertyName": "kind"},
                "description": "What it looks like.",
            },
            "limit": {"anyOf": [{"type": "integer", "minimum": 2}, {"type": "null"}], "default": None},
        },
    }
    text = reference(schema)
    assert "\n| `name` | word |  | `case` | at most 5 characters | this \\| that |\n" in text
    assert "\n| `limit` | whole number |  | none | ≥ 2 |  |\n" in text
    assert "\n| [`shape`](#shape) | What it looks like. |\n" in text
    assert "\n| `side` | number | mm | `1.0e-6` | > 0, ≤ 9 | a, its side; all are equal |\n" in text
    assert "\n| `kind` | `ball` |  | required |  |  |\n" in text
    assert re.findall(r"^#+ (.*)$", text, flags=re.MULTILINE)[1:] == ["shape", "shape: ball", "shape: box"]
