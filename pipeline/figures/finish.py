"""The figure of a finish: travel against strain, from the part that was exported to the one that keeps its limit."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from actuator.arrays import Floats
from pipeline.figures.inflation import PRINTED
from stages.rig import RigUnits


def finish(history: Mapping[str, Floats], chosen: int, rig: RigUnits, title: str = "") -> Figure:
    """Travel, Ψ over its limit and the share above it, by steps, and travel against Ψ.

    Args:
        history: columns of :data:`stages.finish.HISTORY`.
        chosen: which of the parts was taken.
        rig: lengths of the part.
        title: above the figure.
    """
    figure = Figure(figsize=(12.0, 4.2), dpi=110, layout="constrained")
    travel, ratio = rig.scale * history["travel"], history["energy_ratio"]
    of_part = "" if rig.same else ", part"
    panels = figure.subplots(1, 3)
    panels[0].plot(history["step"], travel, "o-", color=PRINTED, markersize=3)
    panels[0].set(xlabel="step", ylabel=f"travel at p_in [mm{of_part}]")
    panels[1].plot(history["step"], 100.0 * history["share_above"], "o-", color=PRINTED, markersize=3)
    panels[1].set(xlabel="step", ylabel="volume above the strain limit [%]")
    panels[2].plot(ratio, travel, "o-", color=PRINTED, markersize=3)
    panels[2].plot(ratio[chosen], travel[chosen], "D", color="#1f4e79", markersize=8, fillstyle="none", label="taken")
    panels[2].axvline(1.0, color="#888888", linewidth=0.8, linestyle=":")
    panels[2].set(xlabel="Ψ / Ψ_lim, all but the share that may exceed it", ylabel=f"travel at p_in [mm{of_part}]")
    panels[2].legend(frameon=False)
    for axes in panels:
        axes.grid(alpha=0.3)
    figure.suptitle(title)
    return figure
