"""Arguments and options that several commands have."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from pipeline import terminal
from pipeline.cli import completion
from pipeline.store.files import located
from pipeline.terminal import ColourChoice, Loudness
from stages.words import Unit

Source = Annotated[
    Path,
    typer.Argument(
        metavar="CASE",
        help="Case file (.yaml), artifact of a stage (.h5), or the folder of a case.",
        autocompletion=completion.cases,
        callback=located,
    ),
]
SourceOrSolid = Annotated[
    Path,
    typer.Argument(
        metavar="PART",
        help="Solid (.stl, .3mf) from any program, case file (.yaml), or the artifact of a stage (.h5).",
        autocompletion=completion.parts,
        callback=located,
    ),
]
OfCase = Annotated[
    Path | None,
    typer.Option(
        "--case",
        help="Case whose material, load, arm and spring a solid is inflated with. Default: the case that it was "
        "exported from, else the paper's.",
        autocompletion=completion.cases,
    ),
]
Part = Annotated[
    Path, typer.Argument(metavar="PART", help="Solid to print (.stl, .3mf), from any program.", callback=located)
]
OfUnit = Annotated[
    Unit | None,
    typer.Option("--unit", help="Unit of a solid whose file does not say it, as no STL does. Default: mm."),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        help="Folder for the folder of the case. Default: outputs/ if there is one, else here; where an .h5 lies.",
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Value of a key instead of the case's, as in optimizer.max_updates=10; may be repeated.",
        autocompletion=completion.keys,
    ),
]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Only say what would run.")]
Json = Annotated[bool, typer.Option("--json", help="Print a summary as JSON.")]
Force = Annotated[bool, typer.Option("--force", help="Run even what is up to date.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Ignore what an interrupted optimisation left.")]

#: Formats of figures.
FigureFormat = Literal["png", "svg", "pdf"]


def _wish(loudness: Loudness) -> Any:
    def wished(wanted: bool) -> None:
        manner = terminal.manner()
        if wanted and manner.loudness not in (loudness, Loudness.NORMAL):
            raise typer.BadParameter("--quiet and --verbose exclude each other; leave one out.")
        if wanted:
            manner.loudness = loudness

    return wished


def _paint(choice: ColourChoice | None) -> None:
    if choice:
        terminal.manner().colour = choice


def _common(name: str, kind: Any, *flags: str, help: str, callback: Any, default: Any) -> inspect.Parameter:
    option = typer.Option(*flags, help=help, callback=callback)
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=Annotated[kind, option], default=default)


#: Options of the program and of every command; their callbacks do all there is to do.
COMMON = (
    _common(
        "quiet",
        bool,
        "--quiet",
        "-q",
        help="Only say what went wrong, and the names of the files.",
        callback=_wish(Loudness.QUIET),
        default=False,
    ),
    _common(
        "verbose",
        bool,
        "--verbose",
        "-v",
        help="Also say what else goes into the log.",
        callback=_wish(Loudness.VERBOSE),
        default=False,
    ),
    _common(
        "color",
        ColourChoice | None,
        "--color",
        help="Colours. Default: auto, on a terminal without NO_COLOR.",
        callback=_paint,
        default=None,
    ),
)


def with_common(command: Callable[..., None]) -> Callable[..., None]:
    """A command that has the options of all, too."""

    @functools.wraps(command)
    def wrapped(**given: Any) -> None:
        command(**{name: value for name, value in given.items() if name not in _COMMON_NAMES})

    parameters = inspect.signature(command, eval_str=True).parameters.values()
    signature = inspect.Signature([*parameters, *COMMON])
    wrapped.__signature__ = signature  # type: ignore[attr-defined]
    return wrapped


_COMMON_NAMES = {parameter.name for parameter in COMMON}
