"""Table and plot of what :mod:`benchmarks.work_precision` has measured.

python -m benchmarks.work_precision_report     # once more, from the CSV
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from actuator.arrays import Floats
from benchmarks.tables import RESULTS, Row, markdown, read_csv, write_markdown

NAME = "work_precision"
#: Name of the variant that errors are measured against, on the finest mesh there is.
REFERENCE = "reference"
QUANTITIES = ("T3", "theta2", "C0")
ERRORS = (*QUANTITIES, "gradient")
#: A variant beats the default where no error is larger by more than noise, and time is a fifth less.
EQUAL = 1.01
FASTER = 0.8
#: Highest order that the reference is trusted with: that of the trilinear p and χ and of the polygon round the section.
HIGHEST_ORDER = 2.0
#: Beginnings of the names of variants that solve the same discretised equations as the default.
SAME_DISCRETISATION = ("default", "Newton", "Krylov", "adjoint", "double")
#: Mark and colour of each kind of variant, by the beginning of its name.
MARKS = {
    "default": ("o", "black"),
    "hex8": ("s", "tab:red"),
    "8 points": ("v", "tab:blue"),
    "27 points": ("^", "tab:cyan"),
    "Newton": ("d", "tab:green"),
    "Krylov": ("x", "tab:olive"),
    "adjoint": ("+", "tab:purple"),
    "double": ("p", "tab:gray"),
    "tight": ("1", "tab:brown"),
}


@dataclass
class Line:
    """One line of a table.

    Attributes:
        ratio: of seconds to those of the default on the same mesh.
        errors: relative errors in the order of :data:`ERRORS`, (4,); None if no state was found.
        algebraic: largest of the four against the same discretisation solved tightly, if that was measured.
        front: whether nothing beats it in seconds and in its largest error.
        beats: cells of the meshes on which it beats the default.
    """

    cells: int
    variant: str
    errors: Floats | None = None
    ratio: float = np.nan
    seconds: float = np.nan
    newton: int = 0
    krylov: int = 0
    algebraic: float | None = None
    front: bool = False
    beats: list[int] = field(default_factory=list)

    @property
    def competes(self) -> bool:
        """c_r belongs to the model: changing it solves another problem."""
        return self.errors is not None and not self.variant.startswith("c_r")

    @property
    def largest(self) -> float:
        """Largest of the four errors; not a number if no state was found."""
        return np.nan if self.errors is None else float(np.max(self.errors))

    def shown(self) -> Row:
        """What the table shows."""
        if self.errors is None:
            blank = dict.fromkeys(("seconds", "newton", "krylov", *ERRORS, "algebraic", "front", "beats"))
            return {"cells": self.cells, "variant": self.variant, "time": "no state", **blank}
        return {
            "cells": self.cells,
            "variant": self.variant,
            "time": f"{self.ratio:.2f}",
            "seconds": f"{self.seconds:.2f}",
            "newton": self.newton,
            "krylov": self.krylov,
            **{name: f"{value:.2e}" for name, value in zip(ERRORS, self.errors, strict=True)},
            "algebraic": None if self.algebraic is None else f"{self.algebraic:.0e}",
            "front": "yes" if self.front else "",
            "beats": ", ".join(map(str, self.beats)),
        }


def write_report(rows: Sequence[Row]) -> None:
    """Write ``results/work_precision.md`` and ``.png`` from the rows of the CSV, read or just measured."""
    parts = [
        "Relative errors against the reference of each design; gradient: of the slopes of C0 along six smooth "
        "directions, as a vector. Time: ratio of processor seconds to the default's on the same mesh, one thread; "
        "algebraic: the largest of the four errors against the same discretisation solved tightly. "
        f"'Beats' names the meshes (cells) on which the default needs more than 1/{FASTER} of the time and has none of "
        f"the four errors more than {EQUAL - 1.0:.0%} smaller. 'Front' marks what no other line of the design beats in "
        "seconds and in its largest error. c_r belongs to the model, not to its solution: its lines show how much the "
        "results depend on it and take part in neither. The 8-node element runs through loops over 20 nodes, 12 of "
        "which carry nothing: with loops of its own it would be faster.",
    ]
    panels: dict[str, list[Line]] = {}
    for design in dict.fromkeys(str(row["design"]) for row in rows):
        mine = [row for row in rows if row["design"] == design]
        references = sorted((row for row in mine if row["variant"] == REFERENCE and found(row)), key=cells)
        if not references:
            continue
        parts.append(f"## {design.capitalize()} design\n\n{_reference_text(references)}")
        lines = [line for mesh in sorted({cells(row) for row in mine}) for line in _lines(mine, mesh, references[-1])]
        judge(lines)
        if lines:
            panels[design] = lines
            parts.append(markdown(line.shown() for line in lines))
            won = [f"{line.variant} on {line.cells} cells that on {mesh}" for line in lines for mesh in line.beats]
            parts.append(f"Beats the default: {'; '.join(won) or 'nothing'}.")
    write_markdown(NAME, "Run time against error of one design evaluation", parts)
    if panels:
        _plot(panels)


def found(row: Row) -> bool:
    """Whether a state was found."""
    return row["T3"] not in (None, "")


def cells(row: Row) -> int:
    """Cells of the mesh."""
    return int(str(row["cells"]))


def number(row: Row, key: str) -> float:
    """An entry of a row, be it read or measured."""
    return float(str(row[key]))


def errors(row: Row, reference: Row) -> Floats:
    """Relative errors of :data:`ERRORS`, (4,)."""
    slopes, exact = (np.array([number(r, f"g{k}") for k in range(1, 7)]) for r in (row, reference))
    states = [abs(number(row, name) / number(reference, name) - 1.0) for name in QUANTITIES]
    return np.array([*states, float(np.linalg.norm(slopes - exact) / np.linalg.norm(exact))])


def front(seconds: Floats, error: Floats) -> NDArray[np.bool_]:
    """Which points no other beats in both, (n,)."""
    behind = (seconds[:, None] >= seconds) & (error[:, None] >= error)
    strictly = (seconds[:, None] > seconds) | (error[:, None] > error)
    return ~np.asarray((behind & strictly).any(axis=1))


def judge(lines: Sequence[Line]) -> None:
    """Find the front of one design's lines, and which of them beat the default on which mesh."""
    usable = [line for line in lines if line.competes]
    largest = np.array([line.largest for line in usable])
    for line, at_front in zip(usable, front(np.array([line.seconds for line in usable]), largest), strict=True):
        line.front = bool(at_front)
    for default in (line for line in usable if line.variant == "default"):
        for line in usable:
            ratio = line.ratio if line.cells == default.cells else line.seconds / default.seconds
            if line is not default and beats(ratio, line.errors, default.errors):
                line.beats.append(default.cells)


