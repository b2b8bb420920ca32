"""Names of the direct solvers, apart from the solvers so that settings can name one without loading any."""

from typing import Literal

SolverName = Literal["auto", "pardiso", "superlu"]
