"""A figure as the bytes of a file: PNG with few colours, SVG or PDF; the same figure gives the same bytes."""

from __future__ import annotations

import io
import logging
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image, ImageDraw
from PIL.ImageFont import load_default

from pipeline.store import atomic

# Fonts that matplotlib looks for and that no figure uses are nothing to tell a user about.
logging.getLogger("matplotlib.font_manager").setLevel(logging.ERROR)

#: What a figure is: matplotlib's, or the pixels that VTK drew.
Drawn = Figure | Image.Image

#: What the formats that hold lines as such call the date, and the pixels of the rest in them, dots per inch.
DATES, PIXELS = {"svg": "Date", "pdf": "CreationDate"}, 150
WHITE, RED = (255, 255, 255), (192, 0, 0)


def save(figure: Drawn, path: Path) -> None:
    """Write a figure; the ending of the path, ``.png``, ``.svg`` or ``.pdf``, decides the format.

    Raises:
        OSError: if the folder or the disk does not take it.
    """
    atomic.write_bytes(path, encoded(figure, path.suffix[1:], path.stem))


def labelled(figure: Drawn, label: str) -> Drawn:
    """A figure with a line of text in its lower left corner, if there is one to write."""
    if not label:
        return figure
    if isinstance(figure, Image.Image):
        size = figure.height // 30
        ImageDraw.Draw(figure).text((size // 2, figure.height - size // 2), label, RED, load_default(size), "ls")
    else:
        figure.text(0.005, 0.01, label, color=np.divide(RED, 255), ha="left", va="bottom", weight="bold")
    return figure


def encoded(figure: Drawn, format: str, name: str) -> bytes:
    """A figure as the bytes of a file.

    Args:
        figure: pixels become PNG whatever the format.
        format: ``png``, ``svg`` or ``pdf``.
        name: of the figure; it tells the parts of an SVG from those of another one on the same page.
    """
    if isinstance(figure, Image.Image):
        return _with_fewer_colours(figure)
    for text in figure.findobj(Text):
        # Names of files may hold bytes that are no UTF-8, which no font can draw.
        text.set_text(atomic.encoded(text.get_text()).decode())
    written = io.BytesIO()
    # Without a date and with names that are not drawn by lot, the same figure gives the same bytes.
    with rc_context({"svg.hashsalt": atomic.encoded(name).decode()}):
        if date := DATES.get(format):
            figure.savefig(written, format=format, metadata={date: None}, dpi=PIXELS)
            return written.getvalue()
        figure.savefig(written, format=format)
    with Image.open(written, formats=["PNG"]) as drawn:
        return _with_fewer_colours(drawn)


def _with_fewer_colours(drawn: Image.Image) -> bytes:
    """A PNG with 256 colours, mixed by dots where these do not suffice: bands would look like contours."""
    full = drawn.convert("RGB")
    # The palette takes rare colours as seriously as frequent ones, or the ends of a colour bar would fade.
    found = full.quantize(255, method=Image.Quantize.MAXCOVERAGE).getpalette() or []
    palette = Image.new("P", (1, 1))
    palette.putpalette([*found, *WHITE])
    mixed = full.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
    # The paper stays white, for which the nearest colour found is not always taken.
    paper = Image.fromarray((np.asarray(full) == WHITE).all(axis=2))
    mixed.paste(len(found) // 3, mask=paper)
    small = io.BytesIO()
    mixed.save(small, format="PNG", optimize=True)
    return small.getvalue()