def beats(ratio: float, error: Floats | None, default: Floats | None) -> bool:
    """Whether a variant is a fifth faster than the default and in none of the four errors worse."""
    if error is None or default is None:
        return False
    return bool(ratio <= FASTER and np.all(error <= EQUAL * default))


def richardson(sizes: Floats, values: Floats) -> tuple[float, float]:
    """Order q and limit v0 of v(h) = v0 + a h^q through three meshes, finest last; not numbers if they do not converge.

    An order above :data:`HIGHEST_ORDER` is a chance of coarse meshes: the limit then is that of this order through the
    two finest.

    Args:
        sizes: h, (3,), in any unit.
        values: (3,).
    """
    first, second = values[1] - values[0], values[2] - values[1]
    if first * second <= 0.0:
        return np.nan, np.nan
    orders = np.linspace(0.2, 6.0, 2901)
    h = sizes[:, None] ** orders
    # The ratio of the differences decides the order.
    mismatch = np.abs((h[1] - h[2]) / (h[0] - h[1]) - second / first)
    order = float(orders[mismatch.argmin()])
    if order == orders[0]:
        return np.nan, np.nan
    trusted = min(order, HIGHEST_ORDER)
    slope = second / (sizes[2] ** trusted - sizes[1] ** trusted)
    return order, float(values[2] - slope * sizes[2] ** trusted)


