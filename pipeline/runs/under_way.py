"""How far an optimisation is that has not ended, and who is at it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from pipeline.exit_codes import Fault
from pipeline.results.wording import count, duration
from pipeline.runs import checkpoint
from pipeline.runs.adopted import is_solid
from pipeline.runs.claim import Holder, holder
from pipeline.runs.job import Job, open_job, or_checkpoint
from pipeline.store import artifact

#: Design updates whose mean time is that of the next ones: they take longer as a design gets thin walls.
RECENT = 10


@dataclass(frozen=True)
class Reached:
    """A checkpoint that is farther than what is finished.

    Attributes:
        updates, max_updates: design updates made, and the most that the run would have made.
        last: when the last one was stored, ISO 8601, UTC.
        seconds: per update, lately; None before the first.
    """

    updates: int
    max_updates: int
    last: str
    seconds: float | None

    @property
    def left(self) -> float | None:
        """Seconds until the most updates are made."""
        return None if self.seconds is None else self.seconds * max(0, self.max_updates - self.updates)


@dataclass(frozen=True)
class UnderWay:
    """What happens to a case now.

    Attributes:
        process: that works on it; None if nobody does.
        reached: by an optimisation that has not ended; None if there is none.
    """

    process: Holder | None
    reached: Reached | None

    def as_text(self) -> list[tuple[str, str, str]]:
        """Rows of a table; none if there is nothing to say."""
        rows = []
        if self.process:
            since = f" since {_local(self.process.since)}" if self.process.since else ""
            rows.append(("now", "running", f"{self.process}{since}"))
        elif self.reached:
            rows.append(("now", "interrupted", "run the same command again to continue"))
        if at := self.reached:
            made = f"after {count(at.updates, 'update')} of at most {at.max_updates}, the last at {_local(at.last)}"
            if at.seconds is not None and at.left is not None:
                made += f"; {duration(at.seconds)} each, at most {duration(at.left)} left"
            rows.append(("reached", "unfinished", made))
        return rows

    def as_json(self) -> dict[str, Any] | None:
        """The same for programs; None if there is nothing to say."""
        if not self.process and not self.reached:
            return None
        at = self.reached
        return {
            "state": "running" if self.process else "interrupted",
            "process": asdict(self.process) if self.process else None,
            "updates": at.updates if at else None,
            "max_updates": at.max_updates if at else None,
            "last_update": at.last if at else None,
            "seconds_per_update": at.seconds if at else None,
            "seconds_left_at_most": at.left if at else None,
        }


def artifact_of(source: Path) -> Path:
    """The artifact that is meant by the argument of a command that shows one: of a case, the farthest of its design.

    Raises:
        Fault: if a case is not usable (USAGE).
    """
    if source.suffix in ("", ".yaml", ".yml"):
        return checkpoint.farthest(open_job(source))
    return or_checkpoint(source) if source.suffix == ".h5" else source


def under_way(job: Job) -> UnderWay:
    """What happens to the case of a job now."""
    if is_solid(job.argument):
        return UnderWay(holder(job.files), None)
    path = checkpoint.farthest(job)
    return UnderWay(holder(job.files), _reached(path) if path != job.artifact(checkpoint.OPTIMIZE) else None)


def _reached(path: Path) -> Reached | None:
    try:
        header = artifact.read_header(path)
        updates, seconds = artifact.read(path, checkpoint.STAGE, "progress/updates", "checkpoint/history.seconds")
    except Fault:  # what is wrong with it is for the next run to say, or it has just become the artifact
        return None
    recent = seconds[-1 - RECENT :]
    each = float(recent[-1] - recent[0]) / (len(recent) - 1) if len(recent) > 1 else None
    return Reached(int(updates), int(header.case_resolved["optimizer"]["max_updates"]), header.date, each)


def _local(time: str) -> str:
    """A time as the clock on the wall has it."""
    return f"{datetime.fromisoformat(time).astimezone():%Y-%m-%d %H:%M:%S}"
