"""The user's wish to stop, which holds even where the exception that it raises is lost.

Python raises KeyboardInterrupt wherever the program happens to be. In a destructor or in a callback from compiled code
it is dropped, and an optimisation would go on for hours. So it is also noted here and looked up after every update.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event
from types import FrameType

_asked = Event()


@contextmanager
def heeded() -> Iterator[None]:
    """Take SIGTERM, and SIGINT unless somebody else does, as the wish to stop while this block runs."""
    _asked.clear()
    ours = [signal.SIGTERM]
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        ours.append(signal.SIGINT)
    before = {number: signal.signal(number, _ask) for number in ours}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _ask(signum: int, frame: FrameType | None) -> None:
    _asked.set()
    raise KeyboardInterrupt


def raise_if_asked() -> None:
    """Raise what was lost.

    Raises:
        KeyboardInterrupt: if the user has asked to stop.
    """
    if _asked.is_set():
        raise KeyboardInterrupt
