"""Finds and loads Intel's MKL from its wheel and gives access to the few functions used here, through ctypes."""

from __future__ import annotations

import ctypes
import ctypes.util
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from pathlib import Path

_LP64 = 0
_THREADING_INTEL = 0
_THREADING_SEQUENTIAL = 1
#: MKL_CBWR_AUTO: the fastest code for this processor, with an order of summation that does not change between runs.
_REPRODUCIBLE = 2


@cache
def load() -> ctypes.CDLL | None:
    """MKL's single dynamic library with 32-bit integers and Intel's OpenMP, or None where there is no MKL."""
    for path in _candidates():
        directory = path.parent
        if sys.platform == "win32" and directory.is_dir():
            os.add_dll_directory(str(directory))
        try:
            library = ctypes.CDLL(str(path))
        except OSError:
            continue
        # Both calls must come before any other; they win over MKL_INTERFACE_LAYER and MKL_THREADING_LAYER. Without
        # Intel's OpenMP beside it MKL would end the process at the first parallel call, so it stays sequential.
        openmp = any(directory.glob("libiomp5*"))
        library.MKL_Set_Interface_Layer(_LP64)
        library.MKL_Set_Threading_Layer(_THREADING_INTEL if openmp else _THREADING_SEQUENTIAL)
        if "MKL_CBWR" not in os.environ:
            library.MKL_CBWR_Set(_REPRODUCIBLE)
        return library
    return None


@contextmanager
def threads(library: ctypes.CDLL, count: int) -> Iterator[None]:
    """Let MKL use ``count`` threads for calls made from this thread in this block; other code is not affected."""
    before = library.MKL_Set_Num_Threads_Local(count)
    try:
        yield
    finally:
        library.MKL_Set_Num_Threads_Local(before)


def _candidates() -> Iterator[Path]:
    def is_runtime(name: str) -> bool:
        return name.startswith(("libmkl_rt.so", "mkl_rt")) and not name.endswith(".lib")

    try:
        for file in metadata.files("mkl") or []:
            if is_runtime(file.name):
                yield Path(str(file.locate())).resolve()
    except metadata.PackageNotFoundError:
        pass
    for directory in (Path(sys.prefix) / "lib", Path(sys.prefix) / "Library" / "bin"):
        yield from sorted(path for path in directory.glob("*mkl_rt*") if is_runtime(path.name))
    found = ctypes.util.find_library("mkl_rt")
    if found:
        yield Path(found)
