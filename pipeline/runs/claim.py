"""One process at a time works on a case in a folder; what a killed one left half written is cleared away.

The lock is one of the operating system, which frees it when its holder ends, however it ends.
"""

from __future__ import annotations

import contextlib
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import atomic
from pipeline.store.files import Files


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
        lock.acquire(timeout=0)
    except filelock.Timeout:
        raise Fault(
            ExitCode.BUSY,
            f"{files.folder}: {_holder(files.holder)} is working on the case '{files.name}' here; wait until it has "
            "ended, or choose another --output.",
        ) from None
    try:
        for left, target in (*atomic.temporaries(files.folder), *atomic.temporaries(files.details)):
            if files.owns(target):
                left.unlink(missing_ok=True)
        # Only for the sentence above: a full disk must not stop what may need no room.
        with contextlib.suppress(OSError):
            files.holder.write_text(f"process {os.getpid()} on {platform.node()}", encoding="utf-8")
        yield
    finally:
        with contextlib.suppress(OSError):
            files.holder.unlink()
        lock.release()


def _holder(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8") or "another process"
    except (OSError, UnicodeDecodeError):
        return "another process"
