"""The figure of a simulation: pressure against displacement, up and down, limit points marked."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pipeline.results.simulation import Curves
from stages.rig import RigUnits

COLOUR = "#1f4e79"


def response(simulation: Curves, rig: RigUnits | None = None) -> Figure:
    """Pressure against the travel of the arm's end, by which a spring there is elongated, and the arm's rotation.

    Args:
        simulation: the curve.
        rig: draws in kPa and mm of a part; N/mm² and mm of the computed actuator without.
    """
    figure = Figure(figsize=(10.0, 4.4), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    curve, summary = simulation.curves, simulation.summary
    pressure, elongation, target = curve["pressure"], curve["elongation"], summary["pressure_in"]
    if rig:
        pressure, elongation = rig.scaled(pressure, elongation)
        target = float(rig.scaled(np.array(target), np.array(0.0))[0])
    up = curve["loading"] == 1.0
    for axes, values in ((left, elongation), (right, np.degrees(curve["theta2"]))):
        axes.plot(values[up], pressure[up], "o-", color=COLOUR, markersize=3, label="up")
        axes.plot(values[~up], pressure[~up], "x--", color=COLOUR, markersize=5, alpha=0.7, label="down")
        for limit in summary["limit_points"]:
            here = (curve["load_factor"] == limit["load_factor"]) & (curve["loading"] == float(limit["loading"]))
            axes.plot(values[here], pressure[here], "D", color="#b00020", markersize=7, fillstyle="none")
        axes.axhline(target, color="#888888", linewidth=0.8, linestyle=":")
        axes.grid(alpha=0.3)
    unit, of_part = "kPa" if rig else "N/mm²", ", part" if rig and not rig.same else ""
    left.set(xlabel=f"travel of the arm's end [mm{of_part}]", ylabel=f"pressure [{unit}{of_part}]")
    right.set(xlabel="arm rotation θ2 [degrees]")
    left.legend(frameon=False)
    return figure
