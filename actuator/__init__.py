"""The model and its numerics: domain, material, equilibrium, adjoint, optimiser, linear solvers."""

import hashlib
import os
from pathlib import Path


def _separate_kernel_cache() -> None:
    """Keep compiled kernels apart by the text they were compiled from.

    numba looks only at the file a kernel stands in, not at those whose functions it inlines, and would go on using
    kernels with an old material law. A folder named by all files that hold compiled functions cannot be stale. Who
    sets NUMBA_CACHE_DIR himself is obeyed.
    """
    here = Path(__file__).parent
    sources = (file.read_bytes() for file in sorted(here.rglob("*.py")))
    text = b"".join(source for source in sources if b"from numba import" in source)
    folder = f"kernels-{hashlib.sha256(text).hexdigest()[:16]}"
    os.environ.setdefault("NUMBA_CACHE_DIR", str(_cache(here) / folder))


def _cache(here: Path) -> Path:
    """Beside the code, where it goes when the code goes; the user's own cache if nothing can be written there."""
    if os.access(here, os.W_OK):
        return here / "__pycache__"
    from platformdirs import user_cache_path

    return user_cache_path("poro")


_separate_kernel_cache()
# Two OpenMP libraries take turns here, numba's and MKL's. Idle threads of the one must not spin while the other works.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
