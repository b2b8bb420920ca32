"""The numbers of the columns that are used, and what had to be left out on the way."""

from __future__ import annotations

import math
from array import array
from bisect import bisect_right
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from actuator.arrays import Floats, Ints
from pipeline.exit_codes import Fault, shown
from pipeline.measured.cells import clock, is_value
from pipeline.measured.table import Table

#: Largest share of rows whose times may be out of order and are left out: more is another recording, or another order.
OUT_OF_ORDER = 0.05
HALF_DAY, DAY, HALF_HOUR, HOUR = 43200.0, 86400.0, 1800.0, 3600.0


@dataclass(frozen=True)
class LeftOut:
    """Rows that are not used.

    Attributes:
        why: what is wrong with them, after "rows".
        count: of them.
        line: of the first in its file.
        text: what stands there.
    """

    why: str
    count: int
    line: int
    text: str

    def __str__(self) -> str:
        """As a part of a sentence."""
        return f"{counted(self.count, 'row')} {self.why}, first in line {self.line}: '{self.text}'"


@dataclass(frozen=True)
class Rows:
    """The rows of a table that hold a number in each column that is used.

    Attributes:
        values: by index of the column, (n,) each.
        lines: of the file, (n,).
        left_out: what is wrong with the others.
        clock: whether the times are those of a clock, in s.
    """

    values: dict[int, Floats]
    lines: Ints
    left_out: tuple[LeftOut, ...]
    clock: bool = False


def counted(count: int, noun: str) -> str:
    """A number and what it counts."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def read_rows(table: Table, columns: Collection[int], time: int | None = None) -> Rows:
    """Read the numbers of columns.

    Rows without a number in one of them are left out, as long as they are fewer than half; so are rows out of the order
    of time, as long as they are few.

    Args:
        table: at its first row.
        columns: their indices.
        time: which of them holds times, which may also be those of a clock.

    Raises:
        Fault: if a cell is neither a number nor a mark of a lost one, if half of the rows have none, or if the time
            goes back (ARTIFACT).
    """
    reader = _Reader(table, columns, time)
    for cells in table.rows():
        reader.add(cells)
    return reader.result()


class _Reader:
    def __init__(self, table: Table, columns: Collection[int], time: int | None) -> None:
        self.table, self.time = table, time
        self.found = {index: array("d") for index in columns}
        self.lines = array("i")
        self.need = max(columns) + 1
        self.lost: dict[str, tuple[int, int, str]] = {}
        self.first: Fault | None = None
        self.clock, self.last, self.passed = False, -math.inf, 0.0

    def add(self, cells: list[str]) -> None:
        """Take a row in, or note why not."""
        if len(cells) < self.need:
            if any(map(is_value, filter(str.strip, cells))):
                self._leave("cut short", ",".join(cells), self.table.short(cells))
            elif any(map(str.strip, cells)):
                self._leave("of text", " ".join(cells), None)
            return
        try:
            values = [self._value(index, cells[index]) for index in self.found]
        except Fault:
            if any(map(is_value, filter(str.strip, cells))):
                raise
            self._leave("of text", " ".join(cells), None)
            return
        for index, value in zip(self.found, values, strict=True):
            if value != value:
                if any(map(str.strip, cells)):
                    title, text = shown(self.table.header[index]), cells[index].strip()
                    self._leave(f"without a number in '{title}'", text, self.table.wrong(index, cells[index]))
                return
        for column, value in zip(self.found.values(), values, strict=True):
            column.append(value)
        self.lines.append(self.table.line)

    def _value(self, index: int, text: str) -> float:
        if index != self.time:
            return self.table.number(index, text)
        if not self.clock:
            try:
                return self.table.number(index, text)
            except Fault:
                if self.lines or clock(text) is None:
                    raise
                self.clock = True
        seconds = clock(text)
        if seconds is None:
            return self.table.number(index, text)
        back = self.last - seconds
        if back > HALF_DAY:
            self.passed += DAY
        elif back > HALF_HOUR and self.last < HOUR:  # a clock of minutes and seconds
            self.passed += HOUR
        self.last = seconds
        return seconds + self.passed

    def _leave(self, why: str, text: str, fault: Fault | None) -> None:
        count, line, first = self.lost.get(why, (0, self.table.line, shown(text, 40)))
        self.lost[why] = count + 1, line, first
        self.first = self.first or fault

    def result(self) -> Rows:
        """What was read."""
        lost = sum(count for why, (count, _, _) in self.lost.items() if why != "of text")
        if self.first and lost >= len(self.lines):
            raise self.first
        values = {index: np.frombuffer(column) if column else np.zeros(0) for index, column in self.found.items()}
        lines = np.frombuffer(self.lines, dtype=np.int32) if self.lines else np.zeros(0, np.int32)
        if self.time is not None and len(lines) and (np.diff(values[self.time]) < 0.0).any():
            values, lines = self._in_order(self.time, values, lines)
        left_out = tuple(LeftOut(why, *found) for why, found in self.lost.items())
        return Rows(values, lines, left_out, self.clock)

    def _in_order(self, time: int, values: dict[int, Floats], lines: Ints) -> tuple[dict[int, Floats], Ints]:
        """The most rows whose times do not go back."""
        times = values[time]
        kept = np.zeros(len(times), dtype=np.bool_)
        kept[_longest_rise(times.tolist())] = True
        if (~kept).sum() > OUT_OF_ORDER * len(times):
            back = int((np.diff(times) < 0.0).argmax()) + 1
            self.table.line = int(lines[back])
            raise self.table.fault(
                f"column '{shown(self.table.header[time])}': the time {times[back]:g} comes after "
                f"{times[back - 1]:g}; put the rows in the order of time"
            )
        first = int((~kept).argmax())
        self.lost["out of the order of time"] = int((~kept).sum()), int(lines[first]), f"{times[first]:g}"
        return {index: column[kept] for index, column in values.items()}, lines[kept]


def _longest_rise(values: list[float]) -> list[int]:
    """Indices of a longest part, in order, that does not fall (Fredman 1975)."""
    tails: list[float] = []
    ends: list[int] = []
    before: list[int] = []
    for index, value in enumerate(values):
        place = bisect_right(tails, value)
        before.append(ends[place - 1] if place else -1)
        tails[place : place + 1] = [value]
        ends[place : place + 1] = [index]
    found, index = [], ends[-1]
    while index >= 0:
        found.append(index)
        index = before[index]
    return found[::-1]
