"""What the parts of the optimiser are worth: C against CPU time and evaluations for its variants, on the small mesh.

    OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 python -m benchmarks.optimiser      # CPU time of seven times --budget

All variants begin with the paper's initial design and live in one process of one thread, which always advances the one
that has used the least CPU time, by one design update, until all have used the budget: what else the machine does meets
them alike. Setting up a mesh is not counted, but for the coarse mesh of the continuation. Writes a table, a CSV and a
plot to ``benchmarks/results``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import process_time
from typing import Protocol

import numpy as np

from actuator.arrays import Floats
from actuator.compilation import compile_kernels
from actuator.domains.interface import Domain
from actuator.geometry.sampling import sampled
from actuator.optimiser.loop import Optimiser
from actuator.solve.reduced import Evaluation, ReducedObjective
from actuator.threads import use_threads
from benchmarks.gradient_descent import GradientDescent
from benchmarks.tables import RESULTS, Row, markdown, read_csv, start_log, write_csv, write_markdown
from pipeline.case.model import find_case, read_case
from stages.datasets import vtk_order
from stages.domains import DomainSettings
from stages.optimize import Settings

logger = start_log("benchmarks.optimiser")

#: m, k, layers of the coarse mesh, 384 cells, and design updates on it.
COARSE, COARSE_UPDATES = (4, 2, 6), 15
#: Points of the table: parts of the budget, and evaluations.
PARTS, EVALUATIONS = (0.1, 0.2, 0.4, 0.7, 1.0), (5, 10, 20, 30)


#: By variant, one row per accepted design.
Curves = dict[str, list[Row]]


class Search(Protocol):
    """An optimisation that can be advanced by one design update."""

    @property
    def at(self) -> Evaluation: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def finished(self) -> bool: ...

    def update(self) -> None: ...


class Program:
    """The program's optimiser, update by update."""

    def __init__(self, objective: ReducedObjective, chi: Floats, settings: Settings, max_inner_steps: int) -> None:
        optimizer = settings.optimizer
        self._optimiser = Optimiser(
            objective,
            first_step=optimizer.first_step,
            tolerance=optimizer.stationarity,
            max_inner_steps=max_inner_steps,
        )
        self._progress = self._optimiser.begin(chi)
        self.finished = False

    @property
    def at(self) -> Evaluation:
        return self._progress.evaluation

    @property
    def evaluations(self) -> int:
        return self._progress.evaluations

    def update(self) -> None:
        """One accepted design; ``finished`` if it is stationary or no step helps."""
        before = len(self._progress.history)
        self._optimiser.run(self._progress, before)
        self.finished = len(self._progress.history) == before


class Continuation:
    """The program's optimiser on a coarse mesh for a number of updates, then from there on the mesh of the case."""

    def __init__(self, objective: ReducedObjective, settings: Settings, max_inner_steps: int) -> None:
        core, rings, layers = COARSE
        domain = settings.domain.model_copy(update={"core_cells": core, "rings": rings, "layers": layers})
        self._coarse = case(settings, domain)
        self._settings, self._fine, self._max_inner_steps = settings, objective, max_inner_steps
        self._search: Search = Program(self._coarse, start(self._coarse.domain, settings), settings, max_inner_steps)
        self._evaluations, self._updates, self.on_coarse = 0, 0, True

    @property
    def at(self) -> Evaluation:
        return self._search.at

    @property
    def finished(self) -> bool:
        return self._search.finished

    @property
    def evaluations(self) -> int:
        """On both meshes."""
        return self._evaluations + self._search.evaluations

    def update(self) -> None:
        """One accepted design; after the last one on the coarse mesh also the change to the other."""
        self._search.update()
        self._updates += 1
        if self.on_coarse and (self._updates == COARSE_UPDATES or self._search.finished):
            self._evaluations = self._search.evaluations
            chi = prolonged(self._coarse.domain, self._search.at.chi, self._fine.domain)
            self._search = Program(self._fine, chi, self._settings, self._max_inner_steps)
            self.on_coarse = False


def prolonged(coarse: Domain, chi: Floats, fine: Domain) -> Floats:
    """χ at the vertices of another mesh of the same half cylinder, interpolated in the cells, (n_vertices,).

    Vertices between the coarse mesh's facets and the wall take the value below them.
    """
    cells = coarse.cells[:, vtk_order()[:8]]
    scalars, _ = sampled(coarse.points, cells, fine.points, {"chi": chi}, np.zeros((len(chi), 3)), mirrored=True)
    return scalars["chi"]


def case(settings: Settings, domain: DomainSettings) -> ReducedObjective:
    """The objective of a case on a mesh, one thread, tolerances as in the case."""
    optimizer = settings.optimizer
    return ReducedObjective(
        domain.build(),
        *settings.parameters(),
        state_tolerance=optimizer.state_tolerance,
        adjoint_tolerance=optimizer.adjoint_tolerance,
        threads=1,
    )


def start(domain: Domain, settings: Settings) -> Floats:
    """The initial design on a mesh."""
    return domain.initial_design(domain.points, settings.objective.interface_width)


def variants(settings: Settings) -> dict[str, Callable[[ReducedObjective], Search]]:
    """What is compared: from an objective, with nothing done yet, to a search at its initial design."""

    def program(max_inner_steps: int) -> Callable[[ReducedObjective], Search]:
        return lambda objective: Program(objective, start(objective.domain, settings), settings, max_inner_steps)

    def gradients(learns: bool) -> Callable[[ReducedObjective], Search]:
        return lambda objective: GradientDescent(objective, start(objective.domain, settings), learns=learns)

    usual = settings.optimizer.max_inner_steps
    return {
        f"default: at most {usual} inner steps": program(usual),
        "at most 12 inner steps": program(12),
        "at most 120 inner steps": program(120),
        "mesh continuation": lambda objective: Continuation(objective, settings, usual),
        "quasi-Newton, no model": gradients(True),
        "first order, no model": gradients(False),
    }


