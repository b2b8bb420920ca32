"""How many threads compute."""

from __future__ import annotations

from importlib import import_module

import numba
from threadpoolctl import threadpool_limits


def use_threads(count: int) -> None:
    """Give the element loops of this process ``count`` threads, and dense linear algebra one.

    All that is dense here is small: vectors, and a few dozen columns. The threads of a BLAS wait for such work in a
    loop, and take the processor from those that have some. Direct solvers get their number of threads themselves.
    """
    numba.set_num_threads(min(count, numba.config.NUMBA_NUM_THREADS))
    import_module("scipy.linalg")  # only what is loaded can be limited, and SciPy brings a BLAS of its own
    threadpool_limits(1, user_api="blas")
