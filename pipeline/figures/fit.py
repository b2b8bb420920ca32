"""The figure of a uniaxial test and the laws fitted to it."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from stages.fit import Result
from stages.laws import LAWS
from stages.near_rest import REACH, nearest

#: Every law has a style of its own: the colours in the order in which laws are registered, then with other strokes.
COLOURS = ("#7f7f7f", "#1f4e79", "#c55a11", "#2e7d32", "#7b1fa2", "#00838f", "#b71c1c", "#9e9d24")
STROKES = ("-", "--", "-.", ":")


def style_of(law: str) -> tuple[str, str]:
    """Colour and stroke of a registered law."""
    stroke, colour = divmod(list(LAWS).index(law), len(COLOURS))
    return COLOURS[colour], STROKES[stroke % len(STROKES)]


def fit(result: Result, title: str = "") -> Figure:
    """Engineering stress against stretch: all rows, those near rest, and what each law misses; a title stands above."""
    figure = Figure(figsize=(10.4, 6.0), dpi=110, layout="constrained")
    axes = figure.subplot_mosaic([["whole", "near"], ["whole", "missed"]], height_ratios=(2.4, 1.0))
    whole, near, missed = axes["whole"], axes["near"], axes["missed"]
    stretch, stress = result.stretch[result.fitted], result.stress[result.fitted]
    limit = 1.0 + result.strain_limit
    close = result.stretch[nearest(result.stretch, REACH * result.strain_limit)]
    ranges = (whole, result.stretch[0], result.stretch[-1]), (near, close[0], max(close[-1], limit))
    for panel, first, last in ranges:
        low, high = min(1.0, first), max(1.0, last)
        shown = (result.stretch >= low) & (result.stretch <= high)
        panel.plot(
            result.stretch[shown], result.stress[shown], "o", color="black", markersize=4, label="measured", zorder=3
        )
        fine = np.linspace(low, high, 300)
        for found in result.fits:
            colour, stroke = style_of(found.name)
            label = f"{found.name}, E {found.youngs_modulus:.3g} N/mm², R² {found.r_squared:.4f}"
            panel.plot(fine, found.stress(fine), stroke, color=colour, linewidth=1.4, label=label)
        panel.axvspan(stretch[0], stretch[-1], color="#1f4e79", alpha=0.08, linewidth=0.0, label="fitted")
        panel.axvline(
            limit, color="#b71c1c", linewidth=1.0, linestyle=":", label=f"strain limit, {100 * (limit - 1):g} %"
        )
        edge = 0.04 * (high - low)
        panel.set(ylabel="engineering stress [N/mm²]", xlim=(low - edge, high + edge))
    # Laws that are fitted near rest may leave the frame far from it, and so do rows that were left out.
    least, most = result.stress.min(), result.stress.max()
    room = 0.08 * (most - least)
    whole.set(xlabel="stretch [-]", ylim=(min(0.0, least) - room, most + room))
    excluded = result.excluded
    if len(excluded):
        (x0, x1), (y0, y1) = whole.get_xlim(), whole.get_ylim()
        held = np.clip(excluded, (x0, y0), (x1, y1))
        whole.plot(*held.T, "x", color="#b71c1c", markersize=5, label="left out", clip_on=False, zorder=2)
    for found in result.fits:
        colour, stroke = style_of(found.name)
        missed.plot(stretch, found.stress(stretch) - stress, f".{stroke}", color=colour, linewidth=0.8)
    missed.set(xlabel="stretch [-]", ylabel="law - measured")
    missed.axhline(0.0, color="black", linewidth=0.6)
    whole.set_title("all rows", fontsize=10)
    near.set_title("near rest", fontsize=10)
    for panel in axes.values():
        panel.grid(alpha=0.3)
    whole.legend(framealpha=0.9, edgecolor="none", fontsize=8)
    figure.suptitle(title)
    return figure
