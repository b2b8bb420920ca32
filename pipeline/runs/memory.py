"""Meshes that no memory of this machine can hold are refused before anything is computed."""

from __future__ import annotations

from collections.abc import Iterable

from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.job import Job
from stages.chain import STAGES


def refuse_too_large(job: Job, running: Iterable[str]) -> None:
    """Do nothing if the machine has the memory that the stages about to run need at least.

    Args:
        job: the case and its files.
        running: names of the stages.

    Raises:
        Fault: with the estimate (USAGE).
    """
    import psutil  # only where something runs

    there = psutil.virtual_memory().total
    for stage in running:
        need = STAGES[stage].needs(job.case)
        if need and need.memory > there:
            raise Fault(
                ExitCode.USAGE,
                f"{job.argument}: '{stage}' on {need.cells:,} cells needs at least {_size(need.memory)} of memory and "
                f"this machine has {_size(there)}; {need.remedy}.",
            )


def _size(memory: float) -> str:
    amount = memory / 2**30
    return f"{amount:,.0f} GiB" if amount >= 10.0 else f"{amount:.2g} GiB"
