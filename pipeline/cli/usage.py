"""What is said of a command line that cannot be understood: what is wrong, what was perhaps meant, where to read on."""

from __future__ import annotations

import re
from difflib import get_close_matches
from typing import Any

import typer

from pipeline.cli.completion import ENDINGS


def sentence(error: typer.TyperException, arguments: list[str]) -> str:
    """What is wrong with a command line, and the help of which command says more.

    Args:
        error: that typer raised.
        arguments: the command line.
    """
    context: Any = getattr(error, "ctx", None)
    # Of an option without its value typer does not say whose it is.
    words = [word for word in arguments if not word.startswith("-")]
    command = context.command_path if context else " ".join(["poro", *words[:1]])
    wrong = error.message if hasattr(error, "option_name") else error.format_message()
    for said, meant in _SAID:
        wrong = re.sub(said, meant, wrong)
    remedy = _remedy(error, wrong, context) if context else "."
    return f"{wrong.rstrip('.')}{remedy} See `{command} --help`."


#: What typer and pydantic say, and how it is said here.
_SAID = ((r" Did you mean .*\?$", ""), ("Value error, ", ""), ("Input should be", "must be"))


def _remedy(error: typer.TyperException, wrong: str, context: Any) -> str:
    """What was perhaps meant."""
    if option := getattr(error, "option_name", None):
        return _for_option(str(option), context)
    if choice := re.search("'([^']*)' is not one of (.*)", wrong):
        close = get_close_matches(choice[1], re.findall("'([^']*)'", choice[2]), n=1)
        return f". Did you mean {close[0]}?" if close else "."
    unknown = re.fullmatch(r"No such command '(.*)'\.", wrong)
    if not unknown:
        return "."
    word = unknown[1]
    close = get_close_matches(word, context.command.list_commands(context), n=1)
    if close:
        return f". Did you mean `poro {close[0]}`?"
    return f". Did you mean `poro run {word}`?" if word.endswith(ENDINGS) else "."


def _for_option(option: str, context: Any) -> str:
    here = _options(context.command, context)
    if option in here:  # its value is missing
        return "."
    group = context.find_root().command
    commands = {name: group.get_command(context, name) for name in group.list_commands(context)}
    having = [f"`poro {name}`" for name, command in commands.items() if option in _options(command, context)]
    if having:
        return f"; {', '.join(having)} {'has' if len(having) == 1 else 'have'} it."
    close = get_close_matches(option, here, n=1)
    return f". Did you mean {close[0]}?" if close else "."


def _options(command: Any, context: Any) -> list[str]:
    return [
        name for each in command.get_params(context) for name in (*each.opts, *each.secondary_opts) if name[0] == "-"
    ]
