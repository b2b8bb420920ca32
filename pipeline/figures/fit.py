"""The figure of a uniaxial test and the laws fitted to it."""

from __future__ import annotations

from itertools import cycle

import numpy as np
from matplotlib.figure import Figure

from stages.fit import Result

#: In the order of the fits.
COLOURS = ("#7f7f7f", "#1f4e79", "#c55a11", "#2e7d32", "#6a3d9a", "#8c564b")


def fit(result: Result) -> Figure:
    """Engineering stress against stretch, and what each law misses."""
    figure = Figure(figsize=(8.0, 6.4), dpi=110, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    order = np.argsort(result.stretch)
    stretch, stress = result.stretch[order], result.stress[order]
    above.plot(stretch, stress, "o", color="black", markersize=4, label="measured", zorder=3)
    fine = np.linspace(min(1.0, stretch[0]), max(1.0, stretch[-1]), 300)
    for found, colour in zip(result.fits, cycle(COLOURS), strict=False):
        label = f"{found.name}, R² = {found.r_squared:.4f}"
        above.plot(fine, found.stress(fine), color=colour, linewidth=1.4, label=label)
        below.plot(stretch, found.stress(stretch) - stress, ".-", color=colour, linewidth=0.8)
    above.set(ylabel="engineering stress [N/mm²]")
    below.set(xlabel="stretch [-]", ylabel="law - measured [N/mm²]")
    below.axhline(0.0, color="black", linewidth=0.6)
    for axes in (above, below):
        axes.grid(alpha=0.3)
    above.legend(frameon=False)
    return figure
