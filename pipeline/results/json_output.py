"""What ``--json`` prints: one object per command, with the same first and last keys everywhere."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from pipeline.store.artifact import program_version
from pipeline.store.atomic import encoded


def result_json(command: str, found: Mapping[str, Any], files: Iterable[Path | str] = ()) -> str:
    """The result of a command as JSON.

    Args:
        command: its name.
        found: its own keys, which stand between ``command``, ``program_version`` and ``files``.
        files: what it wrote or found up to date.

    Raises:
        ValueError: if a number is not finite, which JSON lacks.
    """
    head = {"command": command, "program_version": program_version()}
    result = head | dict(found) | {"files": [str(file) for file in files]}
    text = json.dumps(result, indent=2, ensure_ascii=False, allow_nan=False)
    return encoded(text).decode()  # escapes are JSON's own: names of files that are no UTF-8 can be read back
