"""SciPy's SuperLU behind the same interface: slower and larger than PARDISO, and there on every machine."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from actuator.arrays import Floats
from actuator.failure import OutOfMemory, SolveFailure
from actuator.linear.interface import DirectSolver

#: Off-diagonal pivots are taken only below this share of the column's largest entry, so that a symmetric matrix
#: keeps its symmetric ordering (X. S. Li, SuperLU Users' Guide, section 2.4.5).
SYMMETRIC_PIVOT_THRESHOLD = 1e-3


class SuperLUSolver(DirectSolver):
    """LU with partial pivoting of SuperLU, one thread; see :class:`DirectSolver`.

    There is no Cholesky or LDLᵀ and no inertia: a symmetric matrix is expanded to all its entries by a map that is
    computed once. Ordering is part of every factorisation, so the analysis only prepares the map.
    """

    name = "superlu"

    _matrix: sp.csc_array | None = None
    _source: NDArray[np.int32] | None = None
    _factors: Any = None

    def _analyse(self, data: Floats) -> None:
        n = self.size
        if not self.symmetric:
            # Compressed rows of A are compressed columns of its transpose, which is what gets factorised.
            self._matrix = sp.csc_array((data.astype(self._scalar), self.indices, self.indptr), shape=(n, n))
            self._source = None
            return
        entry = np.arange(len(self.indices), dtype=np.int32)
        # Stored positions travel as values, counted from one so that none is lost as a zero.
        upper = sp.csr_array((entry + 1, self.indices, self.indptr), shape=(n, n))
        full = (upper + sp.triu(upper, k=1).T).tocsc()
        full.sort_indices()
        self._source = (full.data - 1).astype(np.int32)
        self._matrix = sp.csc_array((np.empty(full.nnz, self._scalar), full.indices, full.indptr), shape=(n, n))

    def _factorise(self, data: Floats) -> None:
        assert self._matrix is not None
        self._factors = None
        self._matrix.data = (data if self._source is None else data[self._source]).astype(self._scalar, copy=False)
        try:
            if self.symmetric:
                self._factors = splu(
                    self._matrix,
                    permc_spec="MMD_AT_PLUS_A",
                    diag_pivot_thresh=SYMMETRIC_PIVOT_THRESHOLD,
                    options={"SymmetricMode": True},
                )
            else:
                self._factors = splu(self._matrix, permc_spec="COLAMD")
        except RuntimeError as error:
            raise SolveFailure(
                f"The linear solver SuperLU failed in its factorisation ({error}), so the matrix is singular: check "
                "the supports, the material contrast and that no element is inverted."
            ) from error
        except MemoryError as error:
            raise OutOfMemory(
                "The linear solver SuperLU ran out of memory: use a coarser mesh, or install MKL with "
                "'pip install mkl'."
            ) from error
        entries = int(self._factors.nnz)
        self.statistics.factor_entries = entries
        self.statistics.peak_memory = entries * (np.dtype(self._scalar).itemsize + 4)

    def _solve(self, b: Floats, transposed: bool) -> Floats:
        plain = self.symmetric or transposed
        x = self._factors.solve(np.asfortranarray(b, dtype=self._scalar), "N" if plain else "T")
        return np.asfortranarray(x, dtype=np.float64)

    def _release(self) -> None:
        self._factors = self._matrix = self._source = None
