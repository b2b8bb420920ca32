"""Growth of time and memory of one design evaluation with the mesh, from 1,000 to 30,000 cells.

    python -m benchmarks.scaling        # about ten minutes

Each mesh runs in a process of its own: the paper's initial design from rest at full pressure, state, adjoint and
gradient, twice; the second is timed. Writes a table and a plot to ``benchmarks/results``.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
from time import perf_counter

import numpy as np

from actuator.solve.reduced import ReducedObjective
from actuator.threads import use_threads
from benchmarks.tables import RESULTS, Row, markdown, start_log, write_markdown
from stages.domains import HalfCylinderSettings
from stages.settings import ProblemSettings

logger = start_log("benchmarks.scaling")

#: m, k, layers: much the same shape of cells throughout.
MESHES = ((6, 2, 9), (8, 3, 13), (12, 5, 18), (18, 7, 26))


def measure(core: int, rings: int, layers: int, threads: int) -> dict[str, float]:
    """One evaluation on one mesh, in this process."""
    use_threads(threads)
    settings = ProblemSettings(domain=HalfCylinderSettings(core_cells=core, rings=rings, layers=layers))
    domain = settings.domain.build()
    began = perf_counter()
    objective = ReducedObjective(domain, *settings.parameters(), threads=threads)
    chi = domain.initial_design(domain.points, settings.objective.interface_width)
    setup = perf_counter() - began
    seconds = 0.0
    for _ in range(2):
        objective.equilibrium.forget_factors()
        began = perf_counter()
        evaluation = objective.evaluate(chi)
        objective.gradient(evaluation)
        seconds = perf_counter() - began
    solver = objective.equilibrium.statistics
    return {
        "cells": float(domain.mesh.nelements),
        "unknowns": float(objective.equilibrium.kinematics.size + domain.mesh.nvertices),
        "setup_s": setup,
        "evaluation_s": seconds,
        "factorisation_s": solver.factorisation_seconds / solver.factorisations,
        "solve_s": solver.solve_seconds / solver.solves,
        "factor_entries": float(solver.factor_entries or 0),
        "memory_GiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }


def main() -> None:
    """Run all meshes and write table and plot."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--mesh", type=int, nargs=3, metavar=("CORE", "RINGS", "LAYERS"))
    options = parser.parse_args()
    if options.mesh:
        core, rings, layers = options.mesh
        sys.stdout.write(json.dumps(measure(core, rings, layers, options.threads)))
        return
    rows = []
    for mesh in MESHES:
        command = [
            sys.executable,
            "-m",
            "benchmarks.scaling",
            "--threads",
            str(options.threads),
            "--mesh",
            *map(str, mesh),
        ]
        rows.append(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
        logger.info(" ".join(f"{key}={value:.4g}" for key, value in rows[-1].items()))
    names = list(rows[0])
    cells = np.log([row["cells"] for row in rows])
    exponents = {
        name: float(np.polyfit(cells, np.log([row[name] for row in rows]), 1)[0]) for name in names if name != "cells"
    }
    last: Row = {"cells": "exponent", **{name: f"{exponent:.2f}" for name, exponent in exponents.items()}}
    write_markdown("scaling", "One design evaluation as the mesh grows", [markdown([*rows, last])])
    _plot(rows, exponents)


def _plot(rows: list[dict[str, float]], exponents: dict[str, float]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    cells = [row["cells"] for row in rows]
    for axis, names, label in (
        (axes[0], ("evaluation_s", "factorisation_s", "solve_s"), "seconds"),
        (axes[1], ("memory_GiB",), "peak memory, GiB"),
    ):
        for name in names:
            axis.loglog(cells, [row[name] for row in rows], "o-", label=f"{name}  ~ n^{exponents[name]:.2f}")
        axis.set(xlabel="cells n", ylabel=label)
        axis.grid(True, which="both", alpha=0.3)
        axis.legend()
    figure.savefig(RESULTS / "scaling.png", dpi=110)


if __name__ == "__main__":
    main()
