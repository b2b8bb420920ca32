"""What looser tolerances of state and adjoint do to the whole objective of an optimised design and to its gradient.

    python -m benchmarks.tolerances --design case14.h5     # about three minutes on the paper's mesh

:mod:`benchmarks.work_precision` judges tolerances by C0 against the error of the mesh. The optimiser compares values of
C on one mesh, where that error cancels, and C holds the penalties of leak and strain, weighted by 1e6. Here a design is
evaluated on the mesh it was made on, from the state of a neighbour, with several tolerances, and compared with
tight ones; the parameters are the paper's. Writes a table to ``benchmarks/results``.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from time import process_time

import numpy as np

from actuator.arrays import Floats
from actuator.compilation import compile_kernels
from actuator.solve.reduced import Evaluation, ReducedObjective
from actuator.threads import use_threads
from benchmarks.designs import directions
from benchmarks.tables import Row, markdown, start_log, write_markdown
from benchmarks.work_precision import NEIGHBOUR, stored_design
from stages.settings import ProblemSettings

logger = start_log("benchmarks.tolerances")

#: Relative residuals of state and adjoint; the first are the reference, the last but one the program's.
TOLERANCES = ((1e-11, 1e-11), (1e-2, 1e-10), (1e-4, 1e-10), (1e-6, 1e-10), (1e-8, 1e-10), (1e-8, 1e-6))


def main() -> None:
    """Evaluate with all tolerances and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--design", type=Path, required=True, help="artifact of `poro optimize`")
    options = parser.parse_args()
    compile_kernels()
    use_threads(1)
    fixed = stored_design(options.design)
    objective = ReducedObjective(fixed.domain, *ProblemSettings().parameters(), threads=1)
    chi, carried = fixed.on(objective)
    neighbour = objective.evaluate(chi + NEIGHBOUR * directions(fixed.domain)[3], carried).state
    rows: list[Row] = []
    reference: tuple[Evaluation, Floats] | None = None
    for state, adjoint in TOLERANCES:
        work = objective.equilibrium.work
        before = work.newton, work.krylov
        objective.equilibrium.tolerance, objective.adjoint_tolerance = state, adjoint
        objective.equilibrium.forget_factors()
        began = process_time()
        at = objective.evaluate(chi, (neighbour.x, neighbour.p))
        gradient = objective.gradient(at).total
        seconds = process_time() - began
        reference = reference or (at, gradient)
        exact, slopes = reference
        rows.append(
            {
                "state": f"{state:.0e}",
                "adjoint": f"{adjoint:.0e}",
                "Newton steps": work.newton - before[0],
                "Krylov iterations": work.krylov - before[1],
                "seconds": round(seconds, 1),
                **{
                    f"error of {name}": f"{abs(at.terms[name] - exact.terms[name]):.1e}"
                    for name in ("C0", "C_p", "C_psi")
                },
                "error of C": f"{abs(at.value - exact.value):.1e}",
                "relative error of dC/dχ": f"{np.linalg.norm(gradient - slopes) / np.linalg.norm(slopes):.1e}",
            }
        )
        logger.info(" ".join(f"{key}={value}" for key, value in rows[-1].items()))
    write_markdown(
        "tolerances",
        "Tolerances of state and adjoint, and the whole objective",
        [f"C = {reference[0].value:.4f}, {fixed.domain.mesh.nelements} cells." if reference else "", markdown(rows)],
    )


if __name__ == "__main__":
    main()
