"""What one design evaluation costs, beside what a user would pick instead.

    python -m benchmarks.evaluation --case case14 --updates 20     # the paper's mesh, about twenty minutes
    python -m benchmarks.evaluation --case quick --updates 20      # the small mesh, about two minutes

In one process and on the same designs (the initial one and the one after the updates):

(a) one unsymmetric factorisation of the full coupled tangent, analysis apart;
(b) one LDLᵀ of the mechanical block, analysis apart, in double and in single precision;
(c) a full evaluation from a warm start as the optimiser makes it, averaged over the updates: state, adjoint, gradient,
    and the factorisation they share with the next update;
and the share of each part of the whole run; ``overhead.py`` tells Python from NumPy. Writes a table to
``benchmarks/results``.
"""

from __future__ import annotations

import argparse
import cProfile
import resource
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats
from actuator.compilation import compile_kernels
from actuator.linear import DirectSolver, make_solver
from actuator.optimiser.inner import InnerProblem
from actuator.optimiser.loop import Optimiser, Progress
from actuator.optimiser.model import Model
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from actuator.solve.state import State
from actuator.threads import use_threads
from benchmarks.tables import markdown, start_log, write_markdown
from pipeline.case.model import find_case, read_case

logger = start_log("benchmarks.evaluation")

#: Where a profile entry belongs, by a part of its function's name or file; the first that fits.
PARTS = (
    ("factorisation and triangular solves", ("pardiso.py", "superlu.py", "interface.py")),
    (
        "assembly",
        ("tangent_kernels.py:tangent", "kernels.py", "assembly.py", "tangent.py", "design_terms.py:design_terms"),
    ),
    ("Krylov and other linear algebra", ("_sparsetools", "csr_mat", "csc_mat", "gmres.py", "dot", "blas", "linalg")),
)


class TimedObjective(ReducedObjective):
    """Adds up the seconds of evaluations and gradients, factorisations left out."""

    seconds = 0.0

    def _factorising(self) -> float:
        return self.equilibrium.statistics.factorisation_seconds

    def evaluate(self, chi: Floats, start: tuple[Floats, Floats] | None = None) -> Evaluation:
        began, factorising = perf_counter(), self._factorising()
        result = super().evaluate(chi, start)
        self.seconds += perf_counter() - began - (self._factorising() - factorising)
        return result

    def gradient(self, at: Evaluation, guess: tuple[Floats, Floats] | None = None) -> Gradient:
        began, factorising = perf_counter(), self._factorising()
        result = super().gradient(at, guess)
        self.seconds += perf_counter() - began - (self._factorising() - factorising)
        return result


