"""The figure of a simulation: pressure against displacement, up and down, limit points marked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pipeline.figures.offscreen import reduce_colours
from pipeline.results.simulation import RigUnits, Simulation
from pipeline.store.atomic import replacing

COLOURS = {"density": "#1f4e79", "thresholded": "#c55a11"}


def pressure_displacement(simulation: Simulation, rig: RigUnits | None = None) -> Figure:
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
            _mark(axes, simulation, field, values, pressure)
    unit = "kPa, part" if rig else "N/mm²"
    target = simulation.pressure_in
    if rig:
        target = float(rig.scaled(np.array(target), np.array(0.0))[0])
    for axes in (left, right):
        axes.axhline(target, color="#888888", linewidth=0.8, linestyle=":")
        axes.grid(alpha=0.3)
    left.set(xlabel=f"spring elongation [mm{', part' if rig else ''}]", ylabel=f"pressure [{unit}]")
    right.set(xlabel="arm rotation θ2 [degrees]")
    left.legend(frameon=False)
    return figure


def write(figure: Figure, path: Path) -> None:
    """Write a figure as PNG.

    Raises:
        OSError: if the folder or the disk does not take it.
    """
    canvas = FigureCanvasAgg(figure)
    with replacing(path) as temporary:
        canvas.print_figure(temporary, format="png")
        reduce_colours(temporary)


def _draw(axes: Axes, field: str, values: np.ndarray, pressure: np.ndarray, loading: np.ndarray) -> None:
    colour = COLOURS[field]
    axes.plot(values[loading], pressure[loading], "o-", color=colour, markersize=3, label=f"{field}, up")
    axes.plot(
        values[~loading], pressure[~loading], "x--", color=colour, markersize=5, alpha=0.7, label=f"{field}, down"
    )


def _mark(axes: Axes, simulation: Simulation, field: str, values: np.ndarray, pressure: np.ndarray) -> None:
    curve = simulation.curves[field]
    for limit in simulation.summary["fields"][field]["limit_points"]:
        here = (curve["load_factor"] == limit["load_factor"]) & (curve["loading"] == float(limit["loading"]))
        axes.plot(values[here], pressure[here], "D", color="#b00020", markersize=7, fillstyle="none")
