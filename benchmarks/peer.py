"""The program beside FElupe, an independent finite-element package: the same problem, results and times side by side.

    pip install 'poro[bench]'
    OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 python -m benchmarks.peer     # about fifteen minutes on one core

poro solves for the state of the initial design at full pressure, with p and the arm among the unknowns. Then both
programs solve Eq. (6) for u from rest, in one load step, with the p of that state held and Γ moved as in that state:
the same mesh, elements, quadrature rule, law and constants, c_r included. Compared are the displacements, the nodal
forces, and whether the reactions on Γ that FElupe finds hold poro's arm in equilibrium, Eq. (8), of which FElupe knows
nothing.

Times are CPU seconds of one thread, medians of several that take turns, as ratios to poro's. Writes a table to
``benchmarks/results``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from importlib.util import find_spec
from statistics import median
from time import process_time
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from actuator.arrays import Floats
from actuator.compilation import compile_kernels
from actuator.linear import SolverName, make_solver
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.state import State
from actuator.threads import use_threads
from benchmarks.given_pressure import GivenPressure, Solution
from benchmarks.tables import Row, markdown, start_log, write_csv, write_markdown
from stages.domains import HalfCylinderSettings
from stages.settings import ProblemSettings

if TYPE_CHECKING:
    from benchmarks.felupe_problem import FelupeProblem

logger = start_log("benchmarks.peer")

#: m, k, layers.
MESHES = {1080: (6, 2, 9), 2688: (8, 3, 12)}
#: Norm of the residual over that of the reactions.
TOLERANCE = 1e-12
LOADS = np.ones(1)
#: SciPy's own solver takes gigabytes on larger meshes than this.
MOST_CELLS = 1500


class SamePattern:
    """poro's direct solver for a package that brings a new matrix each time; analysed once, as poro does.

    Args:
        pattern: upper triangle of all entries that may come.
        name: of the solver.
    """

    def __init__(self, pattern: sp.csr_array, name: SolverName = "auto") -> None:
        self._keys = _keys(pattern)
        self._solver = make_solver(pattern.indptr, pattern.indices, symmetric=True, name=name, threads=1)

    def __call__(self, matrix: Any, right: Floats) -> Floats:
        """Solve with the upper triangle of a symmetric matrix."""
        upper = sp.triu(matrix, format="csr")
        upper.sort_indices()
        data = np.zeros(len(self._keys))
        data[np.searchsorted(self._keys, _keys(upper))] = upper.data
        self._solver.factorise(data)
        return self._solver.solve(right)


def _keys(matrix: Any) -> np.ndarray:
    rows = np.repeat(np.arange(matrix.shape[0], dtype=np.int64), np.diff(matrix.indptr))
    return rows * matrix.shape[1] + matrix.indices


def compare(ours: Solution, theirs: Solution, case: Equilibrium, state: State) -> dict[str, float]:
    """Differences of two solutions, relative to the size of poro's.

    The arm's imbalance is what FElupe's reactions leave of Eq. (8), over the sum of its terms taken positive.
    """
    apart, forces = theirs.displacement - ours.displacement, theirs.nodal - ours.nodal
    kinematics = case.kinematics
    spring = kinematics.spring_force(state.x)
    left = kinematics.force(state.x, theirs.nodal)[-3:] + spring
    size = np.einsum("tij,ti->j", np.abs(kinematics.tip_directions(state.x)), np.abs(theirs.nodal[kinematics.tip]))
    return {
        "largest difference of u": float(np.abs(apart).max() / np.abs(ours.displacement).max()),
        "L2 difference of u": float(np.linalg.norm(apart) / np.linalg.norm(ours.displacement)),
        "L2 difference of nodal forces": float(np.linalg.norm(forces) / np.linalg.norm(ours.nodal)),
        "imbalance of poro's arm under FElupe's reactions": float(np.abs(left / (size + np.abs(spring))).max()),
    }


def measure(mesh: tuple[int, int, int], repeats: int) -> tuple[dict[str, float], dict[str, float], dict[str, Floats]]:
    """Differences, counts, and CPU seconds of everything on one mesh."""
    from benchmarks.felupe_problem import FelupeProblem

    core, rings, layers = mesh
    settings = ProblemSettings(domain=HalfCylinderSettings(core_cells=core, rings=rings, layers=layers))
    domain, (material, load, limits) = settings.domain.build(), settings.parameters()
    case = Equilibrium(domain, material, load, limits, tolerance=1e-11, threads=1)
    chi = domain.initial_design(domain.points, limits.interface_width)
    state = case.solve(chi)
    logger.info(f"{domain.mesh.nelements} cells: state found")
    poro = GivenPressure(case, state)
    felupe = FelupeProblem(domain, material, chi, state.p, case.discretisation.rule)
    pattern = felupe.pattern()
    solver = SamePattern(pattern)

    def from_poro() -> Solution:
        return poro.solve(LOADS, TOLERANCE)

    def from_felupe() -> Solution:
        return felupe.solve(poro.motion, LOADS, TOLERANCE, solver)

    seconds, solutions = _in_turns({"poro": from_poro, "FElupe": from_felupe}, (repeats + 1) // 2)
    ours, theirs = solutions["poro"], solutions["FElupe"]
    figures = compare(ours, theirs, case, state)
    gauss = FelupeProblem(domain, material, chi, state.p, _gauss_27())
    other = gauss.solve(poro.motion, LOADS, TOLERANCE, solver)
    figures["L2 difference of u, FElupe with its 27 points"] = compare(ours, other, case, state)["L2 difference of u"]
    del gauss, other
    counts = {
        "unknowns": pattern.shape[0],
        "Newton steps, poro": ours.iterations,
        "Newton steps, FElupe": theirs.iterations,
        "share of the linear solver, poro": ours.linear_seconds / ours.seconds,
        "share of the linear solver, FElupe": theirs.linear_seconds / theirs.seconds,
    }
    logger.info(f"solutions compared: {figures}")
    seconds.update(_assemblies(poro, felupe, state, ours, repeats))
    seconds.update(_linear_solves(poro, felupe, solver, state, ours, repeats))
    if domain.mesh.nelements <= MOST_CELLS:
        seconds.update(_other_solvers(felupe, pattern, ours))
    case.forget_factors()
    seconds["coupled"] = _in_turns({"coupled": lambda: case.solve(chi)}, 1)[0]["coupled"]
    return figures, counts, seconds


def _gauss_27() -> tuple[Floats, Floats]:
    """FElupe's own rule for this element, on the unit cube."""
    from felupe import GaussLegendre

    rule = GaussLegendre(order=2, dim=3)
    return 0.5 * (rule.points.T + 1.0), rule.weights / 8.0


