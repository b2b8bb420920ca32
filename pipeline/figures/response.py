"""The figure of a simulation: pressure against displacement, up and down, limit points marked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from actuator.arrays import Floats
from pipeline.results.simulation import Curves, RigUnits

COLOURS = {"density": "#1f4e79", "thresholded": "#c55a11"}


def response(simulation: Curves, rig: RigUnits | None = None) -> Figure:
    """Pressure against spring elongation and arm rotation, of all fields.

    Args:
        simulation: curves.
        rig: draws in kPa and mm of a part; N/mm² and mm of the computed actuator without.
    """
    figure = Figure(figsize=(10.0, 4.4), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for field, curve in simulation.curves.items():
        pressure, elongation = curve["pressure"], curve["elongation"]
        if rig:
            pressure, elongation = rig.scaled(pressure, elongation)
        for axes, values in ((left, elongation), (right, np.degrees(curve["theta2"]))):
            _draw(axes, field, values, pressure, curve["loading"] == 1.0)
            _mark(axes, curve, simulation.summary["fields"][field]["limit_points"], values, pressure)
    unit = "kPa, part" if rig else "N/mm²"
    target = simulation.summary["pressure_in"]
    if rig:
        target = float(rig.scaled(np.array(target), np.array(0.0))[0])
    for axes in (left, right):
        axes.axhline(target, color="#888888", linewidth=0.8, linestyle=":")
        axes.grid(alpha=0.3)
    left.set(xlabel=f"spring elongation [mm{', part' if rig else ''}]", ylabel=f"pressure [{unit}]")
    right.set(xlabel="arm rotation θ2 [degrees]")
    left.legend(frameon=False)
    return figure


def _draw(axes: Axes, field: str, values: Floats, pressure: Floats, loading: NDArray[np.bool_]) -> None:
    colour = COLOURS[field]
    axes.plot(values[loading], pressure[loading], "o-", color=colour, markersize=3, label=f"{field}, up")
    axes.plot(
        values[~loading], pressure[~loading], "x--", color=colour, markersize=5, alpha=0.7, label=f"{field}, down"
    )


def _mark(
    axes: Axes, curve: Mapping[str, Floats], limits: list[dict[str, Any]], values: Floats, pressure: Floats
) -> None:
    for limit in limits:
        here = (curve["load_factor"] == limit["load_factor"]) & (curve["loading"] == float(limit["loading"]))
        axes.plot(values[here], pressure[here], "D", color="#b00020", markersize=7, fillstyle="none")