def main() -> None:
    """Run the benchmark and write its table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--case", default="case14")
    parser.add_argument("--updates", type=int, default=20)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--solver", default="auto")
    options = parser.parse_args()
    compile_kernels()
    use_threads(options.threads)

    settings, _ = read_case(find_case(Path(f"{options.case}.yaml")))
    objective = TimedObjective(
        settings.domain.build(), *settings.parameters(), solver=options.solver, threads=options.threads
    )
    rows: list[tuple[str, str]] = []
    chi = objective.domain.initial_design(objective.domain.points, settings.objective.interface_width)
    objective.evaluate(chi)  # compiles
    objective.equilibrium.forget_factors()
    began = perf_counter()
    first = objective.evaluate(chi)
    rows.append((f"initial design from rest, {options.threads} thread(s)", f"{perf_counter() - began:.1f} s"))
    optimiser = Optimiser(objective)
    progress = optimiser.begin(chi)
    objective.seconds = 0.0
    work = objective.equilibrium.work
    before = (work.newton, work.krylov, work.factorisations, progress.evaluations)
    solver = objective.equilibrium.statistics
    factorising = solver.factorisation_seconds
    profile = cProfile.Profile()
    began = perf_counter()
    profile.enable()
    outcome = optimiser.run(progress, options.updates, _report)
    profile.disable()
    total = perf_counter() - began
    updates = len(outcome.progress.history) - 1
    evaluations = progress.evaluations - before[3]
    shared = solver.factorisation_seconds - factorising
    warm = (objective.seconds + shared) / evaluations
    counts = (work.newton, work.krylov, work.factorisations)
    per = [(now - then) / evaluations for now, then in zip(counts, before, strict=False)]
    rows.append((f"(c) warm evaluation, mean of {evaluations} in {updates} updates", f"{warm:.2f} s"))
    rows.append(("    of it factorisation", f"{shared / evaluations:.2f} s"))
    names = ("Newton steps", "Krylov iterations", "factorisations")
    rows.append(
        ("    per evaluation", ", ".join(f"{value:.1f} {name}" for name, value in zip(names, per, strict=True)))
    )
    rows.append(("whole run per update", f"{total / updates:.1f} s"))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    for part, seconds in _shares(profile).items():
        rows.append((f"    share of {part}", f"{100 * seconds / total:.1f} %"))
    for name, function in (("the inner problem", InnerProblem.solve), ("gradients of the model", Model.gradient)):
        rows.append((f"    share within {name}", f"{100 * _within(profile, function) / total:.1f} %"))
    for name, state in (("initial", first.state), ("last", progress.evaluation.state)):
        rows += _factorisations(objective.equilibrium, state, name, warm, options)
    rows.append(("peak memory of the run, without (a) and (b)", f"{peak:.2f} GiB"))
    rows.append(("C, C0 at the end", f"{progress.evaluation.value:.6f}, {progress.evaluation.terms['C0']:.6f}"))
    table = markdown({"what": name, "figure": figure} for name, figure in rows)
    title = f"{options.case}, {options.solver}, {options.threads} threads"
    path = write_markdown(f"evaluation-{options.case}-{options.solver}", title, [table])
    logger.info(path.read_text(encoding="utf-8"))


def _report(progress: Progress) -> None:
    record = progress.history[-1]
    names = ("update", "evaluations", "C", "C0", "C_p", "C_psi", "dt", "stationarity", "krylov", "inner", "seconds")
    logger.info(" ".join(f"{name}={record[name]:.5g}" for name in names))


def _factorisations(
    equilibrium: Equilibrium, state: State, name: str, warm: float, options: argparse.Namespace
) -> list[tuple[str, str]]:
    equilibrium.linearise(state)
    tangent = equilibrium.tangent
    rows = []
    if options.solver != "superlu":
        xx, pp = _full(tangent.xx), _full(tangent.pp)
        coupled = sp.csr_array(sp.block_array([[xx, tangent.xp], [tangent.px, pp]], format="csr"))
        coupled.sort_indices()
        solver = make_solver(coupled.indptr, coupled.indices, symmetric=False, threads=options.threads)
        analysis, factorisation = _time(solver, coupled.data)
        rows.append(
            (f"(a) unsymmetric, coupled tangent, {name} design", f"{factorisation:.2f} s (+ {analysis:.2f} s analysis)")
        )
        rows.append((f"    (c) / (a), {name} design", f"{warm / factorisation:.2f}"))
        solver.release()
    gather = tangent.mechanics
    for precision in ("double", "single"):
        solver = make_solver(
            gather.indptr, gather.indices, symmetric=True, precision=precision, threads=options.threads,
            name=options.solver,
        )  # fmt: skip
        analysis, factorisation = _time(solver, tangent.xx.data)
        figure = f"{factorisation:.2f} s (+ {analysis:.2f} s analysis)"
        rows.append((f"(b) LDLᵀ of the mechanical block, {precision}, {name} design", figure))
        solver.release()
    return rows


def _time(solver: DirectSolver, data: Floats) -> tuple[float, float]:
    solver.factorise(data)
    return solver.statistics.analysis_seconds, solver.statistics.factorisation_seconds


def _full(upper: sp.csr_array) -> sp.csr_array:
    return sp.csr_array(upper + upper.T - sp.diags_array(upper.diagonal()))


def _shares(profile: cProfile.Profile) -> dict[str, float]:
    """Seconds by part, from the time spent in each function itself."""
    shares: dict[str, float] = defaultdict(float)
    for entry in profile.getstats():
        code, own = entry.code, entry.inlinetime
        file, function = ("~", code) if isinstance(code, str) else (code.co_filename, code.co_name)
        place = f"{Path(file).name}:{function}"
        compiled = file == "~" or any(name in place for name in ("kernels.py", "_gather", "design_terms.py", ":call"))
        for part, marks in PARTS:
            if compiled and any(mark in place for mark in marks):
                shares[part] += own
                break
        else:
            shares["other compiled code" if compiled else "Python, with NumPy's operators on vectors"] += own
    return dict(shares)


def _within(profile: cProfile.Profile, function: Callable[..., Any]) -> float:
    """Seconds spent in a function and everything it calls."""
    return sum(entry.totaltime for entry in profile.getstats() if entry.code is function.__code__)


if __name__ == "__main__":
    np.seterr(all="ignore")
    main()
