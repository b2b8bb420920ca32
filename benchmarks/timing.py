"""Times on a machine that others use too: calls in turn, in one process, medians, and only their ratio is told."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import median
from time import perf_counter


def timed(calls: Mapping[str, Callable[[], object]], repeats: int = 5) -> dict[str, list[float]]:
    """Seconds of each call, ascending; all are made once before, and then in turn."""
    for call in calls.values():
        call()
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(repeats):
        for name, call in calls.items():
            began = perf_counter()
            call()
            seconds[name].append(perf_counter() - began)
    return {name: sorted(times) for name, times in seconds.items()}


def medians(calls: Mapping[str, Callable[[], object]], repeats: int = 5) -> dict[str, float]:
    """Median seconds of each call of :func:`timed`."""
    return {name: median(times) for name, times in timed(calls, repeats).items()}
