"""``poro slice``: the layers of a part as a table and a plot, or single slices as drawings and masks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from actuator.arrays import Floats
from actuator.failure import Failure, GridTooLarge, NotManifold
from pipeline.exit_codes import ExitCode, Fault, option_settings
from pipeline.results.json_output import result_json
from pipeline.store.atomic import write_bytes
from pipeline.store.files import detail_of, make_folder
from pipeline.store.solid_file import read_solid
from pipeline.store.tables import as_csv
from stages import slices
from stages.events import Message
from stages.words import Unit

#: Most pixels of a mask; more is a slip in a unit.
MOST_PIXELS = 50_000_000


@dataclass(frozen=True)
class Sliced:
    """A part and its layers.

    Attributes:
        part: the file.
        settings: thickness and direction.
        result: all layers.
    """

    part: Path
    settings: slices.Settings
    result: slices.Result

    def overview(self, format: str) -> dict[str, Any]:
        """Figures of all layers; writes the table ``PART.areas.csv`` and the plot ``PART.areas.FORMAT``.

        Raises:
            OSError: if the folder or the disk does not take a file.
        """
        # Load a drawing library.
        from pipeline.figures.layers import layers
        from pipeline.figures.saving import save

        result = self.result
        table, plot = (detail_of(self.part, f"{self.part.stem}.areas.{ending}") for ending in ("csv", format))
        columns = zip(result.heights.tolist(), result.areas.tolist(), result.outlines.tolist(), strict=True)
        rows = ((row, f"{height:.6g}", f"{area:.9g}", count) for row, (height, area, count) in enumerate(columns, 1))
        make_folder(table.parent)
        write_bytes(table, as_csv(("layer", "height_mm", "area_mm2", "outlines"), rows).encode())
        save(layers(result, self.part.name), plot)
        largest = int(result.areas.argmax())
        return {
            "part": str(self.part),
            "direction": self.settings.direction,
            "thickness_mm": self.settings.thickness,
            "layers": len(result.heights),
            "height_mm": result.part.height,
            "largest_area_mm2": float(result.areas[largest]),
            "largest_layer": largest + 1,
            "mean_area_mm2": float(result.areas.mean()),
            "largest_jump_mm2": result.largest_jump,
            "jump_layer": result.jump + 1,
            "most_outlines": int(result.outlines.max()),
            "volume_by_layers_mm3": result.layered_volume,
            "volume_mm3": result.volume,
            "merged_within_mm": result.within,
            "files": [str(table), str(plot)],
        }

    def draw(self, numbers: list[int], heights: list[float], format: str, pixel: float) -> list[dict[str, Any]]:
        """Figures of single slices; writes each as ``PART.layer-NUMBER.FORMAT`` or ``PART.height-HEIGHT.FORMAT``.

        Args:
            numbers: layers to draw, the lowest is 1.
            heights: above the lowest point, mm, to draw as well.
            format: ``svg``, in mm, or ``png``, a mask.
            pixel: side of a pixel of a mask, mm.

        Raises:
            Fault: if a number, a height or the size of a mask is out of range, or the format another one (USAGE).
            OSError: if the folder or the disk does not take a file.
        """
        from pipeline.figures.layers import mask_png, outlines_svg  # loads a drawing library

        if format not in ("svg", "png"):
            sentence = f"--format {format} is for the plot of all layers; a slice is svg, in mm, or png, a mask."
            raise Fault(ExitCode.USAGE, sentence)
        part = self.result.part
        wanted = [*map(self._layer, numbers), *map(self._height, heights)]
        shape = _shape(part.high - part.low, pixel) if format == "png" else (0, 0)
        found = []
        for name, height in wanted:
            cut = part.cut(height)
            path = detail_of(self.part, f"{self.part.stem}.{name}.{format}")
            data = mask_png(cut, part, shape, pixel) if format == "png" else outlines_svg(cut, part, self.part.stem)
            make_folder(path.parent)
            write_bytes(path, data)
            figures = {"height_mm": height, "area_mm2": cut.area, "outlines": len(cut.outlines)}
            found.append({"name": name} | figures | {"file": str(path)})
        return found

    def _layer(self, number: int) -> tuple[str, float]:
        count = len(self.result.heights)
        if not 1 <= number <= count:
            raise Fault(ExitCode.USAGE, f"--number {number}: the part has layers 1 to {count}; choose one of them.")
        return f"layer-{number}", float(self.result.heights[number - 1])

    def _height(self, height: float) -> tuple[str, float]:
        top = self.result.part.height
        if not 0.0 <= height < top:
            sentence = f"--height {height:g}: the part is {top:.6g} mm high; choose a height from 0 to below that."
            raise Fault(ExitCode.USAGE, sentence)
        return f"height-{height:g}", height


def _shape(size: Floats, pixel: float) -> tuple[int, int]:
    """Rows and columns of a mask of a size (2,), mm."""
    if not pixel > 0.0 or (size / pixel + 1.0).prod() > MOST_PIXELS:
        sentence = f"--pixel {pixel:g}: must be above 0 mm, with at most {MOST_PIXELS} pixels; choose another size."
        raise Fault(ExitCode.USAGE, sentence)
    # The rounding of a file's coordinates must not add a row to a part of whole pixels.
    columns, rows = np.ceil(size / pixel - 1.0e-3).astype(int).clip(min=1).tolist()
    return rows, columns


def sliced(
    part: Path, thickness: float, direction: str, say: Callable[[str], None], unit: Unit | None = None
) -> Sliced:
    """Read a part and cut it into layers.

    Args:
        part: STL or 3MF; its ending says which.
        thickness: of a layer, mm.
        direction: from the platform to the part, ``x``, ``-x`` and so on.
        say: is told if vertices had to be merged that are not equal.
        unit: of a file that does not say its own.

    Raises:
        Fault: if an option is out of range or the ending unknown (USAGE), the file is missing or unreadable
            (ARTIFACT), its unit is doubtful, or its triangles bound no solid (BAD_SOLID).
    """
    settings = option_settings(slices.Settings, {"thickness": thickness, "direction": direction}, "--layer")
    solid = read_solid(part, unit)
    try:
        result = slices.run(
            solid.vertices,
            solid.triangles,
            settings,
            lambda event: say(event.text) if isinstance(event, Message) else None,
        )
    except GridTooLarge as failure:
        raise Fault(ExitCode.USAGE, f"--layer {thickness:g}: {failure}") from None
    except Failure as failure:
        code = ExitCode.BAD_SOLID if isinstance(failure, NotManifold) else ExitCode.ARTIFACT
        raise Fault(code, f"{part}: {failure}") from None
    if not len(result.heights):
        sentence = f"--layer {thickness:g}: the part is only {result.part.height:.3g} mm high; choose thinner layers."
        raise Fault(ExitCode.USAGE, sentence)
    return Sliced(part, settings, result)


def overview_text(found: dict[str, Any]) -> str:
    """The figures of all layers for people."""
    off = 100.0 * (found["volume_by_layers_mm3"] / found["volume_mm3"] - 1.0)
    lines = {
        "height": f"{found['height_mm']:.3f} mm",
        "largest area": f"{found['largest_area_mm2']:.2f} mm^2, layer {found['largest_layer']}",
        "mean area": f"{found['mean_area_mm2']:.2f} mm^2",
        "largest jump": f"{found['largest_jump_mm2']:.2f} mm^2, after layer {found['jump_layer']}",
        "closed outlines": f"at most {found['most_outlines']} in a layer",
        "volume": f"{found['volume_by_layers_mm3']:.2f} mm^3 by layers, {found['volume_mm3']:.2f} mm^3 by triangles "
        f"({off:+.3f} %)",
    }
    head = f"{found['part']}: {found['layers']} layers of {found['thickness_mm']:g} mm along {found['direction']}"
    rows = [f"  {name:<20}{text}" for name, text in lines.items()]
    files = [f"  {'files' if file == found['files'][0] else '':<20}{file}" for file in found["files"]]
    return "\n".join([head, *rows, *files])


def slices_text(found: list[dict[str, Any]]) -> str:
    """The figures of single slices for people, one a line."""
    return "\n".join(
        f"{entry['file']}: {entry['area_mm2']:.3f} mm^2 at {entry['height_mm']:.4g} mm, {entry['outlines']} outlines"
        for entry in found
    )


def as_json(found: dict[str, Any] | list[dict[str, Any]]) -> str:
    """The figures for programs."""
    if isinstance(found, list):
        return result_json("slice", {"slices": found}, [entry["file"] for entry in found])
    return result_json("slice", found, found["files"])
