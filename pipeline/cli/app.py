"""The command ``poro``: it parses, calls, and turns every end into a sentence and an exit code.

Heavy modules are imported inside the commands, so that ``poro --help`` is immediate.
"""

from __future__ import annotations

import logging
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from typing import Annotated

import typer

from actuator.failure import Failure
from pipeline import terminal
from pipeline.cli import clean, compare, fit, groups, parts, results, stages, study, usage
from pipeline.cli.help import Group
from pipeline.cli.options import with_common
from pipeline.exit_codes import ExitCode, Fault, code_of, unexpected
from pipeline.runs.interruption import heeded

_CODES = ", ".join(f"{code.value} {code.meaning}" for code in ExitCode)


def program() -> typer.Typer:
    """The program with the commands of all stages that are registered now."""
    app = typer.Typer(
        name="poro",
        cls=Group,
        context_settings={"help_option_names": ["-h", "--help"]},
        epilog=f"Exit codes: {_CODES}.",
        add_completion=True,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
    )
    app.callback()(with_common(options))
    stages.register(app)
    results.register(app)
    parts.register(app)
    app.command(cls=fit.FitCommand)(fit.fit)
    app.command()(compare.compare)
    app.command()(schema)
    study.register(app)
    app.command()(clean.clean)
    groups.arrange(app)
    return app


def schema() -> None:
    """Print the JSON Schema of the case file."""
    from pipeline.case.model import case_schema

    typer.echo(case_schema())


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"poro {version('poro')}")
        raise typer.Exit


def options(
    version: Annotated[
        bool, typer.Option("--version", "-V", help="Print the version.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Topology optimisation of pneumatic soft actuators, from a case file to a printable part."""


def main() -> None:
    """Run the command line and end the process with the documented exit code."""
    sys.exit(call(sys.argv[1:]))


def call(arguments: list[str]) -> ExitCode:
    """Run a command line; returns its exit code, having said in a sentence what went wrong, if anything did."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # an old terminal shows ? for θ rather than stopping us
            stream.reconfigure(errors="replace")
    with terminal.own_manner():
        return _called(arguments)


def _called(arguments: list[str]) -> ExitCode:
    try:
        with heeded(), _warnings_logged():
            ended = program()(arguments or ["--help"], prog_name="poro", standalone_mode=False)
    except Fault as fault:
        return _end(fault.code, str(fault))
    except Failure as failure:
        return _end(code_of(failure), str(failure))
    except typer.TyperException as error:
        return _end(ExitCode.USAGE, usage.sentence(error, arguments))
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        reason = f"{where}a file could not be written or read ({error.strerror or error})"
        remedy = "make room or choose another folder, and run the same command to continue"
        return _end(ExitCode.UNEXPECTED, f"{reason}; {remedy}.")
    except MemoryError:
        return _end(ExitCode.UNEXPECTED, "The memory does not suffice; use a coarser mesh (section 'domain:').")
    except Exception as error:
        with tempfile.NamedTemporaryFile("w", prefix="poro-", suffix=".log", delete=False, encoding="utf-8") as log:
            traceback.print_exc(file=log)
        if terminal.verbose():
            traceback.print_exc()
        return _end(ExitCode.UNEXPECTED, str(unexpected(error, log.name)))
    if ended == ExitCode.INTERRUPTED:  # what typer makes of a KeyboardInterrupt
        return _end(ExitCode.INTERRUPTED, "Interrupted; run the same command again.")
    return ExitCode.OK


@contextmanager
def _warnings_logged() -> Iterator[None]:
    """Warnings of libraries go to the log, if the command has one, and never to the terminal."""
    told = logging.getLogger("py.warnings")
    told.propagate = False
    logging.captureWarnings(True)
    if not told.handlers:
        told.addHandler(logging.NullHandler())
    try:
        yield
    finally:
        logging.captureWarnings(False)


def _end(code: ExitCode, sentence: str) -> ExitCode:
    terminal.complain(f"{terminal.painted('poro:', 'fail', sys.stderr)} {sentence}")
    return code
