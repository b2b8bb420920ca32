"""The commands that show what the artifacts of a case hold: ``poro plot``, ``poro report`` and ``poro convert``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from pipeline.cli import completion
from pipeline.cli.options import FigureFormat, Json, Output, Source, SourceOrSolid
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store.files import located
from pipeline.terminal import show, told
from stages.chain import SCALE, youngs

YOUNGS = youngs()
#: Fields that colour a shape.
Colour = Literal["pressure", "density"]
#: What a film shows, and its formats.
FilmOf = Literal["updates", "simulation", "inflation"]
FilmFormat = Literal["gif", "mp4"]


def plot(
    case: Source,
    format: Annotated[
        FigureFormat, typer.Option("--format", help="Of the figures; solids are pixels in all of them.")
    ] = "png",
    only: Annotated[
        list[str] | None, typer.Option("--only", help="Draw this figure, such as section; may be repeated.")
    ] = None,
    output: Output = None,
    as_json: Json = False,
) -> None:
    """Draw an optimised design: initial design, views, arm, section, history (also as CSV), simulated response.

    Of an optimisation that runs or was interrupted, the state that is stored is drawn.
    """
    from pipeline.runs import perform as commands

    job, folder = commands.open_shown(case, output, under_way=True)
    show(commands.plot(job, folder or job.files.details, format, only or [], as_json=as_json))


def report(
    case: Source,
    check: Annotated[bool, typer.Option(help="Make the checks of `poro check` where none are stored.")] = True,
    scale: Annotated[float | None, typer.Option(SCALE.flag, help=f"{SCALE.help} Default: of the last sheet.")] = None,
    modulus: Annotated[str | None, typer.Option(YOUNGS.flag, help=f"{YOUNGS.help} Default: likewise.")] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Folder of the report. Default: outputs/ if there is one, else here; beside an .h5."
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Write everything there is about an optimised case into one HTML file.

    Of an optimisation that runs or was interrupted, the state that is stored is reported.
    """
    from pipeline.report.page import write_report  # loads drawing libraries
    from pipeline.results.json_output import result_json
    from pipeline.runs import perform as commands
    from pipeline.runs.rig_sheet import as_told

    job, folder = commands.open_shown(case, output, {SCALE: scale, YOUNGS: modulus}, under_way=True)
    job, folder = as_told(job), folder or job.files.folder
    commands.make_folder(folder)
    path, label, problems = write_report(job, folder, check=check)
    if as_json:
        show(result_json("report", {"name": job.case.name, "unfinished": label, "problems": problems}, [path]))
    else:
        show(told("\n".join([str(path), *filter(None, [label]), *problems]), [path]))


def film(
    case: SourceOrSolid,
    of: Annotated[
        FilmOf | None,
        typer.Option("--of", help="What it shows. Default: what the artifact holds, of a part its inflation."),
    ] = None,
    format: Annotated[FilmFormat, typer.Option("--format", help="Of the film; mp4 needs imageio-ffmpeg.")] = "gif",
    rate: Annotated[float, typer.Option("--fps", min=1.0, max=50.0, help="Frames a second.")] = 10.0,
    size: Annotated[int, typer.Option("--size", min=300, max=3840, help="Width of the frames, pixels.")] = 800,
    output: Output = None,
    as_json: Json = False,
) -> None:
    """Make a film: how the design grew from update to update, or how it moves as the pressure rises."""
    from pipeline.runs.films import film as make_film  # loads drawing libraries

    show(make_film(case, of, output, format, rate, size, as_json=as_json))


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="ARTIFACT",
            help="Artifact of a stage (.h5), checkpoint, or case file (.yaml).",
            autocompletion=completion.cases,
            callback=located,
        ),
    ],
    target: Annotated[Path, typer.Argument(metavar="FILE", help="File to write; its ending decides the format.")],
    colour: Annotated[
        Colour | None, typer.Option("--colour", help="Write the printed shape with this field as colour: .glb or .ply.")
    ] = None,
    deformed: Annotated[bool, typer.Option("--deformed", help="With --colour: under pressure.")] = False,
    as_json: Json = False,
) -> None:
    """Write mesh and fields of an artifact in another format, such as .vtu, or its shape in colour.

    Of a case it is the optimised design; if its optimisation runs or was interrupted, the state that is stored.
    """
    from pipeline.runs.under_way import artifact_of

    source = artifact_of(source)
    if colour:
        from pipeline.figures.colouring import colour as write_coloured

        label = write_coloured(source, target, colour, deformed)
    elif deformed:
        raise Fault(ExitCode.USAGE, "--deformed goes with --colour; add --colour pressure.")
    else:
        from pipeline.results.conversion import convert as convert_artifact

        label = convert_artifact(source, target)
    if as_json:
        from pipeline.results.json_output import result_json

        show(result_json("convert", {"source": str(source), "unfinished": label}, [target]))
    elif label:
        show(f"{target}: {label}")


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    for command in (plot, film, report, convert):
        app.command()(command)