def _assemblies(
    poro: GivenPressure, felupe: FelupeProblem, state: State, at: Solution, repeats: int
) -> dict[str, Floats]:
    """Forces, and forces with their derivative, at the solution."""
    calls = {
        "poro, forces": lambda: poro.forces(state.x),
        "FElupe, forces": lambda: felupe.forces(at.displacement),
        "poro, tangent": lambda: poro.linearise(state.x, at.nodal),
        "FElupe, tangent": felupe.matrix,
    }
    return _in_turns(calls, repeats)[0]


def _linear_solves(
    poro: GivenPressure, felupe: FelupeProblem, solver: SamePattern, state: State, at: Solution, repeats: int
) -> dict[str, Floats]:
    """One factorisation and solution at the state by solvers that have analysed the pattern before."""
    tangent, (matrix, right) = poro.linearise(state.x, at.nodal), _system(felupe, at)
    calls = {
        "poro, linear": lambda: poro.linear(tangent, right),
        "FElupe, linear": lambda: solver(matrix, right),
    }
    return _in_turns(calls, repeats)[0]


def _other_solvers(felupe: FelupeProblem, pattern: sp.csr_array, at: Solution) -> dict[str, Floats]:
    """The same by SuperLU, which orders the unknowns every time, once."""
    matrix, right = _system(felupe, at)
    symmetric = SamePattern(pattern, "superlu")
    calls = {
        "SuperLU as poro sets it, linear": lambda: symmetric(matrix, right),
        "SciPy's spsolve, linear": lambda: spsolve(matrix, right),
    }
    return _in_turns(calls, 1)[0]


