"""The history of an optimisation: objective and terms after every design update, as a figure and as a table."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from actuator.arrays import Floats
from pipeline.results.design import OptimisedDesign
from pipeline.store.tables import as_csv
from stages.design import HISTORY, unit_of_column

#: Room above and below a curve over its height, and the least term that is drawn over the largest.
ROOM, LEAST = 0.08, 1e-6


def history(design: OptimisedDesign) -> Figure:
    """C and C0, and the other terms, against the number of the design update and against pseudo-time."""
    columns = design.history
    figure = Figure(figsize=(10.0, 8.0), dpi=110, layout="constrained")
    upper, lower = figure.subplots(2, 2, sharey="col")
    for row, over, label in (
        (upper, columns["update"], "design update"),
        (lower, pseudo_time(design), "pseudo-time t"),
    ):
        _against(over, label, columns, *row)
    if len(columns["update"]) > 1:  # at the first design t = 0
        for axes in lower:
            axes.set_xscale("log")
    figure.suptitle(design.name)
    return figure


def pseudo_time(design: OptimisedDesign) -> Floats:
    """t after every design update: the sum of their Δt (Eq. 15)."""
    return np.cumsum(design.history["dt"])


def _against(over: Floats, label: str, columns: Mapping[str, Floats], left: Axes, right: Axes) -> None:
    left.plot(over, columns["C"], color="#1f4e79", label="C")
    left.plot(over, columns["C0"], color="#c55a11", label="C0")
    # As long as constraints are far from fulfilled, C is far above what matters later.
    low, high = (float(function(columns["C0"])) for function in (np.min, np.max))
    high = max(high, float(columns["C"][-1]), 0.0)
    room = ROOM * ((high - low) or 1.0)
    left.set(xlabel=label, ylabel="objective", ylim=(low - room, high + room))
    for name in ("C_A", "C_i", "C_psi", "C_p"):
        right.plot(over, np.where(columns[name] > 0.0, columns[name], np.nan), label=name)
    right.set(xlabel=label, ylabel="terms", yscale="log")
    low, high = right.get_ylim()
    right.set_ylim(max(low, LEAST * high), high)
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)


def history_table(design: OptimisedDesign) -> str:
    """All columns of the history as CSV, with their units in the first line."""
    names = sorted(design.history, key=[*HISTORY, *design.history].index)
    names.insert(names.index("dt") + 1, "pseudo_time")
    columns = {**design.history, "pseudo_time": pseudo_time(design)}
    rows = zip(*(columns[name] for name in names), strict=True)
    heading = (f"{name} [{unit_of_column(name)}]" for name in names)
    return as_csv(heading, ([f"{value:.10g}" for value in row] for row in rows))
