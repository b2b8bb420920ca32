"""The command that reports on a case."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case file (.yaml), or the artifact of a stage (.h5).")],
    check: Annotated[bool, typer.Option(help="Make the checks of `poro check` where none are stored.")] = True,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Folder of the report. Default: outputs/ if there is one, else here; beside an .h5."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print a summary as JSON.")] = False,
) -> None:
    """Write everything there is about an optimised case into one HTML file."""
    from pipeline.report.page import write_report  # loads drawing libraries
    from pipeline.results.json_output import result_json
    from pipeline.runs import perform as commands

    # What belongs to an artifact lies beside it, wherever the report goes.
    job = commands.open_job(case, None if case.suffix == ".h5" else output)
    folder = output or job.files.folder
    commands.make_folder(folder)
    path, problems = write_report(job, folder, check=check)
    if as_json:
        typer.echo(result_json("report", {"name": job.case.name, "problems": problems}, [path]))
    else:
        typer.echo("\n".join([str(path), *problems]))
