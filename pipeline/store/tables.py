"""Tables as CSV: a header and rows of cells, apart by comma, semicolon or tab; the latter two also with decimal commas.

Cells are read row by row, so that a mistake is named with its line. Empty lines and those that begin with # are passed
over.
"""

from __future__ import annotations

import codecs
import csv
import io
import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from pipeline.exit_codes import ExitCode, Fault, shown

#: More would take more than a few hundred MB; at the paper's 500 rows a second this is most of a day.
MOST_ROWS = 20_000_000
#: Longest line; more is no table.
LONGEST_LINE = 100_000


def as_csv(heading: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table as text, apart by commas."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([heading, *rows])
    return text.getvalue()


def as_markdown(heading: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table as Markdown; cells on one line, with no bar that would end them."""
    names = list(heading)
    lines = [f"| {' | '.join(map(markdown_cell, cells))} |" for cells in (names, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(names), *lines[1:]])


def markdown_cell(text: str) -> str:
    """Text on one line, with no bar that would end a cell."""
    return " ".join(text.split()).replace("|", "\\|")


class Table:
    """A table that is being read.

    Attributes:
        path: the file.
        line: number of the line read last, from 1.
        comments: so far, without the #.
        header: cells of the first line, without blanks around them.
    """

    def __init__(self, path: Path, file: TextIO, what: str) -> None:
        self.path, self.line, self._file, self._what = path, 0, file, what
        self.comments: list[str] = []
        self._lines = self._read_lines()
        first = next(self._lines, None)
        if first is None:
            raise Fault(ExitCode.ARTIFACT, f"{path}: the file is empty; give {what}.")
        # Tab before semicolon before comma: the ones before may stand beside decimal commas, and names may hold commas.
        self._delimiter = next((mark for mark in "\t;" if mark in first), ",")
        cells = next(csv.reader([first], delimiter=self._delimiter, skipinitialspace=True))
        self.header = [cell.strip() for cell in cells]

    @property
    def where(self) -> str:
        """File and line, for messages."""
        return f"{self.path}:{self.line}"

    def fault(self, sentence: str) -> Fault:
        """What is wrong with the line read last."""
        return Fault(ExitCode.ARTIFACT, f"{self.where}: {sentence}.")

    def rows(self) -> Iterator[list[str]]:
        """The cells of each row, as many as the header has; more may follow if they are empty.

        Raises:
            Fault: if a row is short or long, or there are more than :data:`MOST_ROWS` (ARTIFACT).
        """
        width = len(self.header)
        rows = csv.reader(self._lines, delimiter=self._delimiter, skipinitialspace=True)
        for number, cells in enumerate(rows, 1):
            if len(cells) < width:
                sentence = f"the row has {len(cells)} cells and the header {width}; complete or remove the line"
                raise self.fault(sentence)
            if any(cells[width:]):
                sentence = f"the row has {len(cells)} cells and the header {width}; with decimal commas, separate the"
                raise self.fault(f"{sentence} cells by semicolons or tabs")
            if number > MOST_ROWS:
                raise self.fault(f"there are more than {MOST_ROWS} rows; record or keep fewer")
            yield cells

    def number(self, column: int, text: str) -> float:
        """A cell as a finite number.

        Raises:
            Fault: if it is none (ARTIFACT).
        """
        try:
            value = float(text if self._delimiter == "," else text.replace(",", "."))
        except ValueError:
            raise self.fault(self._wrong_number(column, text)) from None
        if not math.isfinite(value):
            raise self.fault(f"{self._named(column)}: '{text.strip()}' is no finite number; correct or remove the line")
        return value

    def _wrong_number(self, column: int, text: str) -> str:
        name = self._named(column)
        if not text.strip():
            return f"{name}: the cell is empty; correct or remove the line"
        if "\n" in text or "\r" in text:
            return f"{name}: a quotation mark before this line is not closed; remove it"
        cell = shown(text.strip())
        if self._delimiter == "," and "," in text:
            return f"{name}: '{cell}' has a decimal comma; separate the cells by semicolons or tabs"
        return f"{name}: '{cell}' is no number; correct or remove the line"

    def _named(self, column: int) -> str:
        return f"column '{shown(self.header[column])}'"

    def _read_lines(self) -> Iterator[str]:
        while line := self._file.readline(LONGEST_LINE):
            self.line += 1
            if len(line) >= LONGEST_LINE:
                raise self.fault(f"is too long for a table; check that this is {self._what}")
            if line.startswith("#"):
                self.comments.append(line[1:].strip())
            elif line.strip():
                yield line


@contextmanager
def open_table(path: Path, what: str) -> Iterator[Table]:
    """Open a table.

    Args:
        path: the file.
        what: it should be, for messages: "the recorded test".

    Raises:
        Fault: if the file is missing, or is no table (ARTIFACT).
    """
    try:
        with path.open("rb") as start:
            encoding = _encoding(path, start.read(4096), what)
        with path.open(encoding=encoding, errors="replace", newline="") as file:
            yield Table(path, file, what)
    except csv.Error as error:
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is no table ({error}); export {what} as CSV.") from None
    except FileNotFoundError:
        raise Fault(ExitCode.ARTIFACT, f"{path}: there is no such file; give {what}.") from None
    except IsADirectoryError:
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is a folder; give {what} in it.") from None
    except PermissionError:
        raise Fault(ExitCode.ARTIFACT, f"{path}: may not be read; change its permissions.") from None


def _encoding(path: Path, head: bytes, what: str) -> str:
    """Spreadsheets on some systems write UTF-16; everything that is read here is plain in every other encoding."""
    if head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    if b"\0" in head:
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is no text file; export {what} as CSV.")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"  # µ and ° of older Windows programs
    return "utf-8-sig"
