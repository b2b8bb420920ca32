"""What a user sees while stages run: a live bar on a terminal, plain lines elsewhere, a log beside the artifacts."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn

from pipeline.results.wording import duration
from pipeline.runs.growing_table import FINISH, UPDATES, Table, load_table
from pipeline.terminal import broken, coloured, quiet, verbose
from stages.events import Compiled, DesignUpdate, Event, FinishStep, LoadStep, Message


class SilentDisplay:
    """Nothing, for who wants quiet."""

    @property
    def width(self) -> int | None:
        """Columns of the terminal; None where there is none."""
        return None

    def line(self, text: str) -> None:
        """Show a line."""

    def progress(self, done: float, limit: int, left: str, counted: str | None = None) -> None:
        """Show how far the work is; ``counted`` if it is something else than usual."""


class PlainDisplay(SilentDisplay):
    """Lines on a stream that is no terminal; every line is progress enough."""

    def __init__(self, console: Console) -> None:
        self.console = console

    def line(self, text: str) -> None:
        """Show a line."""
        self.console.print(text, markup=False, emoji=False, highlight=False, soft_wrap=True)


class LiveDisplay(PlainDisplay):
    """Lines above a bar on a terminal."""

    def __init__(self, console: Console, bars: Progress, counted: str) -> None:
        super().__init__(console)
        self.bars, self.counted = bars, counted
        self.tasks: dict[str, TaskID] = {}

    @property
    def width(self) -> int:
        """Columns of the terminal as it is now."""
        return self.console.width

    def line(self, text: str) -> None:
        """Show a line, broken between words."""
        super().line(broken(text, self.width))

    def progress(self, done: float, limit: int, left: str, counted: str | None = None) -> None:
        """Move the bar."""
        counted = counted or self.counted
        if counted not in self.tasks:
            self.tasks[counted] = self.bars.add_task(counted, total=limit, left=left)
        finished = done >= limit
        self.bars.update(self.tasks[counted], completed=done, total=limit, left=left, visible=not finished)


#: Marks what the log is told that the user has seen.
_SHOWN = {"shown": True}


class _LogDisplay(logging.Handler):
    """Shows the user what the log alone is told."""

    def __init__(self, display: SilentDisplay) -> None:
        super().__init__()
        self.display = display

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record unless the user has seen it."""
        if not hasattr(record, "shown"):
            self.display.line(self.format(record))


class Reporter:
    """Tells display and log what happens; its :meth:`observe` is the observer of the stages."""

    def __init__(self, display: SilentDisplay, log: logging.Logger) -> None:
        self.display = display
        self.log = log
        self._first: tuple[float, float] | None = None
        self._field = ""
        self._loads = Table({})

    def say(self, text: str, brief: str | None = None) -> None:
        """A line for the user and the log; the user's may be a brief one. What is for the log alone goes there."""
        self.display.line(text if brief is None else brief)
        self.log.info(text, extra=_SHOWN)

    def observe(self, event: Event) -> None:
        """Show an event of a stage."""
        width = self.display.width
        if isinstance(event, Message):
            self.say(f"  {event.text}")
        elif isinstance(event, Compiled):
            self.display.progress(event.done, event.total, "", "compilation")
        elif isinstance(event, DesignUpdate):
            if self._first is None:
                self.say(UPDATES.heading(), UPDATES.heading(width))
            self.say(UPDATES.row(event.record), UPDATES.row(event.record, width))
            done = event.record["update"]
            self.display.progress(done, event.updates_limit, self._time_left(done, event.updates_limit))
        elif isinstance(event, FinishStep):
            if event.record["step"] == 0:
                self.say(FINISH.heading(), FINISH.heading(width))
            self.say(FINISH.row(event.record), FINISH.row(event.record, width))
            self.display.progress(event.record["step"], event.most, "", "steps of the finish")
        elif isinstance(event, LoadStep):
            if event.field != self._field:
                self._field, self._loads = event.field, load_table(event.record)
                self.say(self._loads.heading(), self._loads.heading(width))
            self.say(self._loads.row(event.record), self._loads.row(event.record, width))

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
    log = logging.getLogger(f"poro.{log_path}")
    log.setLevel(logging.INFO)
    log.propagate = False
    handlers: list[logging.Handler] = [logging.FileHandler(log_path, encoding="utf-8", errors="backslashreplace")]
    handlers[0].setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    # Warnings of libraries, which pipeline.cli.app keeps from the terminal.
    of_libraries = logging.getLogger("py.warnings")
    of_libraries.addHandler(handlers[0])
    try:
        with displayed(counted) as display:
            handlers += [_LogDisplay(display)] * verbose()
            for handler in handlers:
                log.addHandler(handler)
            yield Reporter(display, log)
    finally:
        of_libraries.removeHandler(handlers[0])
        for handler in handlers:
            log.removeHandler(handler)
            handler.close()


@contextmanager
def displayed(counted: str) -> Iterator[SilentDisplay]:
    """What shows on standard error how far something is, as the user wants it; ``counted`` is what the bar counts."""
    console = Console(stderr=True, no_color=not coloured(sys.stderr))
    if quiet():
        yield SilentDisplay()
    elif console.is_terminal:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[left]}"),
        )
        with Progress(*columns, console=console, transient=True) as bars:
            yield LiveDisplay(console, bars, counted)
    else:
        yield PlainDisplay(console)
