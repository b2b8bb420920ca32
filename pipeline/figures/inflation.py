"""The figure of an inflated part: its displacements over the pressure, beside those of the density field."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pipeline.results.simulation import Curves
from stages.rig import RigUnits

PRINTED, FIELD = "#c55a11", "#1f4e79"
#: Columns that are drawn, with the words beside their axes.
PANELS = {"elongation": "travel of the spring's end [mm]", "T3": "T3 [mm]", "theta2": "arm rotation θ2 [degrees]"}


def inflation(found: Curves, simulation: Curves | None = None, rig: RigUnits | None = None, title: str = "") -> Figure:
    """Travel of the spring's end, T3 and θ2 over the pressure, and the optimiser's values at p_in.

    Args:
        found: the response of the part.
        simulation: of the density field, if there is one; drawn as far as the part's pressure goes.
        rig: draws in kPa and mm of the part; N/mm² and mm of the computed actuator without.
        title: above the figure, such as the name of the part.
    """
    curve = found.curves
    figure = Figure(figsize=(12.0, 4.2), dpi=110, layout="constrained")
    reached = curve["pressure"].max()
    # Every point tells p_in but the first, which has no pressure.
    target = curve["pressure"][-1] / curve["load_factor"][-1] if reached else 0.0
    unit, of_part = "kPa" if rig else "N/mm²", ", part" if rig and not rig.same else ""
    for axes, (name, words) in zip(figure.subplots(1, 3), PANELS.items(), strict=True):
        axes.plot(
            *_shown(name, curve["pressure"], curve[name], rig), "o-", color=PRINTED, markersize=4, label="as printed"
        )
        if simulation:
            field = simulation.curves
            here = (field["loading"] == 1.0) & (field["pressure"] <= reached * (1.0 + 1e-9))
            label = "density field, simulated"
            axes.plot(*_shown(name, field["pressure"][here], field[name][here], rig), "--", color=FIELD, label=label)
        if optimised := found.summary["optimised"]:
            at = _shown(name, target, optimised[name]["optimised"], rig)
            axes.plot(*at, "D", color=FIELD, markersize=7, fillstyle="none", label="optimiser, at p_in")
        axes.axvline(_shown(name, target, 0.0, rig)[0], color="#888888", linewidth=0.8, linestyle=":")
        axes.set(xlabel=f"pressure [{unit}{of_part}]", ylabel=words.replace("mm", f"mm{of_part}"))
        axes.grid(alpha=0.3)
    figure.axes[0].legend(frameon=False)
    figure.suptitle(title)
    return figure


def _shown(name: str, pressure: Any, values: Any, rig: RigUnits | None) -> tuple[Any, Any]:
    """Pressures and values, arrays or numbers, as they are drawn: travel by its size, angles in degrees."""
    pressure, lengths = rig.scaled(pressure, values) if rig else (pressure, values)
    if name == "theta2":
        return pressure, np.degrees(values)
    return pressure, np.abs(lengths) if name == "elongation" else lengths
