"""The user's wish to stop, which holds even where the exception that it raises is lost.

Python raises KeyboardInterrupt wherever the program happens to be. In a destructor or in a callback from compiled code
it is dropped, and an optimisation would go on for hours. So it is also noted here and looked up after every update.
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event
from types import FrameType

#: Beside Ctrl-C: terminals and connections that close (SIGHUP; on Windows SIGBREAK), and the warnings of batch systems
#: before they kill (Slurm's --signal, Grid Engine's -notify and s_cpu). Windows does not have most of them.
_NAMES = ("SIGTERM", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGXCPU", "SIGBREAK")
#: Seconds in which several signals are one wish: of a terminal that closes, both shell and system tell.
_ONE_WISH = 1.0

_asked = Event()
_since = 0.0


@contextmanager
def heeded() -> Iterator[None]:
    """Take the signals that ask to stop as the wish to stop while this block runs.

    Left alone are those that somebody else takes or that the process was told to ignore, as ``nohup`` tells it.
    """
    _asked.clear()
    ours = [number for name in _NAMES if (number := getattr(signal, name, None)) and _is_free(number)]
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        ours.append(signal.SIGINT)
    terminals = [stream for stream in (1, 2) if os.isatty(stream)]

    def ask(signum: int, frame: FrameType | None) -> None:
        _leave(terminals)
        _ask(signum)

    before = {number: signal.signal(number, ask) for number in ours}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _is_free(number: signal.Signals) -> bool:
    return number == signal.SIGTERM or signal.getsignal(number) is signal.SIG_DFL


def _leave(terminals: list[int]) -> None:
    """Say nothing more on terminals that are gone: the error of a write would come in the way of what is to be kept."""
    for stream in terminals:
        if not os.isatty(stream):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream)
            os.close(nowhere)


def _ask(signum: int) -> None:
    global _since
    now = time.monotonic()
    if _asked.is_set() and signum != signal.SIGINT and now - _since < _ONE_WISH:
        return
    _since = now
    _asked.set()
    raise KeyboardInterrupt


def raise_if_asked() -> None:
    """Raise what was lost.

    Raises:
        KeyboardInterrupt: if the user has asked to stop.
    """
    if _asked.is_set():
        raise KeyboardInterrupt
