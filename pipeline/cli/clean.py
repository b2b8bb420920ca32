"""The command ``poro clean``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli import completion
from pipeline.cli.options import Json, Output
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store.files import located
from pipeline.terminal import note, show


def clean(
    case: Annotated[
        Path | None,
        typer.Argument(
            metavar="CASE",
            help="Case file (.yaml), name of a case, its folder, or its design (.h5).",
            autocompletion=completion.cases,
        ),
    ] = None,
    everything: Annotated[bool, typer.Option("--all", help="Remove design, parts, results and log, too.")] = False,
    kernels: Annotated[bool, typer.Option("--kernels", help="Remove the compiled kernels.")] = False,
    yes: Annotated[
        bool, typer.Option("--yes", "-y", help="Remove it. Default: only say what would be removed.")
    ] = False,
    output: Output = None,
    as_json: Json = False,
) -> None:
    """Remove what a case left on its way to the part: intermediate artifacts, checkpoints, leftovers.

    The design, the parts and what was computed of them stay, unless --all is given. What is removed is made again where
    a later run needs it; the design updates of a checkpoint have to be computed again.
    """
    from pipeline.runs import cleaning

    if case is None and (everything or not kernels):
        raise Fault(ExitCode.USAGE, "Name a case to clean, or give --kernels.")
    files = cleaning.files_of(located(case), output) if case else None
    found = cleaning.of_case(files, everything=everything) if files else []
    if kernels:
        found += cleaning.of_kernels()
        if chosen := cleaning.foreign_kernels():
            note(f"{chosen}: is what NUMBA_CACHE_DIR names, perhaps for other programs too, and stays.")
    show(cleaning.cleaned(files, found, remove=yes, as_json=as_json))
