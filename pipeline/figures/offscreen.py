"""Drawing with VTK in a process of its own: without any OpenGL library VTK does not fail but crash."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

#: What all figures of solids share: colours, and the direction to the eye that shows one from above.
BODY, PAPER = "#7fa7c9", "#ffffff"
ABOVE = (1.0, -1.3, 0.75)
LONGEST_DRAWING = 120.0  # s; a driver that hangs must not hang the pipeline


class CannotDraw(Exception):
    """Why a figure cannot be drawn, in a sentence."""


def drawn_apart(module: str, arrays: Mapping[str, NDArray[Any]]) -> Image.Image:
    """Have a module draw arrays.

    Args:
        module: is run with two arguments, an .npz file of the arrays and the PNG to write.

    Raises:
        CannotDraw: if it ended badly.
    """
    with tempfile.TemporaryDirectory() as folder:
        given, drawn = Path(folder) / "given.npz", Path(folder) / "drawn.png"
        np.savez(given, allow_pickle=False, **arrays)
        command = [sys.executable, "-P", "-m", module, str(given), str(drawn)]
        try:
            subprocess.run(command, capture_output=True, timeout=LONGEST_DRAWING, check=True)
            with Image.open(drawn, formats=["PNG"]) as found:
                return found.convert("RGB")
        except (OSError, subprocess.SubprocessError):
            sentence = "VTK cannot draw on this machine; an OpenGL library such as Mesa may be missing."
            raise CannotDraw(sentence) from None
