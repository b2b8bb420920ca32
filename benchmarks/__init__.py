"""Run time against error, scaling, peers and stress; each module is run as ``python -m benchmarks.NAME``."""

# Before the modules import numba, which reads only once where compiled kernels are kept.
import actuator  # noqa: F401
