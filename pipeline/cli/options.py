"""Arguments and options that several commands have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from pipeline.cli import completion

Source = Annotated[
    Path,
    typer.Argument(
        metavar="CASE", help="Case file (.yaml), or the artifact of a stage (.h5).", autocompletion=completion.cases
    ),
]
SourceOrSolid = Annotated[
    Path,
    typer.Argument(
        metavar="PART",
        help="Solid (.stl, .3mf) from any program, case file (.yaml), or the artifact of a stage (.h5).",
        autocompletion=completion.parts,
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
Part = Annotated[Path, typer.Argument(metavar="PART", help="Solid to print (.stl, .3mf), from any program.")]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", help="Folder of the results. Default: outputs/ if there is one, else here; beside an .h5."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print a summary as JSON.")]
Force = Annotated[bool, typer.Option("--force", help="Run even what is up to date.")]
Fresh = Annotated[bool, typer.Option("--fresh", help="Ignore what an interrupted optimisation left.")]

#: Formats of figures.
FigureFormat = Literal["png", "svg", "pdf"]
