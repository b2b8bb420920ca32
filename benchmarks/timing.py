"""Times on a machine that others use too: calls in turn, in one process, medians, and only their ratio is told.

What is taken is the time of the processor, this process's and that of processes it has ended, on one thread: others who
use the machine are in it only as far as they slow it down.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from statistics import median
from time import process_time


def timed(calls: Mapping[str, Callable[[], object]], repeats: int = 5) -> dict[str, list[float]]:
    """Seconds of each call, ascending; all are made once before, and then in turn."""
    for call in calls.values():
        call()
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(repeats):
        for name, call in calls.items():
            began = _processor_seconds()
            call()
            seconds[name].append(_processor_seconds() - began)
    return {name: sorted(times) for name, times in seconds.items()}


def medians(calls: Mapping[str, Callable[[], object]], repeats: int = 5) -> dict[str, float]:
    """Median seconds of each call of :func:`timed`."""
    return {name: median(times) for name, times in timed(calls, repeats).items()}


def _processor_seconds() -> float:
    times = os.times()
    return process_time() + times.children_user + times.children_system
