"""One process at a time works on a case in a folder; what a killed one left half written is cleared away.

The lock is one of the operating system, which frees it when its holder ends, however it ends.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime

from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import atomic
from pipeline.store.files import Files

#: Seconds that a claim is tried for: whoever only looks holds the lock for less than a thousandth of one.
_PATIENCE = 0.3


@dataclass(frozen=True)
class Holder:
    """A process that works on a case; what is not known of it is None.

    Attributes:
        pid: its number.
        machine: on which it runs.
        since: when it began, ISO 8601, UTC.
    """

    pid: int | None = None
    machine: str | None = None
    since: str | None = None

    def __str__(self) -> str:
        return "another process" if self.pid is None else f"process {self.pid} on {self.machine}"


@contextmanager
def claimed(files: Files) -> Iterator[None]:
    """Keep other processes from writing the files of a case while the block runs.

    Raises:
        Fault: if another process works on the case in this folder (BUSY).
        OSError: if the folder does not take a lock file.
    """
    import filelock  # slow to load: only where something is written

    lock = filelock.FileLock(files.lock)
    try:
        lock.acquire(timeout=_PATIENCE)
    except filelock.Timeout:
        raise Fault(
            ExitCode.BUSY,
            f"{files.folder}: {_noted(files)} is working on the case '{files.name}' here; wait until it has "
            "ended, or choose another --output.",
        ) from None
    try:
        for left, target in (*atomic.temporaries(files.folder), *atomic.temporaries(files.details)):
            if files.owns(target):
                left.unlink(missing_ok=True)
        # Only to be told: a full disk must not stop what may need no room.
        with contextlib.suppress(OSError):
            now = datetime.now(UTC).isoformat(timespec="seconds")
            atomic.write_text(files.holder, json.dumps(asdict(Holder(os.getpid(), platform.node(), now))))
        yield
    finally:
        with contextlib.suppress(OSError):
            files.holder.unlink()
        lock.release()


def holder(files: Files) -> Holder | None:
    """Who works on the case in this folder at this moment; None if nobody does."""
    if not files.lock.exists():
        return None
    import filelock  # as in claimed

    try:
        with filelock.FileLock(files.lock).acquire(timeout=0):
            return None
    except filelock.Timeout:
        return _noted(files)
    except OSError:  # somebody else's folder, which may only be read
        return _noted(files) if files.holder.exists() else None


def _noted(files: Files) -> Holder:
    try:
        return Holder(**json.loads(files.holder.read_bytes()))
    except (OSError, ValueError, TypeError):
        return Holder()
