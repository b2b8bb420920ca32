"""Recorded tests: CSV files with pressure and displacement, or with the voltages of both sensors.

The header tells what a column holds, by name and unit: ``pressure [kPa]``. Cells are read row by row, so that a mistake
is named with its line, and only the numbers of the columns used are kept.
"""

from __future__ import annotations

import codecs
import csv
import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from pipeline.case_text import shown
from pipeline.column_names import Column, Quantity, columns_of, named
from pipeline.exit_codes import ExitCode, Fault
from stages.compare import Recording

#: More would take more than a few hundred MB; at the paper's 500 rows a second this is most of a day.
MOST_ROWS = 20_000_000
#: Longest line; more is no table.
LONGEST_LINE = 100_000


@dataclass(frozen=True)
class Sensors:
    """How voltages become physical: those of the paper's sensors (Honeywell 142PC15D, Micro-Epsilon ILD 1402-50).

    Attributes:
        pressure: kPa/V; the paper's calibration with a water column; None takes it, and allows physical units.
        displacement: mm/V, likewise.
    """

    pressure: float | None = None
    displacement: float | None = None


PAPER = Sensors(19.17, 12.5)


@dataclass(frozen=True)
class Measurement:
    """A file and what was read from it.

    Attributes:
        path: the file.
        columns: name, unit and place of what was read, by quantity.
        comments: lines before the header that begin with #, without it.
        recording: in kPa, mm and s.
    """

    path: Path
    columns: dict[Quantity, Column]
    comments: tuple[str, ...]
    recording: Recording


def read_measurement(path: Path, wanted: dict[Quantity, str | None], sensors: Sensors) -> Measurement:
    """Read a recorded test.

    Args:
        path: CSV with a header; cells apart by comma, semicolon or tab, the latter two also with decimal commas.
        wanted: names of columns by quantity, as the header has them; None to find them.
        sensors: for columns in V.

    Raises:
        Fault: if the file is missing or not understood (ARTIFACT), or an option does not fit it (USAGE).
    """
    try:
        with path.open("rb") as file:
            head = file.read(4096)
        encoding = _encoding(path, head)
        with path.open(encoding=encoding, errors="replace", newline="") as file:
            return _read(path, file, wanted, sensors)
    except csv.Error as error:
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is no table ({error}); export the test as CSV.") from None
    except FileNotFoundError:
        raise Fault(ExitCode.ARTIFACT, f"{path}: there is no such file; give the recorded test.") from None
    except IsADirectoryError:
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is a folder; give the recorded test in it.") from None
    except PermissionError:
        raise Fault(ExitCode.ARTIFACT, f"{path}: may not be read; change its permissions.") from None


