"""YAML text to plain values, with the line of every key.

A case file needs mappings, lists, numbers, words, true, false and null; nothing else of YAML is accepted. The
parser's events are read one by one, so that tags construct nothing, anchors expand nothing and depth is bounded.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml

from pipeline.exit_codes import ExitCode, Fault, shown

#: Many times the longest shipped case; the worst text of this length takes a second or two to refuse.
MOST_BYTES = 64 * 1024
DEEPEST = 8

Path = tuple[str | int, ...]

# YAML's own spelling of numbers differs between its versions: in 1.1, which PyYAML and many editors follow, 1e-3 and
# 1e6 are words, 010 is eight and 1:30 is ninety. Only spellings that mean the same in every version are numbers here;
# the others stay words, and are refused with the right spelling where a number is due (`pipeline.case.model`).
_INTEGER = re.compile(r"[-+]?(0|[1-9][0-9]{0,18})")
_FLOAT = re.compile(r"([-+]?[0-9]+\.[0-9]*|\.[0-9]+)([eE][-+][0-9]+)?")
_WORDS: dict[str, Any] = {"true": True, "false": False, "null": None, "~": None, "": None}


@dataclass
class Document:
    """A parsed case file.

    Attributes:
        data: the values.
        lines: 1-based line of the key (or list entry) at each path; ``()`` is the document itself.
    """

    data: Any = None
    lines: dict[Path, int] = field(default_factory=dict)

    def line(self, path: Path) -> int:
        """Line of the key at a path, or of the innermost section around it that the text has."""
        while path not in self.lines:
            path = path[:-1]
        return self.lines[path]


def parse(text: bytes, origin: str) -> Document:
    """Parse a case file.

    Args:
        text: the file's bytes, UTF-8.
        origin: name of the file for messages.

    Raises:
        Fault: if the text is too large, no UTF-8, no YAML, or uses what a case file may not (USAGE).
    """
    if len(text) > MOST_BYTES:
        raise _fault(origin, 1, f"the file has {len(text)} bytes, more than {MOST_BYTES}; give a poro case file")
    try:
        events = yaml.parse(text.decode("utf-8-sig"), Loader=yaml.SafeLoader)
        return _Reader(origin, events).document()
    except UnicodeDecodeError as error:
        line = text[: error.start].count(b"\n") + 1
        raise _fault(origin, line, "the file is not UTF-8 text; save it as UTF-8") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = " ".join(part for part in (error.context, error.problem) if part)
        line = mark.line + 1 if mark else 1
        raise _fault(origin, line, f"not valid YAML ({problem}); check the indentation, colons and quotes") from None
    except yaml.reader.ReaderError as error:
        line = text.decode("utf-8-sig")[: error.position].count("\n") + 1
        raise _fault(origin, line, f"the character #x{error.character:04x} is not allowed; remove it") from None


def value(text: str, origin: str) -> Any:
    """A single value, as it is read behind the key of a case file; a blank text is null.

    Raises:
        Fault: if it is no value (USAGE).
    """
    if not text.strip():
        return None
    try:
        return parse(text.encode(), origin).data
    except Fault as fault:  # lines say nothing of a value
        raise Fault(fault.code, re.sub(rf"^{re.escape(origin)}:\d+:", f"{origin}:", str(fault))) from None


def _fault(origin: str, line: int, sentence: str) -> Fault:
    return Fault(ExitCode.USAGE, f"{origin}:{line}: {sentence}.")


def _line(event: yaml.Event) -> int:
    return event.start_mark.line + 1 if event.start_mark else 1


class _Reader:
    def __init__(self, origin: str, events: Iterator[yaml.Event]) -> None:
        self.origin = origin
        self.events = events
        self.result = Document(lines={(): 1})

    def document(self) -> Document:
        next(self.events)  # start of the stream
        if isinstance(next(self.events), yaml.StreamEndEvent):
            raise _fault(self.origin, 1, "the file is empty; write at least one section, such as 'domain:'")
        self.result.data = self.value(next(self.events), ())
        next(self.events)  # end of the document
        following = next(self.events)
        if not isinstance(following, yaml.StreamEndEvent):
            raise self.refuse(following, "a second YAML document starts here; keep one case per file")
        return self.result

    def refuse(self, event: yaml.Event, sentence: str, path: Path = ()) -> Fault:
        key = f"{dotted(path)}: " if path else ""
        return _fault(self.origin, _line(event), key + sentence)

    def value(self, event: yaml.Event, path: Path) -> Any:
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise self.refuse(event, "anchors and aliases (& and *) are not supported; write the value out", path)
        if tag := getattr(event, "tag", None):
            raise self.refuse(event, f"the tag {shown(tag)} is not supported; remove it", path)
        if len(path) > DEEPEST:
            raise self.refuse(event, f"nested deeper than {DEEPEST} levels; a case has sections of keys", path[:2])
        if isinstance(event, yaml.MappingStartEvent):
            return self.mapping(path)
        if isinstance(event, yaml.SequenceStartEvent):
            return self.sequence(path)
        assert isinstance(event, yaml.ScalarEvent)
        return _scalar(event)

    def mapping(self, path: Path) -> dict[str, Any]:
        values: dict[str, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            key = event.value if isinstance(event, yaml.ScalarEvent) else None
            if key is None or not key:
                raise self.refuse(event, "a key must be a word; remove the brackets or the question mark", path)
            here = (*path, key)
            if key in values:
                first = self.result.lines[here]
                raise self.refuse(event, f"written twice, first in line {first}; remove one of them", here)
            self.result.lines[here] = _line(event)
            values[key] = self.value(next(self.events), here)
        return values

    def sequence(self, path: Path) -> list[Any]:
        values: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            here = (*path, len(values))
            self.result.lines[here] = _line(event)
            values.append(self.value(event, here))
        return values


def dotted(path: Path) -> str:
    """A path as it is written in messages, such as ``domain.radius``."""
    return ".".join(shown(part) for part in path)


def _scalar(event: yaml.ScalarEvent) -> Any:
    text = event.value
    if not event.implicit[0]:  # quoted
        return text
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    return text
