"""A case with other values at dotted keys: what the command line, a study or a program says instead of the file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from pipeline.case import text as case_text
from pipeline.case.model import Case, case_data, examined
from pipeline.case.quantities import without_other
from pipeline.exit_codes import ExitCode, Fault, shown
from stages.domains import MeshSettings

#: The option that sets any key.
SET = "--set"


def parsed(settings: Iterable[str]) -> dict[str, Any]:
    """What ``--set key=value`` says, by dotted key; values are read as those of a case file.

    Raises:
        Fault: if one is not of this form, or a key is there twice (USAGE).
    """
    found: dict[str, Any] = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        key = key.strip()
        if not equals or not all(key.split(".")):
            wrong = f"must be key=value, such as {SET} optimizer.max_updates=10, not '{shown(setting)}'"
            raise Fault(ExitCode.USAGE, f"{SET}: {wrong}; write it so.")
        if isinstance((field := Case.model_fields.get(key.partition(".")[0])) and field.default, list):
            raise Fault(ExitCode.USAGE, f"{SET}: {shown(key)}: is in a list; change it in the case file.")
        if key in found:
            raise Fault(ExitCode.USAGE, f"{SET}: {shown(key)}: is there twice; remove one of them.")
        found[key] = case_text.value(value, f"{SET}: {shown(key)}")
    return found


def with_values(case: Case, values: Mapping[str, Any]) -> dict[str, Any]:
    """The data of a case file as it would be with these values at dotted keys; they may be wrong."""
    data = case_data(case)
    for key, value in values.items():
        data = _replaced(without_other(data, key), key, value)
    return data


def _replaced(data: Mapping[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Data with the value at a dotted key, which need not exist."""
    first, _, rest = key.partition(".")
    if not rest:
        return dict(data) | {first: value}
    section = data.get(first)
    return dict(data) | {first: _replaced(section if isinstance(section, Mapping) else {}, rest, value)}


def changed(case: Case, values: Mapping[str, Any], options: Mapping[str, str] | None = None) -> Case:
    """A case with other values.

    Args:
        case: is not changed itself.
        values: by dotted key.
        options: of the command line that stand for a key, by key; what they say is not blamed on the key.

    Raises:
        Fault: one sentence for every mistake (USAGE).
    """
    made, wrong = examined(with_values(case, values))
    if made is None:
        raise Fault(ExitCode.USAGE, "\n".join(_blamed(path, sentence, options) for path, sentence in wrong))
    # A mesh that was read stays with the domain that named it.
    same = isinstance(case.domain, MeshSettings) and made.domain.model_dump() == case.domain.model_dump()
    return made.model_copy(update={"domain": case.domain}) if same else made


def _blamed(path: case_text.Path, sentence: str, options: Mapping[str, str] | None) -> str:
    """A mistake as what the user typed: his option in place of file, line and key."""
    if options is None:
        return f"{sentence}."
    key = case_text.dotted(path)
    return f"{options[key]}: {sentence.partition(': ')[2]}." if key in options else f"{SET}: {sentence}."
