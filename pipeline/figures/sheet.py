"""Figures whose panels are true to scale: millimetres on axes or a scale bar, colour bars beside the panels, a title.

Panels have one scale and are arranged in as many columns as make them largest, so that long, flat, small and large
parts fill the sheet alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.axes_grid1.anchored_artists import AnchoredSizeBar

from actuator.arrays import Floats
from actuator.geometry.normals import triangle_normals
from pipeline.figures.offscreen import PAPER, CannotDraw, Pixels, Scale, Shot, pictures
from pipeline.figures.shading import AMBIENT, LIGHT, Direction, projection

#: Largest sheet, inches, and its dots per inch.
LARGEST, DPI = (11.0, 7.0), 125
#: Around a panel, inches: left, right, bottom, top; with axes, and with a scale bar and the directions of the axes.
WITH_AXES, WITH_BAR = (0.75, 0.15, 0.55, 0.35), (0.15, 0.15, 0.65, 0.35)
#: For the title above and a colour bar to the right, inches.
HEADING, BAR = 0.4, 0.95
#: Least width of a panel's place, inches, for its title, and dots of VTK's per dot of the sheet.
NARROWEST, FINER = 2.0, 2.0
#: Room around a solid over its extent.
MARGIN = 0.02
#: Inches between ticks at least, and share of a panel that its scale bar takes at most.
TICKS, SHARE = 0.45, 0.35
#: Colours of the three axes, as VTK has them.
AXES = {"X1": "#d1495b", "X2": "#2e7d32", "X3": "#1f4e79"}


@dataclass(frozen=True)
class Place:
    """What a panel is to have room for.

    Attributes:
        extent: left, right, bottom and top, mm, (4,).
        title: above it.
        labels: of its two axes; with a scale bar instead if there are none.
    """

    extent: Floats
    title: str = ""
    labels: tuple[str, str] | None = None


@dataclass(frozen=True)
class Sheet:
    """A figure with its panels.

    Attributes:
        figure: of matplotlib's.
        panels: one for each place.
        bar: where a colour bar goes, if one was asked for.
        scale: inches per mm.
    """

    figure: Figure
    panels: list[Axes]
    bar: Axes | None
    scale: float

    def colour_bar(self, scale: Scale) -> None:
        """Draw the bar of a field's colours."""
        assert self.bar is not None
        colours = ScalarMappable(Normalize(0.0, scale.high), scale.colours)
        self.figure.colorbar(colours, cax=self.bar, label=scale.label)

    def subtitle(self, words: str) -> Artist:
        """Words below the title, which may change from frame to frame of a film."""
        top = 1.0 - HEADING / self.figure.get_figheight()
        return self.figure.text(0.5, top, words, ha="center", va="center", fontsize=11)


def padded(extent: Floats, share: float = MARGIN) -> Floats:
    """An extent with some room around it."""
    room = share * max(extent[1] - extent[0], extent[3] - extent[2])
    return extent + room * np.array([-1.0, 1.0, -1.0, 1.0])


