"""The figure of a simulation: displacement over pressure, up and down, limit points marked."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pipeline.results.simulation import Curves
from stages.rig import RigUnits

COLOUR = "#1f4e79"


def response(simulation: Curves, rig: RigUnits | None = None, title: str = "") -> Figure:
    """Travel of the arm's end, by which a spring there is elongated, and rotation of the arm over the pressure.

    Args:
        simulation: the curve.
        rig: draws in kPa and mm of a part; N/mm² and mm of the computed actuator without.
        title: above the figure, such as the name of the case.
    """
    figure = Figure(figsize=(10.0, 4.4), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2)
    curve, summary = simulation.curves, simulation.summary
    pressure, elongation, target = curve["pressure"], curve["elongation"], summary["pressure_in"]
    if rig:
        pressure, elongation = rig.scaled(pressure, elongation)
        target = float(rig.scaled(np.array(target), np.array(0.0))[0])
    of_part = ", part" if rig and not rig.same else ""
    up = curve["loading"] == 1.0
    for axes, values in ((left, elongation), (right, np.degrees(curve["theta2"]))):
        axes.plot(pressure[up], values[up], "o-", color=COLOUR, markersize=3, label="up")
        axes.plot(pressure[~up], values[~up], "x--", color=COLOUR, markersize=5, alpha=0.7, label="down")
        for limit in summary["limit_points"]:
            here = (curve["load_factor"] == limit["load_factor"]) & (curve["loading"] == float(limit["loading"]))
            axes.plot(pressure[here], values[here], "D", color="#b00020", markersize=7, fillstyle="none")
        axes.axvline(target, color="#888888", linewidth=0.8, linestyle=":", label="p_in")
        axes.set(xlabel=f"pressure [{'kPa' if rig else 'N/mm²'}{of_part}]")
        axes.grid(alpha=0.3)
    left.set(ylabel=f"travel of the arm's end [mm{of_part}]")
    right.set(ylabel="arm rotation θ2 [degrees]")
    left.legend(frameon=False)
    figure.suptitle(title)
    return figure
