"""The figure of ``poro compare``: measured rows, averaged curves and the prediction over the pressure.

Below it the two signals over time, as Appendix F of arXiv:2605.20101 shows them, where the time was recorded.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stages.compare import Prediction, Recording, Result
from stages.compare.deviations import Target

#: More points of a side are not seen apart, and make vector graphics heavy.
MOST_POINTS = 1500
#: Dark for averages, light for the rows themselves.
LOADING, UNLOADING, PREDICTED = ("#1f4e79", "#a9c4e0"), ("#c55a11", "#f3c39f"), "#000000"
BESIDE = "#2e7d32"
#: What answers the pressure, for the axis.
ANSWERS = {"displacement": "displacement of the spring's end", "angle": "angle of the plate", "force": "force"}


def comparison(
    result: Result,
    prediction: Prediction,
    title: str = "",
    source: str = "",
    beside: Mapping[str, Prediction] | None = None,
) -> Figure:
    """Measured rows in two light tones, averages in their dark ones, predictions in black and green, the target dashed.

    Args:
        result: of the comparison.
        prediction: what was compared with.
        title: above the figure.
        source: of the prediction, for the legend.
        beside: other predictions by name.
    """
    timed = result.aligned.time is not None
    figure = Figure(figsize=(8.0, 7.6 if timed else 5.2), dpi=110, layout="constrained", facecolor="white")
    if timed:
        axes, below = figure.subplots(2, 1, height_ratios=(5.2, 2.4))
        _signals(below, [part.recording for part in result.recordings])
    else:
        axes = figure.subplots()
    sides = (
        ("loading", LOADING, result.mean_loading, [cycle.loading for cycle in result.cycles]),
        ("unloading", UNLOADING, result.mean_unloading, [cycle.unloading for cycle in result.cycles]),
    )
    for name, (dark, light), mean, branches in sides:
        rows = [np.arange(part.start, part.stop) for part in branches if part is not None]
        if not rows:
            continue
        shown = np.concatenate(rows)
        shown = shown[:: -(-len(shown) // MOST_POINTS)]
        points = result.aligned.pressure[shown], result.aligned.displacement[shown]
        axes.plot(*points, "o", color=light, markersize=4.0, markeredgewidth=0.0, zorder=1.5)
        axes.plot(result.pressure, mean, color=dark, linewidth=1.2, label=f"measured, {name}, {_mean(len(rows))}")
    pressure, displacement = prediction.pressure, prediction.displacement
    if prediction.curve:
        label = ", ".join(filter(None, ("predicted", source)))
        axes.plot([0.0, *pressure], [0.0, *displacement], color=PREDICTED, linewidth=1.6, label=label)
    elif np.isfinite(displacement).any():
        axes.plot([0.0, *pressure], [0.0, *displacement], "D", color=PREDICTED, label="predicted, no curve")
    for other, curve in (beside or {}).items():
        points = [0.0, *curve.pressure], [0.0, *curve.displacement]
        axes.plot(*points, color=BESIDE, linewidth=1.2, label=f"predicted, {other}")
    target, answer, unit = result.target, result.aligned.answer, result.aligned.unit
    axes.axvline(target.pressure, color="#7f7f7f", linestyle="--", linewidth=1.0, label=_target(target, unit))
    axes.plot(target.pressure, target.mean, "o", color=LOADING[0], markersize=7.0)
    if target.predicted is not None and prediction.curve:
        axes.plot(target.pressure, target.predicted, "o", color=PREDICTED, markersize=7.0)
    axes.set(xlabel="pressure [kPa]", ylabel=f"{ANSWERS.get(answer, answer)} [{unit}]")
    axes.set_title(title, fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, loc="upper left")
    return figure


def _signals(axes: Axes, recordings: Sequence[Recording]) -> None:
    """Pressure on the left, what answers it on the right, over each recording's own time."""
    right = axes.twinx()
    for recording in recordings:
        assert recording.time is not None
        every = -(-len(recording.time) // MOST_POINTS)
        for side, signal, color in (
            (axes, recording.pressure, PREDICTED),
            (right, recording.displacement, LOADING[0]),
        ):
            side.plot(recording.time[::every], signal[::every], color=color, linewidth=0.8)
    axes.set_ylabel("pressure [kPa]", color=PREDICTED)
    right.set_ylabel(f"{recordings[0].answer} [{recordings[0].unit}]", color=LOADING[0])
    axes.set_xlabel("time [s]")
    axes.grid(alpha=0.3)


def _target(target: Target, unit: str) -> str:
    at = f"target {target.pressure:.4g} kPa"
    return at if target.deviation is None else f"{at}, deviation {target.deviation:+.2f} {unit}"


def _mean(count: int) -> str:
    return "1 cycle" if count == 1 else f"mean of {count} cycles"
