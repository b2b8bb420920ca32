"""What a user sees while stages run: a live bar on a terminal, plain lines elsewhere, a log beside the artifacts."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn

from pipeline.results.wording import duration
from stages.events import DesignUpdate, Event, LoadStep, Message

COLUMNS = ("update", "C", "C0", "C_chi", "C_A", "C_i", "C_p", "C_psi", "dt", "seconds")
HEADING = f"{'update':>6}{'C':>12}{'C0':>12}" + "".join(f"{name:>10}" for name in (*COLUMNS[3:-1], "time/s"))


def row(record: Mapping[str, float]) -> str:
    """A design update as one line of a table."""
    update, c, c0, *terms, seconds = (record.get(name, float("nan")) for name in COLUMNS)
    return f"{update:6.0f}{c:12.6f}{c0:12.6f}" + "".join(f"{term:10.2e}" for term in terms) + f"{seconds:10.1f}"


#: Columns of a pressure-displacement curve that are shown where a record has them: heading, factor, format.
LOAD_COLUMNS = {
    "load_factor": (f"{'load':>8}", 1.0, "8.4f"),
    "T3": (f"{'T3/mm':>11}", 1.0, "11.5f"),
    "theta2": (f"{'theta2':>9}", math.degrees(1.0), "9.4f"),
    "elongation": (f"{'spring':>9}", 1.0, "9.4f"),
    "energy_ratio": (f"{'energy':>9}", 1.0, "9.4f"),
    "leak": (f"{'leak':>10}", 1.0, "10.2e"),
    "strain_p99": (f"{'strain 99%':>12}", 1.0, "12.4f"),
    "share_above": (f"{'above':>9}", 1.0, "9.4f"),
    "newton": (f"{'Newton':>7}", 1.0, "7.0f"),
}


def load_heading(record: Mapping[str, float]) -> str:
    """The heading of the table that :func:`load_row` makes lines of."""
    return "".join(heading for name, (heading, _, _) in LOAD_COLUMNS.items() if name in record)


def load_row(record: Mapping[str, float]) -> str:
    """A point of a pressure-displacement curve as one line of a table; the angle in degrees."""
    shown = (entry for entry in LOAD_COLUMNS.items() if entry[0] in record)
    return "".join(format(factor * record[name], style) for name, (_, factor, style) in shown)


class PlainDisplay:
    """Lines on a stream that is no terminal."""

    def __init__(self, console: Console) -> None:
        self.console = console

    def line(self, text: str) -> None:
        """Show a line."""
        self.console.print(text, markup=False, emoji=False, highlight=False, soft_wrap=True)

    def progress(self, done: float, limit: int, left: str) -> None:
        """Every row is progress enough."""


class LiveDisplay(PlainDisplay):
    """Lines above a bar on a terminal."""

    def __init__(self, console: Console, bars: Progress, counted: str) -> None:
        super().__init__(console)
        self.bars, self.counted = bars, counted
        self.task: TaskID | None = None

    def progress(self, done: float, limit: int, left: str) -> None:
        """Move the bar."""
        if self.task is None:
            self.task = self.bars.add_task(self.counted, total=limit, left=left)
        finished = done >= limit
        self.bars.update(self.task, completed=done, total=limit, left=left, visible=not finished)


class Reporter:
    """Tells display and log what happens; its :meth:`observe` is the observer of the stages."""

    def __init__(self, display: PlainDisplay, log: logging.Logger) -> None:
        self.display = display
        self.log = log
        self._first: tuple[float, float] | None = None
        self._field = ""

    def say(self, text: str) -> None:
        """A line for the user and the log."""
        self.display.line(text)
        self.log.info(text)

    def observe(self, event: Event) -> None:
        """Show an event of a stage."""
        if isinstance(event, Message):
            self.say(f"  {event.text}")
        elif isinstance(event, DesignUpdate):
            if self._first is None:
                self.say(HEADING)
            self.say(row(event.record))
            done = event.record["update"]
            self.display.progress(done, event.updates_limit, self._time_left(done, event.updates_limit))
        elif isinstance(event, LoadStep):
            if event.field != self._field:
                self._field = event.field
                self.say(load_heading(event.record))
            self.say(load_row(event.record))

    def _time_left(self, done: float, limit: int) -> str:
        """An estimate from the mean of the updates seen so far."""
        now = time.monotonic()
        if self._first is None:
            self._first = (done, now)
        since, start = self._first
        return f"{duration((now - start) / (done - since) * (limit - done))} left" if done > since else ""


@contextmanager
def reporting(log_path: Path, counted: str = "design updates") -> Iterator[Reporter]:
    """A reporter on standard error that appends to a log; ``counted`` is what the bar counts.

    Raises:
        OSError: if the log cannot be written.
    """
    console = Console(stderr=True)
    log = logging.getLogger(f"poro.{log_path}")
    log.setLevel(logging.INFO)
    log.propagate = False
    handler = logging.FileHandler(log_path, encoding="utf-8", errors="backslashreplace")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    try:
        if console.is_terminal:
            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[left]}"),
            )
            with Progress(*columns, console=console, transient=True) as bars:
                yield Reporter(LiveDisplay(console, bars, counted), log)
        else:
            yield Reporter(PlainDisplay(console), log)
    finally:
        log.removeHandler(handler)
        handler.close()