def sheet(places: Sequence[Place], title: str, *, bar: bool = False) -> Sheet:
    """A figure with panels of the given extents at one scale.

    Args:
        places: in the order of reading.
        title: above all of them, such as the name of the case.
        bar: whether there is to be room for a colour bar.
    """
    pads = np.array([WITH_AXES if place.labels else WITH_BAR for place in places])
    sizes = np.array([np.diff(place.extent)[::2] for place in places])
    heading, beside = HEADING if title else 0.0, BAR if bar else 0.0
    room = np.array(LARGEST) - (beside, heading)
    arranged = [_Grid(columns, sizes, pads, room) for columns in range(1, len(places) + 1)]
    grid = max(arranged, key=lambda each: each.scale)
    widths, heights = grid.widths, grid.heights
    width, height = widths.sum() + beside, heights.sum() + heading
    figure = Figure(figsize=(width, height), dpi=DPI, facecolor=PAPER)
    if title:
        figure.suptitle(title, y=1.0 - 0.5 * HEADING / height, va="center", fontsize=12)
    length = _round_length(SHARE * min(size[0] for size in sizes))
    panels = []
    for number, (place, pad, size) in enumerate(zip(places, pads, sizes, strict=True)):
        row, column = divmod(number, grid.columns)
        wide, high = grid.scale * size
        # Solids stand in the middle of their place, axes at its left, so that those below each other are aligned.
        spare = widths[column] - pad[:2].sum() - wide
        left = widths[:column].sum() + pad[0] + (0.0 if place.labels else 0.5 * spare)
        bottom = heights[row + 1 :].sum() + pad[2]
        axes = figure.add_axes((left / width, bottom / height, wide / width, high / height))
        axes.set_xlim(*place.extent[:2])
        axes.set_ylim(*place.extent[2:])
        axes.set_title(place.title, fontsize=11)
        if place.labels:
            axes.set(xlabel=place.labels[0], ylabel=place.labels[1])
            for axis, long in ((axes.xaxis, wide), (axes.yaxis, high)):
                axis.set_major_locator(MaxNLocator(int(np.clip(long / TICKS, 1, 8)), steps=[1, 2, 5, 10]))
        else:
            axes.set_axis_off()
            _scale_bar(axes, length, 0.03 / grid.scale)
        panels.append(axes)
    found = None
    if bar:
        high = min(heights.sum() - 0.9, 3.5)
        found = figure.add_axes(
            ((width - BAR + 0.1) / width, (0.5 * (heights.sum() - high)) / height, 0.16 / width, high / height)
        )
    return Sheet(figure, panels, found, grid.scale)


class _Grid:
    """Panels in a number of columns: inches per mm, widths of columns and heights of rows, inches."""

    def __init__(self, columns: int, sizes: Floats, pads: Floats, room: Floats) -> None:
        self.columns = columns
        row, column = np.divmod(np.arange(len(sizes)), columns)

        def largest(values: Floats, by: Any) -> Floats:
            return np.array([values[by == k].max() for k in range(int(by.max()) + 1)])

        across, upwards = largest(sizes[:, 0], column), largest(sizes[:, 1], row)
        beside, above = largest(pads[:, :2].sum(axis=1), column), largest(pads[:, 2:].sum(axis=1), row)
        self.scale = float((room[1] - above.sum()) / upwards.sum())
        narrow = np.zeros(len(across), dtype=bool)
        # Places that would be too narrow for their titles take from the room of the others.
        while True:
            left = room[0] - NARROWEST * narrow.sum() - beside[~narrow].sum()
            if not narrow.all():
                self.scale = min(self.scale, float(left / across[~narrow].sum()))
            found = self.scale * across + beside < NARROWEST
            if (found <= narrow).all():
                break
            narrow |= found
        self.widths = np.maximum(self.scale * across + beside, NARROWEST)
        self.heights = self.scale * upwards + above


