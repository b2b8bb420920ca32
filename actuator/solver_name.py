"""Table of the direct solvers, apart from the solvers so that settings can name one without loading any."""

from typing import Literal

#: What a case may name; "auto" is the first of :data:`SOLVERS` that is installed.
SolverName = Literal["auto", "pardiso", "superlu"]

#: Module and class of each solver, the fastest first.
SOLVERS = {
    "pardiso": ("actuator.linear.pardiso", "PardisoSolver"),
    "superlu": ("actuator.linear.superlu", "SuperLUSolver"),
}
