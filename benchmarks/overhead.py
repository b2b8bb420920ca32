"""What the program costs outside compiled code: the same calls on 48 cells, where hardly anything else is left.

    python -m benchmarks.overhead       # about two minutes

A profile cannot tell: it books NumPy's vector operations on the Python function that they stand in. Here an
assembly, the state from a warm start with its adjoint, and one gradient and value of the optimiser's model
are timed on the smallest mesh and on the paper's, in one run; the former bounds what Python adds to the latter.
Medians of several. Writes a table to ``benchmarks/results``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from statistics import median
from time import perf_counter

import numpy as np

from actuator.compilation import compile_kernels
from actuator.optimiser.model import Model
from actuator.solve.reduced import ReducedObjective
from actuator.threads import use_threads
from benchmarks.tables import markdown, start_log, write_markdown
from stages.domains import HalfCylinderSettings
from stages.settings import ProblemSettings

logger = start_log("benchmarks.overhead")

#: m, k, layers of the smallest mesh and of the paper's.
MESHES = {"48 cells": (2, 1, 3), "9,504 cells": (12, 5, 18)}
REPEATS = 5


def measure(mesh: tuple[int, int, int], threads: int) -> dict[str, float]:
    """Median seconds of each call on one mesh."""
    core, rings, layers = mesh
    settings = ProblemSettings(domain=HalfCylinderSettings(core_cells=core, rings=rings, layers=layers))
    domain = settings.domain.build()
    objective = ReducedObjective(domain, *settings.parameters(), adjoint_tolerance=1e-8, threads=threads)
    at = objective.evaluate(domain.initial_design(domain.points, settings.objective.interface_width))
    gradient = objective.gradient(at)
    direction = np.cos(domain.points @ [0.25, -0.4, 0.3])

    def evaluate() -> None:
        new = objective.evaluate(at.chi + 0.01 * direction, (at.state.x, at.state.p))
        objective.gradient(new, gradient.adjoint)

    equilibrium, state = objective.equilibrium, at.state

    def assemble() -> None:
        equilibrium.residual(state.chi, state.x, state.p)
        equilibrium.tangent.assemble(
            equilibrium.source, equilibrium.coefficients, state.chi, state.x, state.p, state.nodal
        )

    seconds = {"residual, all tangent blocks and scatter": _median(assemble)}
    seconds["state and adjoint from a warm start"] = _median(evaluate)
    model = Model(objective, at, gradient)
    start = model.start()
    model.gradient(start)

    def differentiate() -> None:
        start.gradient = None  # a point keeps its gradient
        model.gradient(start)

    seconds["gradient of the model"] = _median(differentiate)
    seconds["value of the model"] = _median(lambda: model(start.delta, start.dx))
    return seconds


def _median(call: Callable[[], object]) -> float:
    call()
    times = []
    for _ in range(REPEATS):
        began = perf_counter()
        call()
        times.append(perf_counter() - began)
    return median(times)


def main() -> None:
    """Run both meshes and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    compile_kernels()
    use_threads(options.threads)
    small, large = (measure(mesh, options.threads) for mesh in MESHES.values())
    names = list(MESHES)
    rows = [
        {
            "call": name,
            names[0]: f"{1e3 * seconds:.1f} ms",
            names[1]: f"{1e3 * large[name]:.0f} ms",
            "share": f"{100 * seconds / large[name]:.1f} %",
        }
        for name, seconds in small.items()
    ]
    path = write_markdown("overhead", "Calls on the smallest mesh and on the paper's", [markdown(rows)])
    logger.info(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
