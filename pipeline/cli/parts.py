"""The commands that take solids of any origin: ``poro check`` and ``poro slice``."""

from __future__ import annotations

from typing import Annotated

import typer

from actuator.geometry.printing.directions import Axis, Direction
from pipeline.cli.options import FigureFormat, Json, OfUnit, Part
from pipeline.terminal import note, show, told


def check(
    part: Part,
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
    unit: OfUnit = None,
    save: Annotated[bool, typer.Option(help="Store the report as PART.check.json in details/.")] = True,
    as_json: Json = False,
) -> None:
    """Tell whether a solid can be printed in silicone and inflated."""
    from pipeline.parts.checking import examine

    options = {"direction": direction, "on_platform": flat, "axis": axis, "wall": wall, "gap": gap, "angle": angle}
    report = examine(part, options | {"drain": drain, "density": density, "pitch": pitch}, unit)
    files = [report.path] if save else []
    show(report.as_json(stored=save) if as_json else told(report.as_text(), files))
    if save:
        report.write()
    report.refuse()


def slice_part(
    part: Part,
    layer: Annotated[float, typer.Option("--layer", help="Thickness of a layer, mm.")] = 0.1,
    direction: Annotated[Direction, typer.Option("--direction", help="Build direction, from the platform up.")] = "z",
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
    unit: OfUnit = None,
    as_json: Json = False,
) -> None:
    """Show the layers of a solid as a printer will see them: area against height, or single slices."""
    from pipeline.parts import slicing

    sliced = slicing.sliced(part, layer, direction, note, unit)
    if numbers or heights:
        slices = sliced.draw(numbers or [], heights or [], format or "svg", pixel)
        show(
            slicing.as_json(slices) if as_json else told(slicing.slices_text(slices), [each["file"] for each in slices])
        )
    else:
        overview = sliced.overview(format or "png")
        show(slicing.as_json(overview) if as_json else told(slicing.overview_text(overview), overview["files"]))


def register(app: typer.Typer) -> None:
    """Add the commands to the program."""
    app.command()(check)
    app.command("slice")(slice_part)
