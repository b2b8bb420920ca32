"""The history of an optimisation: objective and terms after every design update, as a figure and as a table."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pipeline.results.design import OptimisedDesign
from pipeline.store.tables import as_csv
from stages.design import HISTORY

#: Room above and below a curve over its height, and the least term that is drawn over the largest.
ROOM, LEAST = 0.08, 1e-6


def history(design: OptimisedDesign) -> Figure:
    """C and C0, and the other terms, against the number of the design update."""
    columns = design.history
    figure = Figure(figsize=(10.0, 4.2), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(columns["update"], columns["C"], color="#1f4e79", label="C")
    left.plot(columns["update"], columns["C0"], color="#c55a11", label="C0")
    # As long as constraints are far from fulfilled, C is far above what matters later.
    low, high = (float(function(columns["C0"])) for function in (np.min, np.max))
    high = max(high, float(columns["C"][-1]), 0.0)
    room = ROOM * ((high - low) or 1.0)
    left.set(xlabel="design update", ylabel="objective", ylim=(low - room, high + room))
    for name in ("C_A", "C_i", "C_psi", "C_p"):
        right.plot(columns["update"], np.where(columns[name] > 0.0, columns[name], np.nan), label=name)
    right.set(xlabel="design update", ylabel="terms", yscale="log")
    low, high = right.get_ylim()
    right.set_ylim(max(low, LEAST * high), high)
    figure.suptitle(design.name)
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(frameon=False)
    return figure


def history_table(design: OptimisedDesign) -> str:
    """All columns of the history as CSV, with their units in the first line."""
    names = sorted(design.history, key=[*HISTORY, *design.history].index)
    rows = zip(*(design.history[name] for name in names), strict=True)
    heading = (f"{name} [{HISTORY.get(name, '1')}]" for name in names)
    return as_csv(heading, ([f"{value:.10g}" for value in row] for row in rows))
