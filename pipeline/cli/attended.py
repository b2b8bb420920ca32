"""The program as ``poro sweep`` starts it for a case: it stops once the sweep does, however that ends.

Standard input is a pipe whose other end the sweep holds and never writes to. It closes that end to stop the case, and
the system closes it for a sweep that was killed. This needs no signals, which not every system has.
"""

from __future__ import annotations

import os
import signal
import time
from _thread import interrupt_main
from threading import Thread

from pipeline.cli import app

#: Seconds until the case is told again: an interrupt that meets a callback, of a weak reference for instance, is lost.
REPEAT = 10.0


def main() -> None:
    """Run the command line for as long as somebody attends."""
    Thread(target=_attend, daemon=True).start()
    app.main()


def _attend() -> None:
    # Not by sys.stdin, whose lock a thread must not hold when the interpreter ends.
    while os.read(0, 1):
        pass
    while True:
        interrupt_main(signal.SIGTERM)
        time.sleep(REPEAT)


if __name__ == "__main__":
    main()
