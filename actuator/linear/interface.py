"""What every sparse direct solver of this program offers: factorise, solve, release."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter
from types import TracebackType
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from actuator.arrays import Floats
from actuator.failure import SolveFailure
from actuator.linear.pattern import Product, check_pattern

Precision = Literal["double", "single"]

#: Residual ||Ax - b|| / ||b|| above which a checked solve fails.
DEFAULT_CHECK = 1e-8

#: Refinement steps a checked solve may take before it fails. Each costs one more pair of triangular solves and
#: happens only while the check is not met; float32 factors gain about five digits a step on a good matrix.
REFINEMENT_STEPS = {"double": 2, "single": 8}


@dataclass
class Statistics:
    """What a solver has done so far. Figures the package does not report are None.

    Attributes:
        factor_entries: stored entries of the factors.
        peak_memory: peak memory of analysis and factorisation, bytes.
        perturbed_pivots: pivots of the last factorisation that were replaced by a small multiple of ||A||.
        positive_eigenvalues, negative_eigenvalues: inertia of a symmetric matrix, from its last factorisation.
        operations: floating-point operations of one factorisation.
        analysis_seconds, factorisation_seconds, solve_seconds: wall time, summed over all calls.
        analyses, factorisations, solves, refinements: number of calls; a right-hand side counts as one solve,
            and ``refinements`` counts the extra solves that a failed residual check has caused.
        residual: largest ||Ax - b|| / ||b|| found by the last checked solve.
    """

    factor_entries: int | None = None
    peak_memory: int | None = None
    perturbed_pivots: int | None = None
    positive_eigenvalues: int | None = None
    negative_eigenvalues: int | None = None
    operations: float | None = None
    analysis_seconds: float = 0.0
    factorisation_seconds: float = 0.0
    solve_seconds: float = 0.0
    analyses: int = 0
    factorisations: int = 0
    solves: int = 0
    refinements: int = 0
    residual: float | None = None

    @contextmanager
    def timed(self, phase: Literal["analysis", "factorisation", "solve"]) -> Iterator[None]:
        """Add the wall time of the block to ``<phase>_seconds``."""
        start = perf_counter()
        try:
            yield
        finally:
            name = f"{phase}_seconds"
            setattr(self, name, getattr(self, name) + perf_counter() - start)


class DirectSolver(ABC):
    """Sparse direct solver for one sparsity pattern and any number of values on it.

    The pattern is in compressed rows, zero-based, columns ascending in each row. A symmetric matrix is given by
    its upper triangle with every diagonal entry stored, zero or not.

    ``data`` is never copied: it is read by :meth:`factorise` and again by the residual check of every solve, so a
    caller who overwrites it before solving must pass ``check=None`` and judge the solution himself.

    Args:
        indptr: row pointers, (n + 1,).
        indices: columns, (nnz,).
        symmetric: the matrix is symmetric and given by its upper triangle.
        positive_definite: the matrix is symmetric positive definite (Cholesky instead of LDLᵀ).
        precision: of the factors; "single" halves their size, the interface stays float64.
        threads: used by the package, if it can use any.

    Raises:
        ValueError: if the pattern is not of this form.
    """

    name: str

    @classmethod
    def installed(cls) -> bool:
        """Whether the package is there."""
        return True

    def __init__(
        self,
        indptr: ArrayLike,
        indices: ArrayLike,
        *,
        symmetric: bool,
        positive_definite: bool = False,
        precision: Precision = "double",
        threads: int = 2,
    ) -> None:
        if positive_definite and not symmetric:
            raise ValueError("a positive definite matrix must be declared symmetric")
        if precision not in REFINEMENT_STEPS:
            raise ValueError(f"precision must be 'double' or 'single', not {precision!r}")
        if threads < 1:
            raise ValueError("threads must be at least 1")
        self.indptr = np.ascontiguousarray(indptr, dtype=np.int32)
        self.indices = np.ascontiguousarray(indices, dtype=np.int32)
        self.size = len(self.indptr) - 1
        check_pattern(self.indptr, self.indices, symmetric)
        self.symmetric = symmetric
        self.positive_definite = positive_definite
        self.precision: Precision = precision
        self.threads = threads
        self._scalar = np.float32 if precision == "single" else np.float64
        self.statistics = Statistics()
        self._analysed = False
        self._factorised = False
        self._product = Product(self.indptr, self.indices, symmetric)
        self._open()

    # ------------------------------------------------------------------ phases

    def factorise(self, data: ArrayLike) -> None:
        """Factorise the matrix with these values, (nnz,) in the order of ``indices``.

        The first time the unknowns are ordered. There the values count where rows are matched and scaled (unsymmetric
        matrices): they should be typical.

        Raises:
            OutOfMemory: if the factors do not fit.
            SolveFailure: if the matrix is not finite, singular, too large, or not positive definite where that was
                promised. A singular matrix that slips through is found by the check of the next solve.
        """
        values = self._values(data)
        self._factorised = False
        if not self._analysed:
            with self.statistics.timed("analysis"):
                self._analyse(values)
            self._analysed = True
            self.statistics.analyses += 1
        self._product.data = values
        with self.statistics.timed("factorisation"):
            self._factorise(values)
        self._factorised = True
        self.statistics.factorisations += 1

    def solve(self, b: ArrayLike, *, transposed: bool = False, check: float | None = DEFAULT_CHECK) -> Floats:
        """Solve A x = b, or Aᵀ x = b, for one right-hand side (n,) or several (n, k).

        Args:
            check: largest allowed ||Ax - b|| / ||b|| of each column. While it is not met the solution is refined
                (:data:`REFINEMENT_STEPS`). None skips the residual: for use as a preconditioner only, where the
                iteration outside judges the result.

        Returns:
            x, of the shape of b; Fortran-ordered if b has several columns.

        Raises:
            SolveFailure: if the check is not met, or nothing has been factorised.
            ValueError: if b has the wrong length.
        """
        if not self._factorised:
            raise SolveFailure("There is no factorisation to solve with: call factorise(data) first.")
        rhs = np.asarray(b, dtype=np.float64)
        if rhs.ndim not in (1, 2) or rhs.shape[0] != self.size:
            raise ValueError(f"the right-hand side has shape {rhs.shape}, the matrix has {self.size} rows")
        transposed = transposed and not self.symmetric
        columns = np.asfortranarray(rhs.reshape(self.size, -1))
        with self.statistics.timed("solve"):
            x = self._solve(columns, transposed)
            self.statistics.solves += columns.shape[1]
            if check is not None:
                self._refine(x, columns, transposed, check)
        return x[:, 0] if rhs.ndim == 1 else x

    def release(self) -> None:
        """Give back all memory of analysis and factors. A later :meth:`factorise` starts anew."""
        self._analysed = self._factorised = False
        self._product.data = None
        self._release()

    # ---------------------------------------------------------------- package

    def _open(self) -> None:  # noqa: B027 - a hook, which few packages need
        """Begin with the package, once the pattern is known; most need nothing for that."""

    @abstractmethod
    def _analyse(self, data: Floats) -> None: ...

    @abstractmethod
    def _factorise(self, data: Floats) -> None: ...

    @abstractmethod
    def _solve(self, b: Floats, transposed: bool) -> Floats:
        """Solution in a new Fortran-ordered array; b is (n, k), Fortran-ordered, and stays as it is."""

    @abstractmethod
    def _release(self) -> None: ...

    # ---------------------------------------------------------------- details

    def _values(self, data: ArrayLike) -> Floats:
        values = np.ascontiguousarray(data, dtype=np.float64)
        if values.shape != self.indices.shape:
            raise ValueError(f"{values.shape} values were given for a pattern of {len(self.indices)} entries")
        largest = np.finfo(self._scalar).max
        if not np.maximum(values.max(initial=0.0), -values.min(initial=0.0)) <= largest:  # nor if it is not a number
            raise SolveFailure(
                f"The matrix has entries that are not finite or too large for {self.precision} precision: take a "
                "smaller step from the last state, or check the units of the case."
            )
        return values

    def _refine(self, x: Floats, b: Floats, transposed: bool, check: float) -> None:
        norm = np.linalg.norm(b, axis=0)
        norm[norm == 0.0] = 1.0
        for step in range(REFINEMENT_STEPS[self.precision] + 1):
            residual = b - self._product(x, transposed)
            relative = np.linalg.norm(residual, axis=0) / norm
            self.statistics.residual = float(relative.max(initial=0.0))
            if self.statistics.residual <= check:
                return
            if step == REFINEMENT_STEPS[self.precision] or not np.isfinite(self.statistics.residual):
                break
            x += self._solve(np.asfortranarray(residual), transposed)
            self.statistics.refinements += b.shape[1]
        pivots = self.statistics.perturbed_pivots
        pivots_seen = f" ({pivots} pivots were perturbed)" if pivots else ""
        raise SolveFailure(
            f"The linear solve left a relative residual of {self.statistics.residual:.1e}, more than the allowed "
            f"{check:.0e}{pivots_seen}: the matrix is singular or too ill-conditioned, check supports, material "
            "contrast and step size."
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()
