"""How results are told: how much of them, in which colours, and how wide, as the user asked and his terminal can show.

Text that goes to a file or another program stays as it is: no colours, no line broken.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Literal, TextIO

import typer


class Loudness(IntEnum):
    """How much is said."""

    QUIET = 0
    NORMAL = 1
    VERBOSE = 2


#: When text is coloured.
ColourChoice = Literal["auto", "always", "never"]
#: What is said of a result, and the colours of that.
Verdict = Literal["pass", "warn", "fail"]
COLOURS: dict[Verdict, str] = {"pass": "green", "warn": "yellow", "fail": "red"}


@dataclass
class Manner:
    """What the user asked for."""

    loudness: Loudness = Loudness.NORMAL
    colour: ColourChoice = "auto"


_manner: ContextVar[Manner | None] = ContextVar("manner", default=None)


@contextmanager
def own_manner() -> Iterator[Manner]:
    """A manner for one command line, which its options may change."""
    own = Manner()
    token = _manner.set(own)
    try:
        yield own
    finally:
        _manner.reset(token)


def manner() -> Manner:
    """What the user asked for."""
    return _manner.get() or Manner()


def quiet() -> bool:
    """Whether only faults and the names of files are wanted."""
    return manner().loudness == Loudness.QUIET


def verbose() -> bool:
    """Whether all that the log is told is wanted."""
    return manner().loudness == Loudness.VERBOSE


def coloured(stream: TextIO | None = None) -> bool:
    """Whether text on a stream, standard output by default, has colours: https://no-color.org, and no dumb terminal."""
    if (asked := manner().colour) != "auto":
        return asked == "always"
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return False
    return _is_terminal(stream or sys.stdout)


def painted(text: str, verdict: Verdict | None, stream: TextIO | None = None) -> str:
    """A text in the colour of a verdict, where the stream has colours."""
    return typer.style(text, fg=COLOURS[verdict]) if verdict and coloured(stream) else text


def told(text: str, files: Iterable[Path | str]) -> str:
    """What is printed of a result: the text, or the names of its files if no more is wanted."""
    return "\n".join(map(str, files)) if quiet() else text


def show(text: str) -> None:
    """Print a result for people, lines too long for a terminal broken between words."""
    if text:
        typer.echo(fitted(text, sys.stdout), color=coloured())


def note(text: str) -> None:
    """Print what is beside the result on standard error, unless the user wants quiet."""
    if not quiet():
        complain(text)


def complain(text: str) -> None:
    """Print on standard error, as :func:`show` does."""
    typer.echo(fitted(text, sys.stderr), err=True, color=coloured(sys.stderr))


def fitted(text: str, stream: TextIO) -> str:
    """A text whose lines fit a terminal; as it is where the stream is none, and JSON always."""
    if quiet() or text.startswith("{") or not _is_terminal(stream):
        return text
    width = shutil.get_terminal_size().columns
    return "\n".join(broken(line, width) for line in text.splitlines())


_COLOUR = re.compile(r"\x1b\[[0-9;]*m")
#: What stands between two columns.
_GAP = re.compile(r"\s{2,}")


def broken(line: str, width: int) -> str:
    """A line in several ones no wider than this, broken between words; they stand below the last column of the first.

    A row of a Markdown table is left whole, and so is a word that is wider.
    """
    if _visible(line) <= width or line.startswith("|"):
        return line
    gaps = [gap.end() for gap in _GAP.finditer(_COLOUR.sub("", line))]
    indent = gaps[-1] if gaps and gaps[-1] <= width // 2 else 4
    lines, current = list[str](), ""
    for word in re.split(" (?!%)", line):  # a number keeps its sign
        longer = f"{current} {word}" if current.strip() or not lines else current + word
        if _visible(longer) - (not lines) > width and current.strip():
            lines.append(current)
            longer = " " * indent + word
        current = longer
    first, *rest = [*lines, current]
    return "\n".join(line.rstrip() for line in (first[1:], *rest))


def _visible(text: str) -> int:
    return len(_COLOUR.sub("", text))


def _is_terminal(stream: TextIO) -> bool:
    try:
        return stream.isatty()
    except ValueError:  # closed
        return False
