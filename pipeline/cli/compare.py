"""The command that takes a recorded test."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli.figure_format import FigureFormat


class Field(StrEnum):
    """Designs that are simulated."""

    DENSITY = "density"
    THRESHOLDED = "thresholded"


class Zero(StrEnum):
    """Where the zero of the signals is taken from."""

    REST = "rest"
    FIRST = "first"
    NONE = "none"


class Sensor(StrEnum):
    """What the displacement's signal does as the pressure rises."""

    AUTO = "auto"
    RISES = "rises"
    FALLS = "falls"


def compare(
    case: Annotated[Path, typer.Argument(metavar="CASE", help="Case file (.yaml), or the artifact of a stage (.h5).")],
    measured: Annotated[Path, typer.Argument(metavar="MEASURED", help="Recorded test (.csv).")],
    scale: Annotated[float | None, typer.Option("--scale", help="Size of the part over size of the domain.")] = None,
    youngs: Annotated[float | None, typer.Option("--youngs", help="Young's modulus of the print, N/mm².")] = None,
    field: Annotated[Field | None, typer.Option("--field", help="Simulated design. Default: density.")] = None,
    target: Annotated[
        float | None, typer.Option("--target", help="Pressure to compare at, kPa. Default: p_in of the part.")
    ] = None,
    pressure_column: Annotated[
        str | None, typer.Option("--pressure-column", help="Name of a column; with [unit] if the header has none.")
    ] = None,
    displacement_column: Annotated[
        str | None, typer.Option("--displacement-column", help="Name of a column, likewise.")
    ] = None,
    time_column: Annotated[str | None, typer.Option("--time-column", help="Name of a column, likewise.")] = None,
    pressure_sensitivity: Annotated[
        float | None, typer.Option("--pressure-sensitivity", help="Of a voltage, kPa/V. Default: 19.17.")
    ] = None,
    displacement_sensitivity: Annotated[
        float | None, typer.Option("--displacement-sensitivity", help="Of a voltage, mm/V. Default: 12.5.")
    ] = None,
    zero: Annotated[
        Zero | None, typer.Option("--zero", help="Zero of both: median at rest (default), of the first rows, or none.")
    ] = None,
    sensor: Annotated[
        Sensor | None, typer.Option("--sensor", help="What the displacement does as pressure rises. Default: auto.")
    ] = None,
    lag: Annotated[
        float | None, typer.Option("--lag", help="By which the displacement is recorded late, s. Default: 0.")
    ] = None,
    smoothing: Annotated[
        float | None, typer.Option("--smoothing", help="Half window of the curves over full scale. Default: 0.02.")
    ] = None,
    format: Annotated[FigureFormat, typer.Option("--format", help="Of the figure.")] = FigureFormat.PNG,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Folder of the results. Default: outputs/ if there is one, else here; beside an .h5."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Compare a recorded test of a printed part with its prediction."""
    from pipeline.measured.column_names import Quantity
    from pipeline.measured.comparison import compared
    from pipeline.measured.comparison_text import as_text
    from pipeline.measured.measurement import Sensors, read_measurement
    from pipeline.runs import perform as commands

    job = commands.open_job(case, output, scale=scale, youngs=youngs)
    columns = {
        Quantity.PRESSURE: pressure_column,
        Quantity.DISPLACEMENT: displacement_column,
        Quantity.TIME: time_column,
    }
    measurement = read_measurement(measured, columns, Sensors(pressure_sensitivity, displacement_sensitivity))
    options = {"target": target, "zero": zero, "sensor": sensor, "lag": lag, "smoothing": smoothing}
    found = compared(job, measurement, field, options)
    commands.make_folder(job.files.folder)
    found.write(format)
    typer.echo(found.as_json(format) if as_json else as_text(found, format))
