"""Summing element entries straight into the data of a fixed sparsity pattern.

The pattern and, for every stored entry, the list of element entries that add up to it are found once. Each later
assembly is a parallel gather: no sorting, no conversion, no race, and the same order of summation for any number
of threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numba import njit, prange
from numpy.typing import NDArray

from actuator.arrays import Floats, Ints


class Gather:
    """Maps a flat buffer of element entries to the data of a CSR matrix.

    Args:
        rows, columns: target of each buffer entry, (n_entries,); negative where the entry is dropped.
        shape: of the matrix.

    Attributes:
        indptr, indices: pattern of the matrix, int32, indices sorted within rows.
    """

    def __init__(self, rows: Ints, columns: Ints, shape: tuple[int, int]) -> None:
        self.shape = shape
        kept = np.flatnonzero((rows >= 0) & (columns >= 0))
        self._order, starts, self.indices, self.indptr = _sorted_pattern(
            rows[kept].astype(np.int32), columns[kept].astype(np.int32), kept.astype(np.int32), shape[0]
        )
        self._starts = starts

    @property
    def nonzeros(self) -> int:
        """Stored entries of the matrix."""
        return len(self.indices)

    def data(self, buffer: Floats, out: Floats | None = None) -> Floats:
        """Data array of the assembled matrix, (nonzeros,)."""
        out = np.empty(self.nonzeros) if out is None else out
        _gather(buffer, self._order, self._starts, out)
        return out

    def matrix(self, data: Floats) -> sp.csr_array:
        """A CSR matrix over ``data``, without a copy."""
        return sp.csr_array((data, self.indices, self.indptr), self.shape, copy=False)


def scatter_vector(elements: NDArray[Any], cells: Ints, size: int) -> NDArray[Any]:
    """Sum element vectors (n_cells, n_local) or (n_cells, n_local, 3) into nodes: (size,) or (size, 3)."""
    if np.iscomplexobj(elements):
        return scatter_vector(elements.real, cells, size) + 1j * scatter_vector(elements.imag, cells, size)
    if elements.ndim == 2:
        return np.bincount(cells.ravel(), elements.ravel(), size)
    index = cells.ravel()
    return np.stack([np.bincount(index, elements[..., i].ravel(), size) for i in range(elements.shape[2])], axis=-1)


def _sorted_pattern(rows: Ints, columns: Ints, entries: Ints, n_rows: int) -> tuple[Ints, Ints, Ints, Ints]:
    bounds = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=n_rows))])
    order = np.empty(len(rows), dtype=np.int32)
    columns_sorted = np.empty(len(rows), dtype=np.int32)
    _bucket(rows, columns, entries, bounds[:-1].copy(), order, columns_sorted)
    counts = np.zeros(n_rows, dtype=np.int64)
    _sort_rows(bounds, order, columns_sorted, counts)
    indptr = np.concatenate([[0], np.cumsum(counts)])
    starts = np.empty(indptr[-1] + 1, dtype=np.int64)
    indices = np.empty(indptr[-1], dtype=np.int32)
    _compress(bounds, columns_sorted, indptr, starts, indices)
    starts[-1] = len(order)
    return order, starts, indices, indptr.astype(np.int32)


@njit(cache=True)
def _bucket(rows, columns, entries, position, order, columns_sorted):
    for k in range(len(rows)):
        at = position[rows[k]]
        order[at] = entries[k]
        columns_sorted[at] = columns[k]
        position[rows[k]] = at + 1


@njit(cache=True, parallel=True)
def _sort_rows(bounds, order, columns, counts):
    for r in prange(len(counts)):
        first, last = bounds[r], bounds[r + 1]
        by_column = np.argsort(columns[first:last], kind="mergesort")  # stable: a fixed order of summation
        columns[first:last] = columns[first:last][by_column]
        order[first:last] = order[first:last][by_column]
        distinct = 0
        for k in range(first, last):
            if k == first or columns[k] != columns[k - 1]:
                distinct += 1
        counts[r] = distinct


@njit(cache=True, parallel=True)
def _compress(bounds, columns, indptr, starts, indices):
    for r in prange(len(bounds) - 1):
        at = indptr[r]
        for k in range(bounds[r], bounds[r + 1]):
            if k == bounds[r] or columns[k] != columns[k - 1]:
                starts[at] = k
                indices[at] = columns[k]
                at += 1


@njit(cache=True, parallel=True)
def _gather(buffer, order, starts, out):
    for k in prange(len(out)):
        value = 0.0
        for i in range(starts[k], starts[k + 1]):
            value += buffer[order[i]]
        out[k] = value
