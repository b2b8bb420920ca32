"""The optimisation can be continued: what an interrupted run left is found again, and every step is stored at once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs import checkpoint, updates
from pipeline.runs.interruption import raise_if_asked
from pipeline.runs.job import Job
from stages import optimize
from stages.datasets import Packed
from stages.events import Message
from stages.task import Task


def run(job: Job, task: Task, *, fresh: bool, forced: bool) -> Packed:
    """Run the optimisation of a job, on from where an earlier run of the same path ended.

    Args:
        job: the case and its files.
        task: of the stage; its observer is told of every event once what belongs to it is stored.
        fresh: whether to ignore what an interrupted run left.
        forced: whether to ignore the finished artifact.

    Raises:
        Fault: if the user interrupts (INTERRUPTED), or what is there to go on from cannot be used.
        OSError: if the disk does not take a file.
    """
    start = None if fresh else checkpoint.find(job, finished=not forced)
    keeper, history = checkpoint.Keeper(job, start), updates.UpdateKeeper(job, start)

    def observe(event: Any) -> None:
        # Stored before it is shown: what the user has seen is not lost.
        history.observe(event)
        keeper.observe(event)
        task.observer(event)
        raise_if_asked()

    try:
        result = optimize.start(replace(task, observer=observe, resume=start.state if start else None))
    except KeyboardInterrupt:
        raise Fault(ExitCode.INTERRUPTED, f"Interrupted {_where_to_resume(keeper.last)}.") from None
    task.observer(Message(result.reason))
    packed = optimize.pack(result, history.collect(result))
    last = checkpoint.Checkpoint(result.summary["updates"], result.checkpoint)
    return replace(packed, datasets={**packed.datasets, **checkpoint.datasets(last)})


def clear(job: Job) -> None:
    """Remove what a run leaves on its way, once its artifact holds it."""
    job.files.checkpoint.unlink(missing_ok=True)
    updates.clear(job)


def _where_to_resume(last: checkpoint.Checkpoint | None) -> str:
    if last is None:
        return "before the first design update was stored; run the same command to start again"
    return f"after design update {last.updates}, which is stored; run the same command to continue from there"
