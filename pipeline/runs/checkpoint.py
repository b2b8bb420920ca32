"""Checkpoints of the optimisation: written at every design update, found again by the next run of the same case."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import stages.optimize
from pipeline.exit_codes import ExitCode, Fault
from pipeline.runs.job import Job
from pipeline.runs.keys import path_key, plain
from pipeline.store import artifact, contents
from pipeline.store.artifact import Header
from stages.datasets import Dataset
from stages.events import DesignUpdate, Event

#: What checkpoints have in place of a stage, and the stage that they continue.
STAGE, OPTIMIZE = artifact.CHECKPOINT, "optimize"


@dataclass(frozen=True)
class Checkpoint:
    """Where an optimisation can go on.

    Attributes:
        updates: design updates made so far.
        state: the optimiser's named arrays; what they mean is its own business.
    """

    updates: int
    state: dict[str, Any]


class Keeper:
    """Observer that stores every checkpoint; ``last`` is the one on disk."""

    def __init__(self, job: Job, start: Checkpoint | None) -> None:
        self.job = job
        self.last = start
        self.header = path_header(job, STAGE)

    def observe(self, event: Event) -> None:
        """Store the checkpoint of a design update.

        Raises:
            OSError: if the disk does not take it.
        """
        if isinstance(event, DesignUpdate):
            reached = Checkpoint(int(event.record["update"]), event.checkpoint())
            artifact.write(self.job.files.checkpoint, self.header, datasets(reached))
            self.last = reached


def path_header(job: Job, stage: str) -> Header:
    """Header of a file that an optimisation under way leaves; its key is that of the path it takes."""
    resolved = plain(job.case)
    return Header(
        stage=stage,
        stage_version=stages.optimize.VERSION,
        content_key=path_key(resolved, OPTIMIZE, stages.optimize.VERSION),
        identity="",
        upstream_keys=(),
        upstream_identity="",
        case_text=job.case_text,
        case_resolved=resolved,
    )


def datasets(checkpoint: Checkpoint) -> dict[str, Dataset]:
    """A checkpoint as datasets of an artifact."""
    state = {f"checkpoint/{name}": Dataset(value, "", "optimiser") for name, value in checkpoint.state.items()}
    return state | {"progress/updates": Dataset(checkpoint.updates, "1", "design updates made")}


def find(job: Job, *, finished: bool) -> Checkpoint | None:
    """The farthest state from which the case's optimisation can go on; None if there is none.

    Args:
        job: the case and its files.
        finished: whether to look into the finished artifact as well as for an interrupted run.

    Raises:
        Fault: if it has more design updates than the case allows, which a shorter run would replace (USAGE), or if a
            file that may hold one cannot be used, which any run would replace (ARTIFACT).
    """
    found: list[Checkpoint] = []
    places = [(job.files.checkpoint, STAGE)] + [(job.artifact(OPTIMIZE), OPTIMIZE)] * finished
    for path, stage in places:
        try:
            checkpoint = _read(job, path, stage)
        except Fault as fault:
            raise Fault(fault.code, f"{str(fault).removesuffix('.')}, or start over with --fresh.") from None
        if checkpoint:
            _refuse_longer(path, checkpoint.updates, job.case.optimizer.max_updates)
            found.append(checkpoint)
    return max(found, key=lambda checkpoint: checkpoint.updates, default=None)


def farthest(job: Job) -> Path:
    """The file with the farthest state of a job's optimisation: its finished artifact, or the checkpoint of a run.

    A file that the user names is taken as it is. A checkpoint of another path than the case's stands back behind a
    finished artifact, which in turn stands back behind one of this path if it is of another.

    Raises:
        Fault: if the user gave a solid that no design beside it belongs to (USAGE).
    """
    finished, left = job.artifact(OPTIMIZE), job.files.checkpoint
    if job.argument.suffix == ".h5":
        named = job.given is None or job.given.stage == OPTIMIZE
        return job.argument if named else finished
    if job.given and not finished.exists():
        raise Fault(
            ExitCode.USAGE, f"{job.argument}: this is a solid, and no design of it is here; give its case file."
        )
    if not finished.exists():
        return left if left.exists() else finished
    return left if updates_of(job, left, STAGE) > updates_of(job, finished, OPTIMIZE) else finished


def updates_of(job: Job, path: Path, stage: str) -> int:
    """Design updates in a file; -1 if it is missing, unreadable, or of another path than the job's."""
    try:
        return int(artifact.read(path, stage, "progress/updates")[0]) if _same_path(job, path) else -1
    except Fault:
        return -1


def remove_reached(job: Job) -> None:
    """Remove what an interrupted run left, if the finished artifact of the same path is as far or farther.

    Raises:
        Fault: if the finished artifact cannot be read (ARTIFACT).
    """
    try:
        left = _read(job, job.files.checkpoint, STAGE)
    except Fault:  # for the user to look at, not to lose
        return
    reached = _read(job, job.artifact(OPTIMIZE), OPTIMIZE) if left else None
    if left and reached and left.updates <= reached.updates:
        job.files.checkpoint.unlink(missing_ok=True)


def _refuse_longer(path: Path, updates: int, allowed: int) -> None:
    if updates > allowed:
        raise Fault(
            ExitCode.USAGE,
            f"{path}: holds {updates} design updates of this case, more than the {allowed} asked for, and would be "
            "replaced; raise optimizer.max_updates (--updates), choose another --output, or start over with --fresh.",
        )


def _read(job: Job, path: Path, stage: str) -> Checkpoint | None:
    """The checkpoint in a file, unless it is of another path."""
    if not path.exists() or not _same_path(job, path):
        return None
    updates = int(artifact.read(path, stage, "progress/updates")[0])
    return Checkpoint(updates, contents.checkpoint(path, stage))


def _same_path(job: Job, path: Path) -> bool:
    """Whether a file is of the path that a job's optimisation takes."""
    header = artifact.read_header(path)
    key = path_key(plain(job.case), OPTIMIZE, stages.optimize.VERSION)
    return path_key(header.case_resolved, OPTIMIZE, header.stage_version) == key
