"""The reference of all commands as a Markdown page, made from the program itself.

    python -m pipeline.cli.reference docs/reference/commands.md

It says what ``--help`` says, of whatever commands are registered, and nothing of the machine or the day.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer
import typer.main

from pipeline.cli.help import grouped, summary
from pipeline.cli.options import COMMON
from pipeline.store.atomic import write_bytes
from pipeline.store.tables import as_markdown

#: How the committed page is renewed.
RENEWAL = "python -m pipeline.cli.reference docs/reference/commands.md"

#: Typer's own options: what it says of them depends on the shell it finds.
_OF_THE_SHELL = ("install_completion", "show_completion")
#: Options that every command has, beside the program: they are listed once.
_OF_ALL = (*(parameter.name for parameter in COMMON), "help")

_HEAD = f"""\
# Commands

<!-- Made by `{RENEWAL}`; do not edit. -->

This page is made from the program. `poro --help` and `poro COMMAND --help` say the same.
`poro --install-completion` lets the shell complete commands and options. How commands end: [exit codes](faults.md).
"""

_GENERAL = """\
`-q`, `-v`, `--color` and `-h` may also stand behind every command. Only terminals get lines that are broken to fit, and
colours, unless `NO_COLOR` is set or `TERM` is `dumb`.
"""


def reference(app: typer.Typer, name: str) -> str:
    """All commands of an application that are not hidden, groups included: usage, arguments, options."""
    command: Any = typer.main.get_command(app)
    context = typer.Context(command, info_name=name, **command.context_settings)
    contents: dict[str, list[tuple[str, str]]] = {}
    sections = []
    for heading, found in _commands(context):
        link = f"[`{found.command_path}`](#{_anchor(found)})"
        contents.setdefault(heading, []).append((link, summary(found.command)))
        sections.append(_section(found))
    tables = [as_markdown((heading, "what it does"), links) for heading, links in contents.items()]
    general = [f"## {name}", _table("option", _records(context, "option")), _GENERAL.strip()]
    return "\n\n".join([_HEAD.strip(), *tables, *general, *sections]) + "\n"


def _commands(context: typer.Context) -> Iterator[tuple[str, typer.Context]]:
    """The commands below a context and their headings, as ``--help`` has them; those of groups after their group."""
    group: Any = context.command  # typer's own classes of commands have no public name
    for heading, commands in grouped(group, context).items():
        for name, command in commands:
            found = typer.Context(command, info_name=name, parent=context)
            yield heading, found
            if hasattr(command, "list_commands"):
                yield from ((heading, below) for _, below in _commands(found))


def _section(context: typer.Context) -> str:
    command = context.command
    usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
    parts = [f"## {context.command_path}", command.help or "", f"    {usage}"]
    for kind in ("argument", "option"):
        if records := _records(context, kind):
            parts.append(_table(kind, records))
    if command.epilog:
        parts += ["Example:", f"    {command.epilog}"]
    return "\n\n".join(part for part in parts if part)


def _records(context: typer.Context, kind: str) -> list[tuple[str, str]]:
    """Names and meaning, as ``--help`` has them, of the options or arguments that it shows."""
    parameters = [
        each
        for each in context.command.get_params(context)
        if each.param_type_name == kind
        and each.name not in _OF_THE_SHELL
        and (context.parent is None or each.name not in _OF_ALL)
    ]
    return [record for each in parameters if (record := each.get_help_record(context)) is not None]


def _table(kind: str, records: list[tuple[str, str]]) -> str:
    """Rows of name, meaning and what stands in brackets behind it: the default, or that it is required."""
    rows = []
    for names, meaning in records:
        text, _, extra = meaning.rpartition("  [") if meaning.endswith("]") else (meaning, "", "")
        rows.append((f"`{names}`", text, extra.removesuffix("]").removeprefix("default: ")))
    return as_markdown((kind, "meaning", "default"), rows)


def _anchor(context: typer.Context) -> str:
    """The link that GitHub makes of a heading of words."""
    return context.command_path.lower().replace(" ", "-")


def main(path: Path) -> None:
    """Write the reference of the program."""
    from pipeline.cli.app import program

    write_bytes(path, reference(program(), "poro").encode())


if __name__ == "__main__":
    main(Path(sys.argv[1]))
