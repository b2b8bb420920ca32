"""The command ``poro``: it parses, calls, and turns every end into a sentence and an exit code.

Heavy modules are imported inside the commands, so that ``poro --help`` is immediate.
"""

from __future__ import annotations

import sys
import tempfile
import traceback
from enum import StrEnum
from io import TextIOWrapper
from pathlib import Path
from typing import Annotated, Any

import typer

from pipeline.cli import compare as cli_measured
from pipeline.cli import completion
from pipeline.cli import fit as cli_fit
from pipeline.cli import report as cli_report
from pipeline.cli import study as cli_study
from pipeline.cli.figure_format import FigureFormat
from pipeline.exit_codes import ExitCode, Fault, unexpected
from pipeline.runs.interruption import heeded
from pipeline.store.stage_names import STAGES, Stage

_CODES = ", ".join(f"{code.value} {code.meaning}" for code in ExitCode)

app = typer.Typer(
    name="poro",
    epilog=f"Exit codes: {_CODES}.",
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


class Format(StrEnum):
    """Formats of the exported part."""

    STL = "stl"
    THREE_MF = "3mf"


Source = Annotated[
    Path,
    typer.Argument(
        metavar="CASE", help="Case file (.yaml), or the artifact of a stage (.h5).", autocompletion=completion.cases
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output", "-o", help="Folder of the results. Default: outputs/ if there is one, else here; beside an .h5."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print a summary as JSON.")]
Force = Annotated[bool, typer.Option("--force", help="Run even what is up to date.")]
Threads = Annotated[int | None, typer.Option("--threads", help="Threads; 0 for one per core.")]
Updates = Annotated[
    int | None, typer.Option("--updates", help="Most design updates; 0 evaluates the initial design only.")
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Ignore what an interrupted optimisation left.")]


@app.command()
def optimize(
    case: Source,
    updates: Updates = None,
    threads: Threads = None,
    output: Output = None,
    force: Force = False,
    fresh: Fresh = False,
    as_json: Json = False,
) -> None:
    """Optimise the design of a case."""
    _until("optimize", case, output, force, as_json, fresh=fresh, updates=updates, threads=threads)


@app.command()
def refine(case: Source, output: Output = None, force: Force = False, as_json: Json = False) -> None:
    """Put the design on a finer mesh and filter it."""
    _until("refine", case, output, force, as_json)


@app.command()
def mirror(case: Source, output: Output = None, force: Force = False, as_json: Json = False) -> None:
    """Extract the closed surface of the whole solid."""
    _until("mirror", case, output, force, as_json)


@app.command()
def export(
    case: Source,
    scale: Annotated[float | None, typer.Option("--scale", help="Size of the part over size of the domain.")] = None,
    format: Annotated[Format | None, typer.Option("--format", help="File format.")] = None,
    youngs: Annotated[
        float | None, typer.Option("--youngs", help="Young's modulus of the print, N/mm²: also writes the rig's sheet.")
    ] = None,
    output: Output = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Scale, prove and write the part as STL or 3MF, and draw it."""
    _until("export", case, output, force, as_json, scale=scale, format=format, youngs=youngs)


@app.command()
def run(
    case: Source,
    first: Annotated[Stage | None, typer.Option("--from", help="Take the stages before this one as they are.")] = None,
    last: Annotated[Stage, typer.Option("--until", help="Stop after this stage.")] = Stage.EXPORT,
    updates: Updates = None,
    threads: Threads = None,
    output: Output = None,
    force: Force = False,
    fresh: Fresh = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would run.")] = False,
    explain: Annotated[bool, typer.Option("--explain", help="Say for every stage why it runs or not.")] = False,
    as_json: Json = False,
) -> None:
    """Run all stages that are missing or stale."""
    from pipeline.runs import perform as commands

    job = commands.open_job(case, output, updates=updates, threads=threads)
    steps = commands.plan(job, first=first, last=last, forced=(first or STAGES[0]) if force else None)
    if dry_run:
        typer.echo(commands.steps_json(steps, "run") if as_json else commands.steps_text(steps, reasons=explain))
        return
    if explain:
        typer.echo(commands.steps_text(steps, reasons=True), err=True)
    typer.echo(commands.perform(job, steps, command="run", fresh=fresh, as_json=as_json))


@app.command()
def status(case: Source, output: Output = None, as_json: Json = False) -> None:
    """Say which stages are up to date, and why others are not."""
    from pipeline.runs import perform as commands

    steps = commands.status(commands.open_job(case, output))
    typer.echo(commands.steps_json(steps, "status") if as_json else commands.steps_text(steps, reasons=True))


@app.command()
def simulate(
    case: Source,
    max_load: Annotated[float | None, typer.Option("--max-load", help="Largest pressure over p_in.")] = None,
    youngs: Annotated[
        float | None, typer.Option("--youngs", help="Young's modulus of the print, N/mm²: curves in the rig's units.")
    ] = None,
    scale: Annotated[float | None, typer.Option("--scale", help="Size of the part over size of the domain.")] = None,
    threads: Threads = None,
    output: Output = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Follow the response from zero pressure to beyond p_in and back."""
    from pipeline.runs import perform as commands
    from pipeline.runs import simulating

    job = commands.open_job(case, output, max_load=max_load, youngs=youngs, scale=scale, threads=threads)
    steps = simulating.plan(job, forced=force)
    typer.echo(commands.perform(job, steps, command="simulate", fresh=False, as_json=as_json))
    simulating.refuse_unfinished(job)


@app.command()
def plot(
    case: Source,
    format: Annotated[
        FigureFormat, typer.Option("--format", help="Of what matplotlib draws; views are PNG.")
    ] = FigureFormat.PNG,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="Draw this figure, such as section; may be repeated.")
    ] = None,
    output: Output = None,
    as_json: Json = False,
) -> None:
    """Draw an optimised design: initial design, views, arm, section, history (also as CSV), simulated response."""
    from pipeline.runs import perform as commands

    typer.echo(commands.plot(commands.open_job(case, output), format, only or [], as_json=as_json))


class Direction(StrEnum):
    """Build directions, from the platform to the part."""

    X = "x"
    Y = "y"
    Z = "z"
    MINUS_X = "-x"
    MINUS_Y = "-y"
    MINUS_Z = "-z"


class Axis(StrEnum):
    """Axes of an actuator."""

    X = "x"
    Y = "y"
    Z = "z"


@app.command()
def check(
    part: Annotated[Path, typer.Argument(metavar="PART", help="Solid to print (.stl, .3mf), from any program.")],
    direction: Annotated[
        Direction | None, typer.Option("--direction", help="Build direction, from the platform up. Default: z.")
    ] = None,
    flat: Annotated[bool, typer.Option("--flat", help="Printed flat on the platform, not on supports.")] = False,
    axis: Annotated[
        Axis | None, typer.Option("--axis", help="Axis between the end faces that plates are glued on. Default: x.")
    ] = None,
    wall: Annotated[float | None, typer.Option("--wall", help="Least wall, mm. Default: 0.4.")] = None,
    gap: Annotated[float | None, typer.Option("--gap", help="Least gap, mm. Default: 0.5.")] = None,
    angle: Annotated[
        float | None, typer.Option("--angle", help="Least self-supporting angle from level, degrees. Default: 19.")
    ] = None,
    drain: Annotated[float | None, typer.Option("--drain", help="Least drain hole, mm. Default: 3.5.")] = None,
    density: Annotated[
        float | None, typer.Option("--density", help="Density of the cured resin, g/cm³. Default: 1.1.")
    ] = None,
    pitch: Annotated[float | None, typer.Option("--pitch", help="Pitch of the voxels, mm. Default: 0.2.")] = None,
    save: Annotated[bool, typer.Option(help="Write PART.check.json beside the part.")] = True,
    as_json: Json = False,
) -> None:
    """Tell whether a solid can be printed in silicone and inflated."""
    from pipeline.parts.checking import examine

    options = {"direction": direction, "on_platform": flat, "axis": axis, "wall": wall, "gap": gap, "angle": angle}
    report = examine(part, options | {"drain": drain, "density": density, "pitch": pitch})
    typer.echo(report.as_json(stored=save) if as_json else report.as_text())
    if save:
        report.write()
    report.refuse()


@app.command("slice")
def slice_part(
    part: Annotated[Path, typer.Argument(metavar="PART", help="Solid to print (.stl, .3mf), from any program.")],
    layer: Annotated[float, typer.Option("--layer", help="Thickness of a layer, mm.")] = 0.1,
    direction: Annotated[
        Direction, typer.Option("--direction", help="Build direction, from the platform up.")
    ] = Direction.Z,
    numbers: Annotated[
        list[int] | None, typer.Option("--number", help="Write this layer, the lowest is 1; may be repeated.")
    ] = None,
    heights: Annotated[
        list[float] | None, typer.Option("--height", help="Write the slice at this height, mm; may be repeated.")
    ] = None,
    format: Annotated[
        FigureFormat | None, typer.Option("--format", help="Default: svg for slices, png for the plot of all layers.")
    ] = None,
    pixel: Annotated[float, typer.Option("--pixel", help="Side of a pixel of a slice as PNG, mm.")] = 0.05,
    as_json: Json = False,
) -> None:
    """Show the layers of a solid as a printer will see them: area against height, or single slices."""
    from pipeline.parts import slicing

    sliced = slicing.sliced(part, layer, direction.value, lambda text: typer.echo(text, err=True))
    if numbers or heights:
        slices = sliced.draw(numbers or [], heights or [], (format or FigureFormat.SVG).value, pixel)
        typer.echo(slicing.as_json(slices) if as_json else slicing.slices_text(slices))
    else:
        overview = sliced.overview((format or FigureFormat.PNG).value)
        typer.echo(slicing.as_json(overview) if as_json else slicing.overview_text(overview))


class Colour(StrEnum):
    """Fields that colour a shape."""

    PRESSURE = "pressure"
    DENSITY = "density"


@app.command()
def convert(
    source: Annotated[
        Path,
        typer.Argument(metavar="ARTIFACT", help="Artifact of a stage (.h5).", autocompletion=completion.artifacts),
    ],
    target: Annotated[Path, typer.Argument(metavar="FILE", help="File to write; its ending decides the format.")],
    colour: Annotated[
        Colour | None, typer.Option("--colour", help="Write the printed shape with this field as colour: .glb or .ply.")
    ] = None,
    deformed: Annotated[bool, typer.Option("--deformed", help="With --colour: under pressure.")] = False,
    as_json: Json = False,
) -> None:
    """Write mesh and fields of an artifact in another format, such as .vtu, or its shape in colour."""
    if colour:
        from pipeline.figures.colouring import colour as write_coloured

        write_coloured(source, target, colour, deformed)
    elif deformed:
        raise Fault(ExitCode.USAGE, "--deformed goes with --colour; add --colour pressure.")
    else:
        from pipeline.results.conversion import convert as convert_artifact

        convert_artifact(source, target)
    if as_json:
        from pipeline.results.json_output import result_json

        typer.echo(result_json("convert", {"source": str(source)}, [target]))


app.command()(cli_fit.fit)
app.command()(cli_report.report)
app.command()(cli_measured.compare)


@app.command()
def schema() -> None:
    """Print the JSON Schema of the case file."""
    from pipeline.case.model import case_schema

    typer.echo(case_schema())


cli_study.register(app)


def _until(
    stage: str, source: Path, output: Path | None, force: bool, as_json: bool, *, fresh: bool = False, **changes: Any
) -> None:
    """Run one stage, and those before it that are missing or stale."""
    from pipeline.runs import perform as commands

    job = commands.open_job(source, output, **changes)
    steps = commands.plan(job, last=stage, forced=stage if force else None)
    typer.echo(commands.perform(job, steps, command=stage, fresh=fresh, as_json=as_json))


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"poro {version('poro')}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version.", callback=_show_version, is_eager=True)
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
    try:
        with heeded():
            ended = app(arguments or ["--help"], prog_name="poro", standalone_mode=False)
    except Fault as fault:
        return _end(fault.code, str(fault))
    except typer.TyperException as error:
        return _end(ExitCode.USAGE, f"{error.format_message()} See `poro --help`.")
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
        return _end(ExitCode.UNEXPECTED, str(unexpected(error, log.name)))
    if ended == ExitCode.INTERRUPTED:  # what typer makes of a KeyboardInterrupt
        return _end(ExitCode.INTERRUPTED, "Interrupted; run the same command again.")
    return ExitCode.OK


def _end(code: ExitCode, sentence: str) -> ExitCode:
    typer.echo(f"poro: {sentence}", err=True)
    return code
