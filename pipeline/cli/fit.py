"""The command ``poro fit``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from pipeline.cli import completion
from pipeline.cli.help import Command
from pipeline.cli.options import Json
from pipeline.exit_codes import ExitCode, Fault
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
StressUnit = Literal["MPa", "kPa", "Pa", "psi"]


def fit(
    data: Annotated[
        list[Path],
        typer.Argument(
            metavar="CSV...", help="Columns stretch (or strain) and engineering stress; a file for each specimen."
        ),
    ],
    law: Annotated[
        str, typer.Option("--law", help="Law to fit.", callback=_known, autocompletion=completion.laws)
    ] = "all",
    terms: Annotated[int, typer.Option("--terms", help="Most terms of the Ogden law, 1 to 3.")] = 2,
    unit: Annotated[
        StressUnit | None, typer.Option("--unit", help="Unit of the stress, unless the header has it. Default: MPa.")
    ] = None,
    gauge_length: Annotated[
        float | None, typer.Option("--gauge-length", min=0.0, help="Of a column of extension, mm. Default: the file's.")
    ] = None,
    area: Annotated[
        float | None,
        typer.Option("--area", min=0.0, help="Initial cross section for a column of load, mm². Default: the file's."),
    ] = None,
    case: Annotated[
        Path | None,
        typer.Option("--case", help="Case whose strain limit is meant.", autocompletion=completion.cases),
    ] = None,
    strain_limit: Annotated[
        float | None,
        typer.Option(
            "--strain-limit",
            help="Strain up to which errors are stated; laws must be stable to twice it. Default: --case's or 0.14.",
        ),
    ] = None,
    up_to: Annotated[
        str | None,
        typer.Option(
            "--up-to",
            metavar="<stretch or strain %>",
            help="Fit up to this stretch (1.5), or strain in percent (50%). Default: twice the strain limit.",
        ),
    ] = None,
    whole: Annotated[bool, typer.Option("--whole", help="Fit the whole curve.")] = False,
    plot: Annotated[bool, typer.Option(help="Draw data and laws as PNG beside the CSV.")] = True,
    as_json: Json = False,
) -> None:
    """Fit material laws to uniaxial tension tests and print the section for a case file."""
    from pipeline.measured.fitting import fit_file, settings_of
    from pipeline.measured.specimens import Specimens

    if up_to is not None and whole:
        raise Fault(ExitCode.USAGE, "--up-to and --whole exclude each other; leave out one of them.")
    if case and strain_limit is not None:
        raise Fault(ExitCode.USAGE, "--case and --strain-limit exclude each other; leave out one of them.")
    options = {"law": law, "terms": terms, "strain_limit": strain_limit, "up_to": _stretch(up_to), "whole": whole}
    settings, specimen = settings_of(options, case), {"gauge_length": gauge_length, "area": area}
    reports = [fit_file(path, settings, unit, specimen, plot=plot) for path in data]
    report = reports[0] if len(reports) == 1 else Specimens.of(reports, settings)
    show(report.as_json() if as_json else report.as_text())
    if report.refusal:
        raise Fault(ExitCode.USAGE, report.refusal)


def _stretch(text: str | None) -> float | None:
    """A stretch, or the strain in percent that stands for it."""
    if text is None:
        return None
    number = text.strip().removesuffix("%")
    try:
        return 1.0 + float(number) / 100.0 if number != text.strip() else float(number)
    except ValueError:
        raise Fault(ExitCode.USAGE, f"--up-to: '{text}' is no stretch; write 1.5, or the strain 50%.") from None
