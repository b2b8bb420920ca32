"""Sparsity patterns in compressed rows: their validity, and products with the values stored on them."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from actuator.arrays import Floats


class Product:
    """A x and Aᵀ x on the caller's arrays, without forming the missing triangle of a symmetric matrix."""

    def __init__(self, indptr: NDArray[np.int32], indices: NDArray[np.int32], symmetric: bool) -> None:
        self._symmetric = symmetric
        n = len(indptr) - 1
        nothing = np.zeros(len(indices))
        self._rows = sp.csr_array((nothing, indices, indptr), shape=(n, n))
        self._columns = sp.csc_array((nothing, indices, indptr), shape=(n, n))
        self._diagonal = indptr[:-1]
        self.data = None

    @property
    def data(self) -> Floats | None:
        return self._data

    @data.setter
    def data(self, data: Floats | None) -> None:
        self._data = data
        self._rows.data = self._columns.data = np.empty(0) if data is None else data

    def __call__(self, x: Floats, transposed: bool) -> Floats:
        if self._symmetric:
            diagonal = self._rows.data[self._diagonal]
            return np.asarray(self._rows @ x + self._columns @ x - diagonal[:, None] * x)
        return np.asarray((self._columns if transposed else self._rows) @ x)


def check_pattern(indptr: NDArray[np.int32], indices: NDArray[np.int32], symmetric: bool) -> None:
    """Refuse a pattern that a solver would misread.

    Raises:
        ValueError: if it is not in compressed rows with ascending columns, or, for a symmetric matrix, not the
            upper triangle with the whole diagonal.
    """
    n = len(indptr) - 1
    if n < 1 or indptr[0] != 0 or indptr[-1] != len(indices) or np.any(np.diff(indptr) < 0):
        raise ValueError("indptr must start at 0, never decrease and end at the number of entries")
    if len(indices) and not (indices.min() >= 0 and indices.max() < n):
        raise ValueError("a column index lies outside the matrix")
    row_starts = np.zeros(len(indices) + 1, dtype=bool)
    row_starts[indptr] = True
    if not np.all((np.diff(indices) > 0) | row_starts[1:-1]):
        raise ValueError("the columns of each row must be ascending and without duplicates")
    if symmetric and not (np.all(np.diff(indptr) > 0) and np.array_equal(indices[indptr[:-1]], np.arange(n))):
        raise ValueError("a symmetric matrix is given by its upper triangle with the whole diagonal stored")
