"""Drawing with VTK in a process of its own: without any OpenGL library VTK does not fail but crash."""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

#: What all pictures of solids share: colours, and the direction to the eye that shows one from above.
BODY, PAPER = "#7fa7c9", "#ffffff"
ABOVE = (1.0, -1.3, 0.75)
WHITE = (255, 255, 255)
LONGEST_DRAWING = 120.0  # s; a driver that hangs must not hang the pipeline


def drawn_apart(module: str, arrays: dict[str, NDArray[np.generic]]) -> bytes | None:
    """Have a module draw arrays into a PNG; None if it ended badly.

    Args:
        module: is run with two arguments, an .npz file of the arrays and the PNG to write.
    """
    with tempfile.TemporaryDirectory() as folder:
        given, drawn = Path(folder) / "given.npz", Path(folder) / "drawn.png"
        np.savez(given, allow_pickle=False, **arrays)
        command = [sys.executable, "-P", "-m", module, str(given), str(drawn)]
        try:
            ended = subprocess.run(command, capture_output=True, timeout=LONGEST_DRAWING, check=False)
        except (OSError, subprocess.TimeoutExpired):
            return None
        return drawn.read_bytes() if ended.returncode == 0 and drawn.is_file() else None


def reduce_colours(png: Path) -> None:
    """Store a PNG with 256 colours, which halves the file and looks the same."""
    png.write_bytes(with_fewer_colours(png.read_bytes()))


def with_fewer_colours(png: bytes) -> bytes:
    """A PNG with 256 colours, mixed by dots where these do not suffice: bands would look like contours."""
    with Image.open(io.BytesIO(png), formats=["PNG"]) as drawn:
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
