"""Threads of the element loops and of dense linear algebra."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numba
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from actuator.threads import use_threads


@pytest.fixture
def restored() -> Iterator[None]:
    """Other tests get the threads that they had."""
    before = numba.get_num_threads()
    with threadpool_limits(2, user_api="blas"):
        yield
    numba.set_num_threads(before)


@pytest.mark.parametrize("count", [1, 2, 10_000])
@pytest.mark.usefixtures("restored")
def test_element_loops_have_what_is_there_and_dense_algebra_one(count: int) -> None:
    use_threads(count)
    assert numba.get_num_threads() == min(count, numba.config.NUMBA_NUM_THREADS)
    dense = [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]
    assert set(dense) == {1} or (not dense and sys.platform == "darwin")  # Apple's own BLAS has no such limit