def _reference_text(references: Sequence[Row]) -> str:
    finest = references[-1]
    text = f"Reference: {cells(finest)} cells ({finest['mesh']}), 27 points, Newton 1e-10, adjoint 1e-10. "
    if len(references) < 3:
        return text + "How good it is cannot be said from fewer than three meshes."
    sizes = np.array([cells(row) ** (-1.0 / 3.0) for row in references[-3:]])
    estimates = []
    for name in QUANTITIES:
        values = np.array([number(row, name) for row in references[-3:]])
        order, limit = richardson(sizes, values)
        change = abs(values[2] / values[1] - 1.0)
        estimates.append(
            f"{name}: changes by {change:.1e} from the mesh before, "
            + (
                "no order seen"
                if np.isnan(order)
                else f"order {order:.1f}, its own error {abs(values[2] / limit - 1):.1e}"
            )
        )
    text += f"An order above {HIGHEST_ORDER:.0f} is not believed: the error then is that for {HIGHEST_ORDER:.0f}. "
    return text + f"From {', '.join(str(cells(row)) for row in references[-3:])} cells: {'; '.join(estimates)}."


def _lines(rows: Sequence[Row], mesh: int, reference: Row) -> list[Line]:
    """The table's lines of one mesh; none if the default has not been measured there."""
    here = [row for row in rows if cells(row) == mesh and row["variant"] != REFERENCE]
    if not any(row["variant"] == "default" and found(row) for row in here):
        return []
    tight = next((row for row in here if row["variant"] == "tight tolerances" and found(row)), None)
    lines = []
    for row in here:
        line = Line(mesh, str(row["variant"]))
        lines.append(line)
        if not found(row):
            continue
        line.errors = errors(row, reference)
        line.ratio, line.seconds = number(row, "ratio"), number(row, "seconds")
        line.newton, line.krylov = int(number(row, "newton")), int(number(row, "krylov"))
        if tight is not None and row is not tight and line.variant.startswith(SAME_DISCRETISATION):
            line.algebraic = float(errors(row, tight).max())
    return lines


def _plot(panels: dict[str, list[Line]]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot, ticker

    figure, grid = pyplot.subplots(len(panels), 2, figsize=(10, 4.2 * len(panels)), layout="constrained", squeeze=False)
    for axes, (design, lines) in zip(grid, panels.items(), strict=True):
        for axis, which, label in ((axes[0], 0, "error of T3"), (axes[1], 3, "error of the gradient")):
            for kind, (mark, colour) in MARKS.items():
                points = [
                    (float(line.errors[which]), line.seconds)
                    for line in lines
                    if line.competes and line.errors is not None and line.variant.startswith(kind)
                ]
                line, size = ("-", 9) if kind == "default" else ("", 6)
                if points:
                    axis.loglog(*zip(*points, strict=True), mark + line, color=colour, label=kind, ms=size, mfc="none")
            axis.set(xlabel=f"relative {label}", ylabel="processor seconds", title=f"{design} design")
            axis.xaxis.set_major_locator(ticker.LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.xaxis.set_major_formatter(ticker.FormatStrFormatter("%g"))
            axis.xaxis.set_minor_formatter(ticker.NullFormatter())
            axis.grid(True, which="both", alpha=0.3)
        axes[1].legend(fontsize=8)
    figure.savefig(RESULTS / f"{NAME}.png", dpi=100)
    pyplot.close(figure)


if __name__ == "__main__":
    write_report(read_csv(NAME))
