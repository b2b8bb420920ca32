"""Layers of a part: the figure of area against height, a slice in mm, and a slice as a printer's mask."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from PIL import Image

from actuator.geometry.printing.layers import Slice, Standing, mask

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stages.slices import Result

MILLIMETRES_PER_INCH = 25.4


def outlines_svg(cut: Slice, part: Standing, name: str) -> bytes:
    """A slice as SVG, true to scale, in the frame of the whole part; material is black by the even-odd rule."""
    low, high = part.low, part.high
    width, height = high - low
    # SVG's second axis points down.
    pieces = [" L ".join(f"{x:.6f},{-y:.6f}" for x, y in outline.tolist()) for outline in cut.outlines]
    path = " ".join(f"M {piece} Z" for piece in pieces)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.6f}mm" height="{height:.6f}mm" '
        f'viewBox="{low[0]:.6f} {-high[1]:.6f} {width:.6f} {height:.6f}">\n'
        f"<title>{escape(name)}, {cut.height:g} mm, {cut.area:.6f} mm²</title>\n"
        f'<path fill="black" fill-rule="evenodd" d="{path}"/>\n'
        "</svg>\n"
    ).encode()


def mask_png(cut: Slice, part: Standing, shape: tuple[int, int], pixel: float) -> bytes:
    """A slice as black and white PNG in the frame of the whole part; a pixel is white if its middle is material.

    Args:
        cut: the slice.
        part: what it is a slice of.
        shape: rows and columns.
        pixel: side of a pixel, mm; stored as the image's resolution.
    """
    stream = io.BytesIO()
    resolution = MILLIMETRES_PER_INCH / pixel
    white = mask(cut.outlines, part.low, shape, pixel)
    Image.fromarray(white).save(stream, format="PNG", dpi=(resolution, resolution), optimize=True)
    return stream.getvalue()


def layers(result: Result, title: str = "") -> Figure:
    """The area of the layers against their height; ``title`` stands above, such as the name of the part."""
    from matplotlib.figure import Figure  # slow to load, and not needed for single slices

    figure = Figure(figsize=(8.0, 4.2), dpi=110, layout="constrained")
    axes = figure.subplots()
    axes.plot(result.heights, result.areas, color="#1f4e79", drawstyle="steps-mid", linewidth=1.2)
    largest = int(result.areas.argmax())
    axes.plot(result.heights[largest], result.areas[largest], "o", color="#c55a11", label="largest area")
    axes.set(xlabel="height above the platform [mm]", ylabel="area of the layer [mm²]", xlim=(0.0, result.part.height))
    axes.set_ylim(bottom=0.0)
    axes.set_title(title)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure
