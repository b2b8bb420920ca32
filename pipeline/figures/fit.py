"""The figure of a uniaxial test and the laws fitted to it."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from stages.fit import Result
from stages.laws import LAWS

#: Every law has a style of its own: the colours in the order in which laws are registered, then with other strokes.
COLOURS = ("#7f7f7f", "#1f4e79", "#c55a11", "#2e7d32", "#7b1fa2", "#00838f", "#b71c1c", "#9e9d24")
STROKES = ("-", "--", "-.", ":")


def style_of(law: str) -> tuple[str, str]:
    """Colour and stroke of a registered law."""
    stroke, colour = divmod(list(LAWS).index(law), len(COLOURS))
    return COLOURS[colour], STROKES[stroke % len(STROKES)]


def fit(result: Result, title: str = "") -> Figure:
    """Engineering stress against stretch, and what each law misses; ``title`` stands above, such as the file's name."""
    figure = Figure(figsize=(8.0, 6.4), dpi=110, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    order = np.argsort(result.stretch)
    stretch, stress = result.stretch[order], result.stress[order]
    above.plot(stretch, stress, "o", color="black", markersize=4, label="measured", zorder=3)
    fine = np.linspace(min(1.0, stretch[0]), max(1.0, stretch[-1]), 300)
    for found in result.fits:
        colour, stroke = style_of(found.name)
        label = f"{found.name}, R² = {found.r_squared:.4f}"
        above.plot(fine, found.stress(fine), stroke, color=colour, linewidth=1.4, label=label)
        below.plot(stretch, found.stress(stretch) - stress, f".{stroke}", color=colour, linewidth=0.8)
    above.set(ylabel="engineering stress [N/mm²]")
    below.set(xlabel="stretch [-]", ylabel="law - measured [N/mm²]")
    below.axhline(0.0, color="black", linewidth=0.6)
    for axes in (above, below):
        axes.grid(alpha=0.3)
    above.legend(frameon=False)
    above.set_title(title)
    return figure
