"""The command ``poro fit``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from pipeline.cli import completion
from pipeline.cli.help import Command
from pipeline.cli.options import Json
from pipeline.terminal import show


class FitCommand(Command):
    """The command, which looks the names of the laws up when it is asked for: a program may have added some."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The parameters, with the laws that there are in the place of the value of ``--law``."""
        found = super().get_params(ctx)
        for parameter in found:
            if parameter.name == "law":
                parameter.metavar = f"<{'|'.join(completion.laws(''))}>"
        return found


def _known(law: str) -> str:
    if law not in (known := completion.laws("")):
        raise typer.BadParameter(f"'{law}' is not one of {', '.join(map(repr, known))}.")
    return law


#: Units of stress.
StressUnit = Literal["MPa", "kPa", "Pa"]


def fit(
    data: Annotated[Path, typer.Argument(metavar="CSV", help="Columns stretch (or strain) and engineering stress.")],
    law: Annotated[
        str, typer.Option("--law", help="Law to fit.", callback=_known, autocompletion=completion.laws)
    ] = "all",
    terms: Annotated[int, typer.Option("--terms", help="Most terms of the Ogden law, 1 to 3.")] = 2,
    unit: Annotated[
        StressUnit | None, typer.Option("--unit", help="Unit of the stress, unless the header has it. Default: MPa.")
    ] = None,
    strain_limit: Annotated[
        float, typer.Option("--strain-limit", help="Strain up to which a law must be stable, beyond the data's too.")
    ] = 0.14,
    plot: Annotated[bool, typer.Option(help="Draw data and laws as PNG beside the CSV.")] = True,
    as_json: Json = False,
) -> None:
    """Fit material laws to a uniaxial tension test and print the section for a case file."""
    from pipeline.measured.fitting import fit_file

    options = {"law": law, "terms": terms, "strain_limit": strain_limit}
    report = fit_file(data, options, unit, plot=plot)
    show(report.as_json() if as_json else report.as_text())