def _system(felupe: FelupeProblem, at: Solution) -> tuple[Any, Floats]:
    felupe.forces(at.displacement)
    matrix = felupe.matrix()[felupe.free][:, felupe.free]
    return matrix, np.cos(np.arange(matrix.shape[0]))


def _in_turns(calls: dict[str, Callable[[], Any]], repeats: int) -> tuple[dict[str, Floats], dict[str, Any]]:
    """CPU seconds of every call, (repeats,) each, and what the last ones returned."""
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    results = {}
    for _ in range(repeats):
        for name, call in calls.items():
            began = process_time()
            results[name] = call()
            seconds[name].append(process_time() - began)
    return {name: np.array(times) for name, times in seconds.items()}, results


#: Rows of the table of times: what, FElupe's call, poro's call.
RATIOS = (
    ("nodal forces", "FElupe, forces", "poro, forces"),
    ("tangent, assembled; poro's with its three blocks of p", "FElupe, tangent", "poro, tangent"),
    (
        "one linear solve, FElupe's matrix in poro's PARDISO, its upper triangle taken out first",
        "FElupe, linear",
        "poro, linear",
    ),
    (
        "one linear solve, SuperLU as poro sets it where MKL is missing",
        "SuperLU as poro sets it, linear",
        "poro, linear",
    ),
    ("one linear solve, SciPy's spsolve, FElupe's default", "SciPy's spsolve, linear", "poro, linear"),
    ("whole solution from rest, both with PARDISO", "FElupe", "poro"),
)


def write(results: dict[int, tuple[dict[str, float], dict[str, float], dict[str, Floats]]]) -> str:
    """The tables, as Markdown and CSV."""
    import felupe

    names = {cells: f"{cells:,} cells" for cells in results}
    accuracy: list[Row] = [
        {"relative to the size of poro's": name, **{names[c]: f"{results[c][0][name]:.1e}" for c in results}}
        for name in next(iter(results.values()))[0]
    ]
    counts: list[Row] = [
        {"count": name, **{names[c]: results[c][1][name] for c in results}} for name in next(iter(results.values()))[1]
    ]
    times: list[Row] = []
    for what, theirs, ours in RATIOS:
        ratios = {
            names[c]: round(median(seconds[theirs]) / median(seconds[ours]), 2) if theirs in seconds else None
            for c, (_, _, seconds) in results.items()
        }
        times.append({"CPU time over poro's": what, **ratios})
    coupled = {names[c]: round(median(s["coupled"]) / median(s["poro"]), 2) for c, (_, _, s) in results.items()}
    times.append({"CPU time over poro's": "for scale: poro's coupled problem, p and the arm unknown", **coupled})
    rows = [
        {"cells": cells, "call": call, "median_s": median(values), "least_s": min(values), "repeats": len(values)}
        for cells, (_, _, seconds) in results.items()
        for call, values in seconds.items()
    ]
    write_csv("peer", rows)
    title = f"poro beside FElupe {felupe.__version__}: displacements for a given pressure"
    path = write_markdown("peer", title, [markdown(accuracy), markdown(counts), markdown(times)])
    return path.read_text(encoding="utf-8")


def main() -> None:
    """Run all meshes and write the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--cells", type=int, nargs="*", choices=list(MESHES), default=list(MESHES))
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    if find_spec("felupe") is None:
        raise SystemExit("This benchmark needs FElupe, which is not installed: pip install 'poro[bench]'.")
    compile_kernels()
    use_threads(1)
    logger.info(write({cells: measure(MESHES[cells], options.repeats) for cells in options.cells}))


if __name__ == "__main__":
    main()
