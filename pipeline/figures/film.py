"""Frames of films: a solid that grows or moves, whole and cut open, with a fixed camera and fixed colours."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from actuator.arrays import Floats
from pipeline.figures.offscreen import Scale, Shot
from pipeline.figures.part import INSIDE, OUTSIDE
from pipeline.figures.sheet import Place, Sheet, directions, padded, pixels, sheet, show
from pipeline.figures.states import cut_open, whole

#: Frames that one process of VTK's draws: it starts for seconds, and memory holds the surfaces of that many.
TOGETHER = 12


@dataclass(frozen=True)
class Moment:
    """What one frame shows.

    Attributes:
        words: below the name: number of the design update, or pressure.
        grid: makes the solid as a grid of pyvista, with ``displacement``, mm, and the field that is drawn.
    """

    words: str
    grid: Callable[[], Any]


@dataclass(frozen=True)
class Film:
    """What a film shows.

    Attributes:
        title: above every frame, such as the name of the case.
        moments: one for every frame.
        half: whether the grids are of the half X2 >= 0.
        field: name of what is drawn.
        scale: of its colours.
        on_the_outside: whether the whole solid is coloured, too; from outside there is no pressure to be seen.
    """

    title: str
    moments: Sequence[Moment]
    half: bool
    field: str
    scale: Scale
    on_the_outside: bool = False


def frames(film: Film, width: int) -> Iterator[Image.Image]:
    """Draw a film, frame by frame.

    Args:
        film: what is shown.
        width: of the frames, pixels.
    """
    extents = _extents(film)
    words = ("whole", "cut open at X2 = 0")
    places = [Place(padded(extent), each) for extent, each in zip(extents, words, strict=True)]
    found = sheet(places, film.title, bar=True)
    found.figure.set_dpi(width / found.figure.get_figwidth())
    found.colour_bar(film.scale)
    for axes, view in zip(found.panels, (OUTSIDE, INSIDE), strict=True):
        directions(axes, view)
    canvas = FigureCanvasAgg(found.figure)
    for start in range(0, len(film.moments), TOGETHER):
        yield from _drawn(film, film.moments[start : start + TOGETHER], found, canvas)


def _drawn(film: Film, moments: Sequence[Moment], found: Sheet, canvas: FigureCanvasAgg) -> Iterator[Image.Image]:
    shots = [_shots(film, moment.grid()) for moment in moments]
    drawn = pixels(found, found.panels * len(shots), [shot for pair in shots for shot in pair])
    for number, (moment, pair) in enumerate(zip(moments, shots, strict=True)):
        words = found.subtitle(moment.words)
        artists = show(found.panels, pair, drawn[2 * number : 2 * number + 2])
        canvas.draw()
        yield Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())
        for artist in (*artists, words):
            artist.remove()


def _shots(film: Film, grid: Any) -> list[Shot]:
    outside = whole(grid, film.half, film.field, film.scale if film.on_the_outside else None)
    return [Shot(outside, OUTSIDE), Shot(cut_open(grid, film.half, film.field, film.scale), INSIDE)]


def _extents(film: Film) -> list[Floats]:
    """What the two views have to hold of all moments, (4,) each."""
    found = np.array([[shot.extent() for shot in _shots(film, moment.grid())] for moment in film.moments])
    low, high = found.min(axis=0), found.max(axis=0)
    return [np.where([True, False, True, False], a, b) for a, b in zip(low, high, strict=True)]
