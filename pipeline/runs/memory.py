"""Meshes that no memory of this machine can hold are refused before anything is computed."""

from __future__ import annotations

from collections.abc import Collection

import stages.optimize
import stages.refine
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store.job import Job


def refuse_too_large(job: Job, running: Collection[str]) -> None:
    """Do nothing if the machine has the memory that the stages about to run need at least.

    Args:
        job: the case and its files.
        running: names of the stages.

    Raises:
        Fault: with the estimate (USAGE).
    """
    import psutil  # only where something runs

    case = job.case
    cells = case.domain.cells
    finer = cells * case.refine.factor**3
    *most, last = (f"domain.{key}" for key in case.domain.counts)
    coarser = f"lower {' or '.join([', '.join(most), last] if most else [last])}"
    needs = {
        "optimize": (cells, stages.optimize.least_memory(cells), coarser),
        "refine": (finer, stages.refine.least_memory(finer), "lower refine.factor"),
        "mirror": (finer, stages.refine.least_memory(finer), "lower refine.factor"),
        "simulate": (cells, stages.optimize.least_memory(cells), coarser),
    }
    if case.simulate.mesh == "refined" and "thresholded" in case.simulate.fields:
        needs["simulate"] = (finer, stages.optimize.least_memory(finer), "set simulate.mesh to optimised")
    there = psutil.virtual_memory().total
    for stage, (count, needed, remedy) in needs.items():
        if stage in running and needed > there:
            raise Fault(
                ExitCode.USAGE,
                f"{job.argument}: '{stage}' on {count:,} cells needs at least {_size(needed)} of memory and this "
                f"machine has {_size(there)}; {remedy}.",
            )


def _size(memory: float) -> str:
    amount = memory / 2**30
    return f"{amount:,.0f} GiB" if amount >= 10.0 else f"{amount:.2g} GiB"