def _encoding(path: Path, head: bytes) -> str:
    """Spreadsheets on some systems write UTF-16; everything that is read here is plain in every other encoding."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if b"\0" in head:
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is no text file; export the test as CSV.")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"  # µ and ° of older Windows programs
    return "utf-8-sig"


class _Lines:
    """The lines of a file that are neither empty nor comments.

    Attributes:
        number: of the last line given, from 1.
        comments: all so far.
    """

    def __init__(self, path: Path, file: TextIO) -> None:
        self.path, self.file, self.number = path, file, 0
        self.comments: list[str] = []

    def __iter__(self) -> Iterator[str]:
        while line := self.file.readline(LONGEST_LINE):
            self.number += 1
            if len(line) >= LONGEST_LINE:
                raise self.fault("is too long for a table; check that this is the recorded test")
            if line.startswith("#"):
                self.comments.append(line[1:].strip())
            elif line.strip():
                yield line

    def fault(self, sentence: str) -> Fault:
        return Fault(ExitCode.ARTIFACT, f"{self.path}:{self.number}: {sentence}.")


def _read(path: Path, file: TextIO, wanted: dict[Quantity, str | None], sensors: Sensors) -> Measurement:
    lines = _Lines(path, file)
    source = iter(lines)
    header = next(source, None)
    if header is None:
        raise Fault(ExitCode.ARTIFACT, f"{path}: the file is empty; give the recorded test.")
    delimiter = _delimiter(header)
    cells = next(csv.reader([header], delimiter=delimiter, skipinitialspace=True))
    columns = columns_of(f"{path}:{lines.number}", cells, wanted)
    comments = tuple(lines.comments)
    factors = {quantity: _factor(column, quantity, sensors) for quantity, column in columns.items()}
    values = _numbers(lines, source, delimiter, len(cells), columns)
    scaled = {quantity: np.frombuffer(found) * factors[quantity] for quantity, found in values.items() if found}
    if not scaled:
        raise Fault(ExitCode.ARTIFACT, f"{path}: there are no rows below the header; give the recorded test.")
    recording = Recording(scaled[Quantity.PRESSURE], scaled[Quantity.DISPLACEMENT], scaled.get(Quantity.TIME))
    return Measurement(path, columns, comments, recording)


def _delimiter(header: str) -> str:
    """Tab before semicolon before comma: the ones before may stand beside decimal commas, and names may hold commas."""
    return next((mark for mark in "\t;" if mark in header), ",")


def _numbers(
    lines: _Lines, source: Iterator[str], delimiter: str, width: int, columns: dict[Quantity, Column]
) -> dict[Quantity, array[float]]:
    """The numbers of the columns, as they stand in the file.

    Raises:
        Fault: if a row is short, a cell is no finite number, or the time decreases (ARTIFACT).
    """
    found = {quantity: array("d") for quantity in columns}
    targets = [(found[quantity], column) for quantity, column in columns.items()]
    times = found.get(Quantity.TIME)
    decimal_comma = delimiter != ","
    last = -math.inf
    for row, cells in enumerate(csv.reader(source, delimiter=delimiter, skipinitialspace=True), 1):
        if len(cells) < width:
            raise lines.fault(f"the row has {len(cells)} cells and the header {width}; complete or remove the line")
        for values, column in targets:
            text = cells[column.index]
            try:
                value = float(text.replace(",", ".") if decimal_comma else text)
            except ValueError:
                raise lines.fault(_wrong_number(column, text, delimiter)) from None
            if not math.isfinite(value):
                raise lines.fault(f"{named(column)}: '{text.strip()}' is no finite number; correct or remove the line")
            values.append(value)
        if times is not None:
            if times[-1] < last:
                column = columns[Quantity.TIME]
                raise lines.fault(
                    f"{named(column)}: the time {times[-1]:g} comes after {last:g}; put the rows in the order of time"
                )
            last = times[-1]
        if row > MOST_ROWS:
            raise lines.fault(f"there are more than {MOST_ROWS} rows; record or keep fewer a second")
    return found


def _wrong_number(column: Column, text: str, delimiter: str) -> str:
    if not text.strip():
        return f"{named(column)}: the cell is empty; correct or remove the line"
    if "\n" in text or "\r" in text:
        return f"{named(column)}: a quotation mark before this line is not closed; remove it"
    cell = shown(text.strip())
    if delimiter == "," and "," in text:
        return f"{named(column)}: '{cell}' has a decimal comma; separate the cells by semicolons or tabs"
    return f"{named(column)}: '{cell}' is no number; correct or remove the line"


def _factor(column: Column, quantity: Quantity, sensors: Sensors) -> float:
    """What a number of a column is in kPa, mm or s.

    Raises:
        Fault: if a sensitivity is given for a column that is no voltage (USAGE).
    """
    if quantity is Quantity.TIME:
        return column.factor
    given, own = (
        (sensors.pressure, PAPER.pressure)
        if quantity is Quantity.PRESSURE
        else (sensors.displacement, PAPER.displacement)
    )
    if not column.voltage:
        if given is not None:
            raise Fault(
                ExitCode.USAGE,
                f"--{quantity}-sensitivity goes with a voltage, and {named(column)} is none; remove the option or name "
                f"the voltage's column with --{quantity}-column.",
            )
        return column.factor
    sensitivity = own if given is None else given
    assert sensitivity is not None
    return column.factor * sensitivity
