"""Run time against error, scaling, peers and stress; each module is run as ``python -m benchmarks.NAME``."""
