"""MKL PARDISO through a thin binding: phases apart, nothing copied, every setting explicit.

Settings and error codes: oneMKL Developer Reference, "oneMKL PARDISO - Parallel Direct Sparse Solver Interface".
"""

from __future__ import annotations

import ctypes
import weakref
from ctypes import byref, c_int32, c_void_p
from typing import Any

import numpy as np
from numpy.typing import NDArray

from actuator.arrays import Floats
from actuator.failure import OutOfMemory, SolveFailure
from actuator.linear import mkl
from actuator.linear.interface import DirectSolver

_ERRORS = {
    -1: "the input is inconsistent, which is a fault of this program",
    -2: "there is not enough memory: use a coarser mesh, single precision or a machine with more memory",
    -3: "the reordering failed: check that no row of the matrix is empty",
    -4: "a pivot is zero or not positive, so the matrix is singular or not positive definite: check the supports, "
    "the material contrast and that no element is inverted",
    -5: "an internal error was reported by MKL",
    -6: "the reordering failed before matching and scaling",
    -7: "a diagonal block is singular: check the supports and that every unknown has stiffness",
    -8: "the matrix needs more than 32-bit integers: use a coarser mesh",
    -9: "there is not enough memory for the solution: solve fewer right-hand sides at once",
}
_MEMORY_ERRORS = (-2, -9)

#: Threads that MKL plans its reproducible mode for, whatever number it then uses: one and two give the same factors.
REPRODUCIBLE_THREADS = 8

#: Threads share out the columns of a solve, and each sums up so many of them alike; the last ones, fewer, otherwise.
#: With whole groups for every thread a column's solution is the same for any number of threads.
COLUMNS_AT_ONCE = 4

_ANALYSE, _FACTORISE, _SOLVE, _RELEASE = 11, 22, 33, -1
_PHASES = {_ANALYSE: "analysis", _FACTORISE: "factorisation", _SOLVE: "solve", _RELEASE: "release"}
_CHOLESKY, _SYMMETRIC, _UNSYMMETRIC = 2, -2, 11


class PardisoSolver(DirectSolver):
    """Supernodal LLᵀ, LDLᵀ (Bunch-Kaufman pivots within supernodes) or LU of MKL; see :class:`DirectSolver`.

    Raises:
        SolveFailure: if MKL is not installed.
    """

    name = "pardiso"

    @classmethod
    def installed(cls) -> bool:
        """Whether MKL is there."""
        return mkl.load() is not None

    _data: NDArray[Any] | None = None

    def _open(self) -> None:
        kind = _UNSYMMETRIC if not self.symmetric else _CHOLESKY if self.positive_definite else _SYMMETRIC
        single = self.precision == "single"
        self._session = _Session(kind, self.indptr, self.indices, single=single, threads=self.threads)
        # Runs when this object goes, and at the latest before the interpreter ends.
        weakref.finalize(self, self._session.close)

    def _analyse(self, data: Floats) -> None:
        self._session.close()
        self._session.call(_ANALYSE, data.astype(self._scalar, copy=False))
        self._report()

    def _factorise(self, data: Floats) -> None:
        self._data = data.astype(self._scalar, copy=False)
        self._session.call(_FACTORISE, self._data)
        self._report()
        settings, kind = self._session.settings, self._session.kind
        if kind != _CHOLESKY:
            self.statistics.perturbed_pivots = int(settings[13])
        if kind == _SYMMETRIC:
            self.statistics.positive_eigenvalues = int(settings[21])
            self.statistics.negative_eigenvalues = int(settings[22])
        elif kind == _CHOLESKY:
            self.statistics.positive_eigenvalues, self.statistics.negative_eigenvalues = self.size, 0

    def _report(self) -> None:
        settings = self._session.settings
        self.statistics.factor_entries = int(settings[17])
        self.statistics.operations = 1e6 * float(settings[18])
        self.statistics.peak_memory = 1024 * int(max(settings[14], settings[15] + settings[16]))

    def _solve(self, b: Floats, transposed: bool) -> Floats:
        assert self._data is not None
        self._session.settings[11] = 2 if transposed else 0
        count = b.shape[1]
        rhs = np.asfortranarray(b, dtype=self._scalar)
        if count > 1:
            rhs = np.zeros((self.size, count + -count % (COLUMNS_AT_ONCE * self.threads)), self._scalar, order="F")
            rhs[:, :count] = b
        x = np.empty_like(rhs)
        self._session.call(_SOLVE, self._data, rhs, x)
        return x[:, :count].astype(np.float64, copy=False)

    def _release(self) -> None:
        self._session.close()
        self._data = None


