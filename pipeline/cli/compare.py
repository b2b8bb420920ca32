"""The command that takes a recorded test."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pipeline.cli.options import FigureFormat, Output, Settings, Source
from pipeline.terminal import show, told
from stages.chain import SCALE, youngs
from stages.words import PredictionName, Sensor, Zero

#: As the rig's sheet has it.
YOUNGS = youngs()


def compare(
    case: Source,
    measured: Annotated[
        list[Path], typer.Argument(metavar="MEASURED...", help="Recorded test (.csv), and repetitions of it.")
    ],
    scale: Annotated[float | None, typer.Option(SCALE.flag, help=SCALE.help)] = None,
    modulus: Annotated[str | None, typer.Option(YOUNGS.flag, help=YOUNGS.help)] = None,
    prediction: Annotated[
        PredictionName | None,
        typer.Option("--prediction", help="Curve to compare with. Default: as printed if it is there, else density."),
    ] = None,
    target: Annotated[
        float | None, typer.Option("--target", help="Pressure to compare at, kPa. Default: p_in of the part.")
    ] = None,
    pressure_column: Annotated[
        str | None, typer.Option("--pressure-column", help="Name of a column; with [unit] if the header has none.")
    ] = None,
    displacement_column: Annotated[
        str | None, typer.Option("--displacement-column", help="Name of a column, likewise.")
    ] = None,
    angle_column: Annotated[str | None, typer.Option("--angle-column", help="Name of a column, likewise.")] = None,
    force_column: Annotated[str | None, typer.Option("--force-column", help="Name of a column, likewise.")] = None,
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
    pressure_sensor: Annotated[
        Sensor | None, typer.Option("--pressure-sensor", help="What its signal does as pressure rises. Default: auto.")
    ] = None,
    lag: Annotated[
        float | None, typer.Option("--lag", help="By which the displacement is recorded late, s. Default: 0.")
    ] = None,
    smoothing: Annotated[
        float | None, typer.Option("--smoothing", help="Half window of the curves over full scale. Default: 0.02.")
    ] = None,
    format: Annotated[FigureFormat, typer.Option("--format", help="Of the figure.")] = "png",
    settings: Settings = None,
    output: Output = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Compare recorded tests of a printed part with its prediction."""
    from pipeline.measured.column_names import Quantity
    from pipeline.measured.comparison import compared
    from pipeline.measured.comparison_text import as_text
    from pipeline.measured.measurement import read_measurement
    from pipeline.runs import perform as commands
    from pipeline.runs.rig_sheet import as_told

    job = as_told(commands.open_job(case, output, {SCALE: scale, YOUNGS: modulus}, settings=settings or ()))
    columns = {
        Quantity.PRESSURE: pressure_column,
        Quantity.DISPLACEMENT: displacement_column,
        Quantity.ANGLE: angle_column,
        Quantity.FORCE: force_column,
        Quantity.TIME: time_column,
    }
    sensitivities = {Quantity.PRESSURE: pressure_sensitivity, Quantity.DISPLACEMENT: displacement_sensitivity}
    measurements = [read_measurement(path, columns, sensitivities) for path in measured]
    options = {"target": target, "zero": zero, "sensor": sensor, "lag": lag, "smoothing": smoothing}
    found = compared(job, measurements, prediction, options | {"pressure_sensor": pressure_sensor})
    commands.make_folder(job.files.details)
    found.write(format)
    show(found.as_json(format) if as_json else told(as_text(found, format), found.files(format)))
