"""What the paper leaves open, and what each reading of it does to C0: equal CPU time for each from its initial design.

    OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 python -m benchmarks.readings --budget 150

One thread, 2,688 cells, one reading after the other, each changing one thing of case14-eq14-shift: c_r, the shift of χ
in C_Ψ, the elements' quadrature, the pseudo-time steps, the initial design. C0 of a stricter or looser limit is no
better or worse design; what is compared is how far the model lets the actuator bend. Writes a table and a CSV to
``benchmarks/results``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import numpy as np

from actuator.arrays import Floats
from actuator.compilation import compile_kernels
from actuator.equations.scheme import DEFAULT, Scheme
from actuator.optimiser.loop import Optimiser
from actuator.solve.reduced import ReducedObjective
from actuator.threads import use_threads
from benchmarks.tables import Row, markdown, start_log, write_csv, write_markdown
from pipeline.case.model import find_case, read_case
from stages.optimize import Settings

logger = start_log("benchmarks.readings")

#: m, k, layers: 2,688 cells.
MESH = (8, 3, 12)


@dataclass(frozen=True)
class Reading:
    """One way to read the paper.

    Attributes:
        what, value: for the table.
        regularisation: α of c_r = α L² K_s; None for the case's.
        shift: of χ in C_Ψ; None for the printed 4 / L_i in mm.
        scheme: quadrature.
        first_step, longest_step: Δt of the first update, and what no later one exceeds.
        start: changes the points at which the initial design is evaluated, and what is added to χ.
    """

    what: str
    value: str
    regularisation: float | None = None
    shift: float | None = None
    scheme: Scheme = DEFAULT
    first_step: float | None = None
    longest_step: float = np.inf
    start: Callable[[Floats], tuple[Floats, float]] = lambda points: (points, 0.0)


READINGS: Sequence[Reading] = (
    Reading("as printed", "α = 1e-6, shift 4/3, 14 points, Δt = 100 at first"),
    Reading("c_r / (L² K_s)", "5e-7", regularisation=5e-7),
    Reading("c_r / (L² K_s)", "2e-7", regularisation=2e-7),
    Reading("c_r / (L² K_s)", "1e-7", regularisation=1e-7),
    Reading("shift in C_Ψ", "0", shift=0.0),
    Reading("shift in C_Ψ", "8/3", shift=8.0 / 3.0),
    Reading("quadrature", "8 points", scheme=Scheme(quadrature=8)),
    Reading("quadrature", "27 points", scheme=Scheme(quadrature=27)),
    Reading("Δt", "10 at first", first_step=10.0),
    Reading("Δt", "never above 1000", longest_step=1000.0),
    Reading("Δt", "never above 200", longest_step=200.0),
    Reading("initial design", "wall thicker: χ + 1", start=lambda points: (points, 1.0)),
    Reading("initial design", "wall thinner: χ - 1", start=lambda points: (points, -1.0)),
    Reading("initial design", "asymmetry upside down", start=lambda points: (points * [1.0, 1.0, -1.0], 0.0)),
)


def case(reading: Reading, settings: Settings) -> tuple[ReducedObjective, Floats]:
    """The objective as a reading has it, and its initial design."""
    optimizer, material = settings.optimizer, settings.material
    if reading.regularisation is not None:
        material = material.model_copy(update={"hessian_regularisation": reading.regularisation})
    limits = settings.objective.model_copy(
        update={"strain_energy_shift": "4/L_i" if reading.shift is None else reading.shift}
    )
    settings = settings.model_copy(update={"material": material, "objective": limits})
    objective = ReducedObjective(
        settings.domain.build(),
        *settings.parameters(),
        state_tolerance=optimizer.state_tolerance,
        adjoint_tolerance=optimizer.adjoint_tolerance,
        threads=1,
        scheme=reading.scheme,
    )
    domain = objective.domain
    points, more = reading.start(domain.points)
    return objective, domain.initial_design(points, settings.objective.interface_width) + more


def found(reading: Reading, settings: Settings, budget: float, most: int = 1000) -> Row:
    """Design updates from the initial design until the budget of CPU seconds is used, or ``most`` are made."""
    objective, chi = case(reading, settings)
    optimizer = settings.optimizer
    began = process_time()
    search = Optimiser(
        objective,
        first_step=min(reading.first_step or optimizer.first_step, reading.longest_step),
        tolerance=optimizer.stationarity,
        max_inner_steps=optimizer.max_inner_steps,
    )
    progress = search.begin(chi)
    initial = progress.evaluation.measures["energy_ratio"]
    for _ in range(most):
        before = len(progress.history)
        search.run(progress, before)
        progress.dt = min(progress.dt, reading.longest_step)
        if len(progress.history) == before or process_time() - began > budget:
            break
    at, last = progress.evaluation, progress.history[-1]
    return {
        "what": reading.what,
        "value": reading.value,
        "C": at.value,
        "C0": at.terms["C0"],
        "T3 [mm]": last["T3"],
        "θ2 [°]": float(np.degrees(last["theta2"])),
        "max Ψ/Ψ_lim": at.measures["energy_ratio"],
        "the same, initial design": initial,
        "stationarity": last["stationarity"],
        "updates": int(last["update"]),
        "inner steps": int(last["inner"]),
        "CPU s": round(process_time() - began, 1),
    }


def write(rows: Sequence[Row]) -> Path:
    """Table and CSV."""
    write_csv("readings", rows)
    said = "One thread, 2,688 cells, from the initial design, limit 14 %; each row after equal CPU time."
    return write_markdown("readings", "What each reading of the paper does to C0", [said, markdown(rows)])


def main() -> None:
    """Run all readings and write the table, also as it grows."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--budget", type=float, default=150.0, help="CPU seconds of each reading")
    parser.add_argument("--mesh", type=int, nargs=3, default=MESH, metavar=("M", "K", "N1"), help="cells: m, k and N1")
    options = parser.parse_args()
    compile_kernels()
    use_threads(1)
    settings = read_case(find_case(Path("case14.yaml")))[0].optimize
    cells = dict(zip(("core_cells", "rings", "layers"), options.mesh, strict=True))
    settings = settings.model_copy(update={"domain": settings.domain.model_copy(update=cells)})
    rows: list[Row] = []
    for reading in READINGS:
        rows.append(found(reading, settings, options.budget))
        logger.info(markdown(rows[-1:]).splitlines()[-1])
        write(rows)


if __name__ == "__main__":
    main()
