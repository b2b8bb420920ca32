"""A film as a file: GIF by Pillow, which is always there, or MP4 by ffmpeg, where its package is installed."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image

from pipeline.exit_codes import ExitCode, Fault
from pipeline.figures.offscreen import Pixels
from pipeline.store.atomic import replacing

FilmFormat = Literal["gif", "mp4"]
#: How long the last frame is held, s.
HELD = 1.0
#: Frames that the palette of a GIF is found from.
SAMPLED = 6
#: Colours of it that are kept, and steps of red, green and blue that count as one among those that are rare.
PAPER, INK, STEP = (255, 255, 255), (0, 0, 0), 16


def refuse_without_encoder(format: FilmFormat) -> None:
    """Refuse MP4 where its encoder is not installed.

    Raises:
        Fault: with the remedy (USAGE).
    """
    if format == "mp4" and not find_spec("imageio_ffmpeg"):
        remedy = "install it with `pip install imageio-ffmpeg`, or leave --format mp4 out for a GIF"
        raise Fault(ExitCode.USAGE, f"--format mp4: the package imageio-ffmpeg, which makes MP4, is missing; {remedy}.")


def write_film(frames: Iterable[Image.Image], target: Path, format: FilmFormat, rate: float) -> int:
    """Write a film, whole or not at all; returns the number of frames.

    Args:
        frames: of one size, in order.
        target: the file.
        format: ``gif`` or ``mp4``.
        rate: frames a second.

    Raises:
        OSError: if the folder or the disk does not take it.
    """
    with replacing(target) as temporary:
        return (_write_gif if format == "gif" else _write_mp4)(frames, temporary, rate)


def _write_gif(frames: Iterable[Image.Image], path: Path, rate: float) -> int:
    """With one palette for all frames and no dots between its colours: both would flicker, and not compress."""
    found = list(frames)
    sample = np.concatenate([np.asarray(frame) for frame in found[:: -(-len(found) // SAMPLED)] + found[-1:]])
    palette = _palette(sample.reshape(-1, 3))
    few = [_in_colours(frame, palette) for frame in found]
    times = [round(1000.0 / rate)] * (len(few) - 1) + [round(1000.0 * HELD)]
    few[0].save(path, "GIF", save_all=True, append_images=few[1:], duration=times, loop=0, optimize=False)
    return len(few)


def _in_colours(frame: Image.Image, palette: Image.Image) -> Image.Image:
    """A frame in the colours of a palette, white where it is white: Pillow takes what is near enough."""
    few = frame.quantize(palette=palette, dither=Image.Dither.NONE)
    few.paste(0, mask=Image.fromarray((np.asarray(frame) == PAPER).all(axis=2)))
    return few


def _palette(pixels: Pixels) -> Image.Image:
    """256 colours for pixels, (n, 3): half for what is large, half for what is rare, as the ends of a bar are."""
    colours, count = np.unique(pixels, axis=0, return_counts=True)
    coarse = np.unique(colours // STEP * STEP, axis=0)
    found: list[int] = [*PAPER, *INK]
    for each in (np.repeat(colours, np.ceil(np.sqrt(count)).astype(int), axis=0), coarse):
        cut = Image.fromarray(each[None]).quantize(127, method=Image.Quantize.MEDIANCUT).getpalette() or []
        found += cut[: 3 * 127]
    palette = Image.new("P", (1, 1))
    palette.putpalette(found)
    return palette


def _write_mp4(frames: Iterable[Image.Image], path: Path, rate: float) -> int:
    import imageio_ffmpeg  # an optional package

    rest = iter(frames)
    first = next(rest)
    # Players want sides that are even.
    width, height = (side - side % 2 for side in first.size)
    options = ["-f", "mp4"]  # the name that the file has for now does not tell
    writer = imageio_ffmpeg.write_frames(
        str(path), (width, height), fps=rate, quality=7, macro_block_size=2, output_params=options
    )
    number, data = 0, b""
    try:
        writer.send(None)
        for image in chain([first], rest):
            number, data = number + 1, image.crop((0, 0, width, height)).tobytes()
            writer.send(data)
        for _ in range(round(HELD * rate)):
            writer.send(data)
    finally:
        writer.close()
    return number
