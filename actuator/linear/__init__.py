"""Linear algebra of the program: sparse direct solvers behind one interface, and a Krylov method on top of them."""

from __future__ import annotations

from importlib import import_module

from numpy.typing import ArrayLike

from actuator.failure import SolveFailure
from actuator.linear.gmres import KrylovResult, gmres
from actuator.linear.interface import DEFAULT_CHECK, DirectSolver, Precision, Statistics
from actuator.solver_name import SOLVERS, SolverName

__all__ = [
    "DEFAULT_CHECK",
    "DirectSolver",
    "KrylovResult",
    "Precision",
    "SolverName",
    "Statistics",
    "available",
    "gmres",
    "make_solver",
]


def available() -> tuple[str, ...]:
    """Names of the solvers that work on this machine, the fastest first."""
    return tuple(name for name in SOLVERS if _solver(name).installed())


def _solver(name: str) -> type[DirectSolver]:
    module, solver = SOLVERS[name]
    found: type[DirectSolver] = getattr(import_module(module), solver)
    return found


def make_solver(
    indptr: ArrayLike,
    indices: ArrayLike,
    *,
    symmetric: bool,
    positive_definite: bool = False,
    precision: Precision = "double",
    threads: int = 2,
    name: SolverName = "auto",
) -> DirectSolver:
    """A direct solver for this pattern; the arguments are those of :class:`DirectSolver`.

    Args:
        name: "pardiso" (MKL), "superlu" (SciPy), or "auto" for the first of these that is installed.

    Raises:
        SolveFailure: if the solver asked for is unknown or not installed.
        ValueError: if the pattern is malformed.
    """
    chosen = available()[0] if name == "auto" else name
    if chosen not in SOLVERS:
        *most, last = (f"'{known}'" for known in ("auto", *SOLVERS))
        raise SolveFailure(f"There is no linear solver named '{name}': choose {', '.join(most)} or {last}.")
    return _solver(chosen)(
        indptr,
        indices,
        symmetric=symmetric,
        positive_definite=positive_definite,
        precision=precision,
        threads=threads,
    )
