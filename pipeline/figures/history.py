"""The history of an optimisation: objective and terms after every design update, as a figure and as a table."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from pipeline.results.design import OptimisedDesign
from pipeline.store.tables import as_csv
from stages.design import HISTORY


def history(design: OptimisedDesign) -> Figure:
    """C and C0, and the other terms, against the number of the design update."""
    columns = design.history
    figure = Figure(figsize=(10.0, 4.2), dpi=110, layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(columns["update"], columns["C"], color="#1f4e79", label="C")
    left.plot(columns["update"], columns["C0"], color="#c55a11", label="C0")
    low, high = columns["C0"].min(), max(0.02, float(columns["C0"].max()))
    left.set(xlabel="design update", ylabel="objective", ylim=(1.1 * low if low < 0.0 else low, high))
    for name in ("C_A", "C_i", "C_psi", "C_p"):
        right.plot(columns["update"], np.where(columns[name] > 0.0, columns[name], np.nan), label=name)
    right.set(xlabel="design update", ylabel="terms", yscale="log", ylim=(1e-6, 1e-1))
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