def _round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above a length."""
    power = 10.0 ** np.floor(np.log10(most))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= most * (1.0 + 1e-9)))


def _scale_bar(axes: Axes, length: float, thickness: float) -> None:
    """A bar of a length below a panel, mm."""
    bar = AnchoredSizeBar(
        axes.transData,
        length,
        f"{length:g} mm",
        "upper left",
        pad=0.0,
        borderpad=0.0,
        sep=3,
        frameon=False,
        size_vertical=thickness,
        bbox_to_anchor=(0.0, -0.12 / _inches_high(axes)),
        bbox_transform=axes.transAxes,
    )
    axes.add_artist(bar)


def _inches_high(axes: Axes) -> float:
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    return float(axes.get_position().height * figure.get_figheight())


def directions(axes: Axes, eye: Direction, up: Direction = (0.0, 0.0, 1.0)) -> None:
    """Arrows along X1, X2 and X3 below a panel, at its right."""
    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    width, height = figure.get_size_inches()
    box = axes.get_position()
    side = WITH_BAR[2] - 0.05
    small = figure.add_axes((box.x1 - side / width, box.y0 - (side + 0.05) / height, side / width, side / height))
    small.set(xlim=(-1.2, 1.2), ylim=(-1.2, 1.2))
    small.set_axis_off()
    rows = projection(eye, up)
    for (name, colour), x, y in zip(AXES.items(), *rows[:2], strict=True):
        small.annotate(
            "", (x, y), (0.0, 0.0), arrowprops={"arrowstyle": "->", "color": colour, "shrinkA": 0, "shrinkB": 0}
        )
        far = np.hypot(x, y) + 0.35
        small.text(
            x / np.hypot(x, y) * far, y / np.hypot(x, y) * far, name, color=colour, fontsize=7, ha="center", va="center"
        )


def draw_shots(found: Sheet, panels: Sequence[Axes], shots: Sequence[Shot]) -> None:
    """Put solids onto panels of a sheet: as VTK draws them, and where it cannot, triangle by triangle."""
    for axes, shot in zip(panels, shots, strict=True):
        if not axes.axison:
            directions(axes, shot.direction, shot.up)
    show(panels, shots, pixels(found, panels, shots))


def pixels(found: Sheet, panels: Sequence[Axes], shots: Sequence[Shot]) -> list[Pixels | None]:
    """What VTK draws for panels of a sheet; None for each if it cannot."""
    extents = [np.array([*axes.get_xlim(), *axes.get_ylim()]) for axes in panels]
    try:
        return [*pictures(shots, extents, FINER * found.figure.get_dpi() * found.scale)]
    except CannotDraw:
        return [None] * len(shots)


def show(panels: Sequence[Axes], shots: Sequence[Shot], drawn: Sequence[Pixels | None]) -> list[Artist]:
    """Put pixels, or what can be drawn without VTK, onto panels; returns what was put there."""
    found: list[Artist] = []
    for axes, shot, picture in zip(panels, shots, drawn, strict=True):
        if picture is None:
            found.append(_draw_triangles(axes, shot))
        else:
            extent = (*axes.get_xlim(), *axes.get_ylim())
            image = axes.imshow(picture, extent=extent, aspect="auto", interpolation="antialiased", zorder=0.5)
            found.append(image)
    return found


def _draw_triangles(axes: Axes, shot: Shot) -> Artist:
    """The far triangles first, in one tone each; their edges close the hairlines between them."""
    rows = projection(shot.direction, shot.up)
    light = rows.T @ LIGHT / np.linalg.norm(LIGHT)
    corners, colours = [], []
    for each in shot.pieces:
        seen = each.triangles[triangle_normals(each.vertices[each.triangles]) @ rows[2] > 0.0]
        tone = np.tile(to_rgb(each.colour), (len(seen), 1))
        if each.values is not None and each.scale is not None:
            of_values = ScalarMappable(Normalize(0.0, each.scale.high), each.scale.colours)
            tone = of_values.to_rgba(each.values[seen].mean(axis=1))[:, :3]
        shade = AMBIENT + (1.0 - AMBIENT) * np.clip(each.normals[seen].mean(axis=1) @ light, 0.0, 1.0)
        colours.append(tone * shade[:, None] if each.lit else tone)
        corners.append(each.vertices[seen] @ rows.T)
    if not corners:
        return axes.add_collection(PolyCollection([]), autolim=False)
    place, tones = np.concatenate(corners), np.concatenate(colours)
    order = np.argsort(place[:, :, 2].sum(axis=1))
    drawn = PolyCollection(list(place[order, :, :2]), facecolors=tones[order], edgecolors=tones[order], linewidths=0.4)
    drawn.set_rasterized(True)
    axes.add_collection(drawn, autolim=False)
    return drawn
