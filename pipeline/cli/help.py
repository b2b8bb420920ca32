"""What ``--help`` looks like: commands in groups, an example each, and no line broken inside a word."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

#: Columns that names of options get at most, and share of a line that they get where that is short.
NAMES, SHARE = 30, 3
#: Heading of commands of no group.
OTHERS = "Other commands"


#: Typer has no public name for it.
_FORMATTER: Any = typer.Context.formatter_class


class Formatter(_FORMATTER):
    """Text and lists as wide as the terminal allows, 80 columns at most."""

    def write_text(self, text: str) -> None:
        """Write paragraphs."""
        paragraphs = ("\n".join(self._wrapped(part, self.current_indent)) for part in text.split("\n\n"))
        self.write("\n\n".join(paragraphs) + "\n")

    def write_dl(self, rows: Sequence[tuple[str, str]], col_max: int = NAMES, col_spacing: int = 2) -> None:
        """Write names and what they mean in two columns; a name that is too long has a line of its own."""
        most = min(col_max, self.width // SHARE)
        fitting = [len(name) for name, _ in rows if len(name) <= most]
        column = self.current_indent + max(fitting, default=most) + col_spacing
        for name, meaning in rows:
            # Choices may be parted at their bars.
            names = [line.replace("| ", "|") for line in self._wrapped(name.replace("|", "| "), self.current_indent)]
            lines = self._wrapped(meaning, column)
            if lines and len(name) <= most:
                lines[0] = names.pop().ljust(column) + lines[0][column:]
            self.write("\n".join([*names, *lines]) + "\n")

    def _wrapped(self, text: str, indent: int) -> list[str]:
        room = " " * indent
        return textwrap.wrap(
            text,
            self.width,
            initial_indent=room,
            subsequent_indent=room,
            break_long_words=False,
            break_on_hyphens=False,
        )


class Context(typer.Context):
    """A context whose help is written so."""

    formatter_class = Formatter


class Command(TyperCommand):
    """A command whose epilog is an example."""

    context_class = Context

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the example as it is typed."""
        if self.epilog:
            with formatter.section("Example"):
                formatter.write(f"  {self.epilog}\n")


class Group(TyperGroup):
    """The program: its commands stand in groups, in the order in which they were registered."""

    context_class = Context

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write names and first sentences of the commands, group by group."""
        for heading, commands in grouped(self, ctx).items():
            with formatter.section(heading):
                formatter.write_dl([(name, summary(command)) for name, command in commands])


def grouped(group: Any, context: Any) -> dict[str, list[tuple[str, Any]]]:
    """Names and commands that are not hidden, by the heading of their group."""
    found: dict[str, list[tuple[str, Any]]] = {}
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if not command.hidden:
            found.setdefault(getattr(command, "rich_help_panel", None) or OTHERS, []).append((name, command))
    return found


def summary(command: Any) -> str:
    """The first paragraph of what a command says of itself."""
    return (command.help or "").partition("\n\n")[0]