class Race:
    """All variants, each with its CPU time and what it has found."""

    def __init__(self, settings: Settings, chosen: dict[str, Callable[[ReducedObjective], Search]]) -> None:
        objectives = {name: case(settings, settings.domain) for name in chosen}
        self.seconds: dict[str, float] = {}
        self.curves: Curves = {}
        self._searches: dict[str, Search] = {}
        for name, begin in chosen.items():
            began = process_time()
            self._searches[name] = begin(objectives[name])
            self.seconds[name] = process_time() - began
            self.curves[name] = []
            self._note(name)

    def run(self, budget: float, noted: Callable[[], object]) -> None:
        """Advance whichever has used the least time, until all have used the budget or are finished."""
        milestone = 0.1 * budget
        while behind := {n: s for n, s in self.seconds.items() if s < budget and not self._searches[n].finished}:
            name = min(behind, key=behind.__getitem__)
            began = process_time()
            self._searches[name].update()
            self.seconds[name] += process_time() - began
            self._note(name)
            if min(behind.values()) > milestone:
                milestone += 0.1 * budget
                noted()

    def _note(self, name: str) -> None:
        search = self._searches[name]
        row: Row = {
            "variant": name,
            "cpu_s": round(self.seconds[name], 3),
            "evaluations": search.evaluations,
            "C": search.at.value,
            "C0": search.at.terms["C0"],
            "mesh": "coarse" if isinstance(search, Continuation) and search.on_coarse else "",
        }
        self.curves[name].append(row)
        logger.info(
            " ".join(f"{key}={value:.5g}" if isinstance(value, float) else f"{value}" for key, value in row.items())
        )


def reached(curve: list[Row], column: str, limit: float) -> Row | None:
    """The last design of a curve with no more of a column than this; None before the first, and on a coarse mesh."""
    found = [row for row in curve if _number(row, column) <= limit]
    return found[-1] if found and not found[-1]["mesh"] else None


def _number(row: Row, column: str) -> float:
    return float(str(row[column]))


def _cell(curve: list[Row], column: str, limit: float) -> str:
    """C and C0 at a limit; nothing where the curve has not come so far."""
    row = reached(curve, column, limit)
    ended = _number(curve[-1], column) < limit
    return "" if row is None or ended else f"{_number(row, 'C'):.4f} ({_number(row, 'C0'):.4f})"


def write(curves: Curves) -> Path:
    """Tables, CSV and plot of what there is, up to the least CPU time that a variant has used."""
    budget = min(_number(curve[-1], "cpu_s") for curve in curves.values())
    at_time: list[Row] = [
        {
            "C (C0) at equal CPU time": name,
            **{f"{part * budget:.1f} s": _cell(curve, "cpu_s", part * budget) for part in PARTS},
            "evaluations": (reached(curve, "cpu_s", budget) or {"evaluations": ""})["evaluations"],
        }
        for name, curve in curves.items()
    ]
    at_count: list[Row] = [
        {
            "C (C0) at equal evaluations": name,
            **{f"after {n}": _cell(curve, "evaluations", n) for n in EVALUATIONS},
        }
        for name, curve in curves.items()
    ]
    write_csv("optimiser", [row for curve in curves.values() for row in curve])
    first = median(_number(curve[0], "cpu_s") for curve in curves.values() if not curve[0]["mesh"])
    unit = f"The initial design from rest with its gradient, the first row of each curve, took {first:.2f} s (median)."
    parts = [markdown(at_time), unit, markdown(at_count), "![C against CPU time and evaluations](optimiser.png)"]
    path = write_markdown("optimiser", "Variants of the optimiser, small mesh, one thread", parts)
    _plot(curves)
    return path


def read() -> Curves:
    """The curves of an earlier run."""
    curves: Curves = {}
    for row in read_csv("optimiser"):
        curves.setdefault(row["variant"], []).append(row)
    return curves


def _plot(curves: Curves) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(10, 4.2), layout="constrained", sharey=True)
    for name, curve in curves.items():
        fine = [row for row in curve if not row["mesh"]]
        for axis, column in zip(axes, ("cpu_s", "evaluations"), strict=True):
            axis.plot(*([_number(row, key) for row in fine] for key in (column, "C")), ".-", ms=3, lw=1, label=name)
    axes[0].set(xlabel="CPU seconds", ylabel="C")
    axes[0].set_ylim(top=0.05)
    axes[1].set(xlabel="designs evaluated, of all meshes")
    axes[0].legend(fontsize=7)
    for axis in axes:
        axis.grid(True, alpha=0.3)
    figure.savefig(RESULTS / "optimiser.png", dpi=110)
    pyplot.close(figure)


def main() -> None:
    """Run all variants and write the results, also as they grow."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--budget", type=float, default=90.0, help="CPU seconds of each variant")
    parser.add_argument("--redraw", action="store_true", help="only write the tables and the plot of the CSV anew")
    options = parser.parse_args()
    if options.redraw:
        logger.info(write(read()).read_text(encoding="utf-8"))
        return
    compile_kernels()
    use_threads(1)
    settings = read_case(find_case(Path("quick.yaml")))[0].optimize
    race = Race(settings, variants(settings))
    race.run(options.budget, lambda: write(race.curves))
    logger.info(write(race.curves).read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
