"""Drawing of a uniaxial test and the laws fitted to it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pipeline.figures.offscreen import reduce_colours
from stages.fit import Result

COLOURS = {"neo-hooke": "#7f7f7f", "mooney-rivlin": "#1f4e79", "yeoh": "#c55a11", "ogden": "#2e7d32"}


def draw(result: Result, target: Path) -> None:
    """Engineering stress against stretch, and what each law misses, as PNG.

    Raises:
        OSError: if the folder or the disk does not take the plot.
    """
    figure = Figure(figsize=(8.0, 6.4), dpi=110, layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3.0, 1.0))
    order = np.argsort(result.stretch)
    stretch, stress = result.stretch[order], result.stress[order]
    above.plot(stretch, stress, "o", color="black", markersize=4, label="measured", zorder=3)
    fine = np.linspace(min(1.0, stretch[0]), max(1.0, stretch[-1]), 300)
    for fit in result.fits:
        label = f"{fit.name}, R² = {fit.r_squared:.4f}"
        above.plot(fine, fit.stress(fine), color=COLOURS[fit.name], linewidth=1.4, label=label)
        below.plot(stretch, fit.stress(stretch) - stress, ".-", color=COLOURS[fit.name], linewidth=0.8)
    above.set(ylabel="engineering stress [N/mm²]")
    below.set(xlabel="stretch [-]", ylabel="law - measured [N/mm²]")
    below.axhline(0.0, color="black", linewidth=0.6)
    for axes in (above, below):
        axes.grid(alpha=0.3)
    above.legend(frameon=False)
    FigureCanvasAgg(figure).print_figure(target, format="png")
    reduce_colours(target)
