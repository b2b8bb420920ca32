"""The plot of a study: what became of the design against what was varied."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.results.wording import formatted

#: What is drawn: column and label.
DRAWN = {
    "C0": "main objective C0",
    "T3": "T3 [mm]",
    "theta2": "arm rotation θ2 [degrees]",
    "spring_elongation": "travel of the arm's end [mm]",
}
#: Most curves in one panel; two keys with more are drawn as a map. Most curves that a legend lists.
MOST_CURVES, MOST_LISTED = 8, 12
#: Most values that an axis of a map names.
MOST_TICKS = 5


def sweep(
    table: list[dict[str, Any]],
    keys: Sequence[str],
    *,
    grid: bool = True,
    logarithmic: Collection[str] = (),
    title: str = "",
) -> Figure:
    """Curves over the key with the most values, one per combination of the others, or a map of two keys.

    Args:
        table: one row per case, with a value for every key and, or None, every column of :data:`DRAWN`.
        keys: what was varied.
        grid: whether every value is combined with every other; else the first with the first and so on.
        logarithmic: keys whose axis is logarithmic.
        title: above the figure, such as the name of the case that was varied.
    """
    values = {key: list(dict.fromkeys(row[key] for row in table)) for key in keys}
    along = max(keys, key=lambda key: len(values[key])) if grid else keys[0]
    others = [key for key in keys if key != along] if grid else []
    figure = Figure(figsize=(10.0, 7.0), dpi=110, layout="constrained")
    panels = figure.subplots(2, 2).ravel()
    mapped = len(others) == 1 and len(values[others[0]]) > MOST_CURVES
    for axes, (column, label) in zip(panels, DRAWN.items(), strict=True):
        if mapped:
            _map(figure, axes, table, (along, others[0]), (values[along], values[others[0]]), column)
            axes.set_title(label)
        else:
            _curves(axes, table, along, others, values[along], column)
            axes.set(xlabel=along, ylabel=label)
            axes.grid(alpha=0.3)
            if along in logarithmic:
                axes.set_xscale("log")
    figure.suptitle(title)
    handles, labels = panels[0].get_legend_handles_labels()
    if others and not mapped and len(labels) <= MOST_LISTED:
        figure.legend(handles, labels, title=", ".join(others), loc="outside right upper", frameon=False)
    return figure


def _curves(
    axes: Axes, table: list[dict[str, Any]], along: str, others: list[str], ticks: list[Any], column: str
) -> None:
    curves: dict[tuple[Any, ...], list[tuple[float, float]]] = {}
    for row in table:
        if row[column] is not None:
            place = (_place(row[along], ticks), float(row[column]))
            curves.setdefault(tuple(row[key] for key in others), []).append(place)
    for combination, points in curves.items():
        x, y = zip(*sorted(points), strict=True)
        axes.plot(x, y, "o-", markersize=4, label=", ".join(map(_brief, combination)))
    _name_words(axes, ticks, "x")


def _map(
    figure: Figure,
    axes: Axes,
    table: list[dict[str, Any]],
    keys: tuple[str, str],
    ticks: tuple[list[Any], list[Any]],
    column: str,
) -> None:
    found = np.full((len(ticks[1]), len(ticks[0])), np.nan)
    for row in table:
        if row[column] is not None:
            found[ticks[1].index(row[keys[1]]), ticks[0].index(row[keys[0]])] = row[column]
    image = axes.imshow(found, origin="lower", aspect="auto", cmap="viridis")
    for name, key, listed in (("x", keys[0], ticks[0]), ("y", keys[1], ticks[1])):
        every = -(-len(listed) // MOST_TICKS)
        axes.set(**{f"{name}label": key, f"{name}ticks": range(0, len(listed), every)})
        axes.set(**{f"{name}ticklabels": [_brief(value) for value in listed[::every]]})
    figure.colorbar(image, ax=axes)


def _place(value: Any, ticks: list[Any]) -> float:
    """Numbers stand where they are, words beside each other."""
    return float(value) if _numbers(ticks) else float(ticks.index(value))


def _name_words(axes: Axes, ticks: list[Any], name: str) -> None:
    if not _numbers(ticks):
        axes.set(**{f"{name}ticks": range(len(ticks)), f"{name}ticklabels": [_brief(value) for value in ticks]})


def _brief(value: Any) -> str:
    return formatted(value, 3)


def _numbers(values: list[Any]) -> bool:
    return all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)