class _Session:
    """What MKL keeps between calls: its handle, its settings, and the pattern they belong to."""

    def __init__(
        self, kind: int, indptr: NDArray[np.int32], indices: NDArray[np.int32], *, single: bool, threads: int
    ) -> None:
        library = mkl.load()
        if library is None:
            raise SolveFailure(
                "The linear solver 'pardiso' needs MKL, which was not found: install it with 'pip install mkl', or "
                "choose 'auto' or 'superlu'."
            )
        self._library = library
        self._threads = threads
        self._indptr, self._indices = indptr, indices
        self._handle = np.zeros(64, dtype=np.int64)
        self._open = False
        self.kind = kind
        self.settings = _settings(kind, single)

    def call(
        self, phase: int, data: NDArray[Any], b: NDArray[Any] | None = None, x: NDArray[Any] | None = None
    ) -> None:
        self._open = True
        error = c_int32(0)
        with mkl.threads(self._library, self._threads):
            self._library.pardiso(
                _address(self._handle),
                byref(c_int32(1)),  # factorisations kept
                byref(c_int32(1)),  # the one meant
                byref(c_int32(self.kind)),
                byref(c_int32(phase)),
                byref(c_int32(len(self._indptr) - 1)),
                _address(data),
                _address(self._indptr),
                _address(self._indices),
                None,  # permutation
                byref(c_int32(1 if b is None else b.shape[1])),
                _address(self.settings),
                byref(c_int32(0)),  # silent
                None if b is None else _address(b),
                None if x is None else _address(x),
                byref(error),
            )
        if error.value:
            reason = _ERRORS.get(error.value, f"MKL reported error {error.value}")
            kind = OutOfMemory if error.value in _MEMORY_ERRORS else SolveFailure
            raise kind(f"The linear solver PARDISO failed in its {_PHASES[phase]}: {reason}.")

    def close(self) -> None:
        """Give all memory back to the system; the next call must be an analysis."""
        if self._open:
            self._open = False
            self.call(_RELEASE, np.zeros(1))
            self._open = False
            self._library.MKL_Free_Buffers()
        self._handle[:] = 0


def _settings(kind: int, single: bool) -> NDArray[np.int32]:
    """MKL's ``iparm``, zero-based."""
    settings = np.zeros(64, dtype=np.int32)
    settings[0] = 1  # nothing is left to MKL's defaults
    settings[1] = 2  # nested dissection (METIS)
    settings[9] = 13 if kind == _UNSYMMETRIC else 8  # smallest pivot is 10^-this times ||A||
    if kind == _UNSYMMETRIC:
        settings[10] = settings[12] = 1  # scaling and weighted matching bring large entries to the diagonal
    settings[17] = settings[18] = -1  # report entries and operations of the factors
    # 1x1 and 2x2 Bunch-Kaufman pivots, and no refinement behind our back: solutions are checked and refined against
    # the caller's matrix in double precision, or not at all where they only precondition.
    settings[20] = 3
    settings[27] = int(single)
    settings[33] = REPRODUCIBLE_THREADS
    settings[34] = 1  # zero-based pattern
    return settings


def _address(array: NDArray[Any]) -> c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)
