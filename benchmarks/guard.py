"""Regression guard: counts and errors that must not grow, and ratios of times to know.

    make bench                                # about three minutes on one core, writes results/bench.csv and bench.md
    python -m benchmarks.guard --reference    # first: what finer meshes say, results/bench-reference.csv

``tests/benchmarks/test_bench.py`` measures the counts and errors again and fails where one is worse than the committed
table allows; ``docs/project/benchmarks.md`` says what to do then.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from time import perf_counter

import numpy as np
import scipy.sparse as sp

from actuator.compilation import compile_kernels
from actuator.linear import SolverName, make_solver
from actuator.optimiser.model import Model
from actuator.threads import use_threads
from benchmarks.figures import COUNT_LEAST, COUNT_PART, ERROR_FACTOR, Figure, ratio
from benchmarks.guard_model import derivative_figures, path_figures, reference_of, state_figures, update_figures
from benchmarks.guard_shape import export_figures, filter_figures, patch_figures
from benchmarks.small_cases import QUICK, SMALL, TINY, Mesh, direction, first_design, problem, reduced_objective
from benchmarks.tables import markdown, read_csv, start_log, write_csv, write_markdown
from benchmarks.timing import medians

NAME, REFERENCE = "bench", "bench-reference"
#: How much finer the mesh is that a mesh is compared with.
FINER: dict[Mesh, int] = {SMALL: 3, QUICK: 2}

logger = start_log("benchmarks.guard")


def cheap(solver: SolverName = "auto") -> Iterator[Figure]:
    """Counts and errors that take seconds."""
    yield from patch_figures()
    yield from filter_figures()
    yield from export_figures()
    yield from state_figures(SMALL, solver, read_reference(SMALL))
    yield from derivative_figures(SMALL, solver)
    yield from update_figures(TINY, 4, solver)
    yield from update_figures(SMALL, 3, solver)
    yield from path_figures(SMALL, solver)


def dear(solver: SolverName = "auto") -> Iterator[Figure]:
    """Counts and errors that take a minute, on the mesh of ``configs/quick.yaml``."""
    yield from state_figures(QUICK, solver, read_reference(QUICK))
    yield from derivative_figures(QUICK, solver)
    yield from update_figures(QUICK, 4, solver)
    yield from path_figures(QUICK, solver)


def ratios() -> Iterator[Figure]:
    """Times of what an optimisation does, over that of one factorisation of the mechanical block."""
    objective = reduced_objective(problem(QUICK))
    equilibrium, d = objective.equilibrium, direction(objective.domain)
    at = objective.evaluate(first_design(objective.domain))
    gradient = objective.gradient(at)
    model = Model(objective, at, gradient)
    start = model.start()
    model.gradient(start)
    tangent, state = equilibrium.tangent, at.state
    xx, pp = (upper + sp.triu(upper, 1).T for upper in (tangent.xx, tangent.pp))
    coupled = sp.csr_array(sp.block_array([[xx, tangent.xp], [tangent.px, pp]], format="csr"))
    coupled.sort_indices()
    unsymmetric = make_solver(coupled.indptr, coupled.indices, symmetric=False, threads=1)
    mechanics = tangent.mechanics
    single = make_solver(mechanics.indptr, mechanics.indices, symmetric=True, precision="single", threads=1)
    matrix = tangent.xx.data.copy()

    def assemble() -> None:
        tangent.assemble(equilibrium.source, equilibrium.coefficients, state.chi, state.x, state.p, state.nodal)

    def evaluate() -> None:
        new = objective.evaluate(at.chi + 0.01 * d, (state.x, state.p))
        objective.gradient(new, gradient.adjoint)

    def differentiate() -> None:
        start.gradient = None  # a point keeps its gradient
        model.gradient(start)

    calls = {
        "factorisation": lambda: single.factorise(matrix),
        "unsymmetric": lambda: unsymmetric.factorise(coupled.data),
        "gradient of the model": differentiate,
        "value of the model": lambda: model(start.delta, start.dx),
        "terms of the design": lambda: objective.design(at.chi),
        "assembly of the tangent": assemble,
    }
    seconds = medians(calls)
    unit, whole = seconds.pop("factorisation"), seconds.pop("unsymmetric")
    yield ratio("unsymmetric factorisation : symmetric one in single precision", whole / unit)
    for name, value in seconds.items():
        yield ratio(f"{name} : symmetric factorisation in single precision", value / unit)
    # By itself, as it takes over the memory of the model's linearisation.
    name = "state and adjoint from a warm start"
    seconds = medians({"factorisation": calls["factorisation"], name: evaluate})
    yield ratio(f"{name} : symmetric factorisation in single precision", seconds[name] / seconds["factorisation"])
    evaluation = seconds["state and adjoint from a warm start"] + unit
    yield ratio("evaluation with its factorisation : unsymmetric factorisation", evaluation / whole)


def committed() -> list[Figure]:
    """The table as it was written last."""
    return [Figure.from_row(row) for row in read_csv(NAME)]


def read_reference(mesh: Mesh) -> dict[str, float]:
    """What :func:`write_reference` stored for a mesh.

    Raises:
        KeyError: if nothing is stored for it.
    """
    for row in read_csv(REFERENCE):
        if row["mesh"] == _spelt(mesh):
            return {name: float(row[name]) for name in ("T3", "theta2", "C0")}
    raise KeyError(f"No reference for the mesh {_spelt(mesh)}: run python -m benchmarks.guard --reference.")


def write_reference() -> None:
    """Solve the initial designs of the meshes on finer ones, and store the answers."""
    rows = [{"mesh": _spelt(mesh), "factor": factor, **reference_of(mesh, factor)} for mesh, factor in FINER.items()]
    write_csv(REFERENCE, rows)


def main() -> None:
    """Measure everything and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--reference", action="store_true", help="compute the answers of the finer meshes instead")
    options = parser.parse_args()
    compile_kernels()
    use_threads(1)
    if options.reference:
        write_reference()
        return
    began = perf_counter()
    figures = [*cheap(), *dear(), *ratios()]
    write_csv(NAME, (figure.row() for figure in figures))
    limits = (
        f"`allowed` is the largest value that passes: a count may grow by {COUNT_PART:.0%} or {COUNT_LEAST}, whichever "
        f"is more, an error to {ERROR_FACTOR:g} times its value, or to what rounding or a tolerance may leave. Ratios "
        "of times, medians of calls in turn on one thread, are not checked."
    )
    path = write_markdown(NAME, "Regression guard", [limits, markdown(figure.row() for figure in figures)])
    logger.info(path.read_text(encoding="utf-8"))
    logger.info(f"{perf_counter() - began:.0f} s")


def _spelt(mesh: Mesh) -> str:
    return "-".join(map(str, mesh))


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()
