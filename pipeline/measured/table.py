"""Tables that people and instruments write: what stands above the numbers, the header, and rows of cells.

Cells are apart by tab, semicolon, comma or blanks; all but the comma also with decimal commas. Cells are read row by
row, so that a mistake is named with its line. Empty lines and those that begin with # are passed over, and so are a
first line ``sep=;`` and what an instrument writes above the header. A line of units below it belongs to the header.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import islice, zip_longest
from pathlib import Path
from typing import TextIO

from pipeline.exit_codes import ExitCode, Fault, shown
from pipeline.measured.cells import clock, is_value, number_of
from pipeline.measured.titles import name_and_unit
from pipeline.measured.units import is_unit, is_usual, without_brackets

#: More would take more than a few hundred MB; at the paper's 500 rows a second this is most of a day.
MOST_ROWS = 20_000_000
#: Longest line; more is no table.
LONGEST_LINE = 100_000
#: Lines in which a header is looked for: instruments write up to about a hundred above it.
HEAD = 300
#: Lines below a header by which the numbers begin: units, and perhaps a blank or a note.
BELOW = 3
#: What a serial monitor writes before each line: 14:23:05.123 -> 0.12,3.45
_MONITOR = re.compile(r"(\d\d:\d\d:\d\d\.\d+) -> (.*)", re.DOTALL)


class Table:
    """A table that is being read.

    Attributes:
        path: the file.
        line: number of the line read last, from 1.
        comments: of the lines above the header that begin with #, without it.
        above: cells of the other lines above the header.
        header: its cells, without blanks around them, with the units of a line of units below it.
    """

    def __init__(self, path: Path, file: TextIO, what: str, is_header: Callable[[list[str]], bool]) -> None:
        self.path, self.line, self._file, self._what = path, 0, file, what
        self._comments: list[tuple[int, str]] = []
        self._separator = ""
        lines = self._read_lines()
        head = [(self.line, line) for line in islice(lines, HEAD)]
        if not head:
            raise Fault(ExitCode.ARTIFACT, f"{path}: the file is empty; give {what}.")
        if given := re.fullmatch(r"\"?sep=(.)\"?\s*", head[0][1], re.IGNORECASE):
            self._separator = given[1]
            head = head[1:] or [(self.line, "")]
        place = self._header_place([line for _, line in head], is_header)
        self._delimiter = self._mark(head[place][1])
        self.line, text = head[place]
        self.header = self._titles(self._cells(text))
        self.above = [self._cells(line) for _, line in head[:place]]
        self.comments = [text for number, text in self._comments if number < self.line]
        if clock(self.header[0]) is not None:  # of a serial monitor
            self.header[0] = "time"
        below = head[place + 1 :]
        if below and (units := self._units(self._cells(below[0][1]))):
            below = below[1:]
        else:
            # What LabVIEW's .lvm says above.
            labels = next((row for row in self.above if row[0] == "Y_Unit_Label"), [])
            units = ["", *labels[1:]]
        self.header = [
            f"{title} [{unit}]" if unit and not is_unit(name_and_unit(title)[1]) else title
            for title, unit in zip_longest(self.header, units[: len(self.header)], fillvalue="")
        ]
        self._below, self._rest = below, lines

    @property
    def where(self) -> str:
        """File and line, for messages."""
        return f"{self.path}:{self.line}"

    def fault(self, sentence: str) -> Fault:
        """What is wrong with the line read last."""
        return Fault(ExitCode.ARTIFACT, f"{self.where}: {sentence}.")

    def rows(self) -> Iterator[list[str]]:
        """The cells of each row; more than the header has may follow if they are empty. A row may be short.

        Raises:
            Fault: if a row is long, or there are more than :data:`MOST_ROWS` (ARTIFACT).
        """
        width = len(self.header)
        rows = csv.reader(self._lines(), delimiter=self._delimiter, skipinitialspace=True)
        for number, cells in enumerate(rows, 1):
            if any(cells[width:]):
                sentence = f"the row has {len(cells)} cells and the header {width}; with decimal commas, separate the"
                raise self.fault(f"{sentence} cells by semicolons or tabs")
            if number > MOST_ROWS:
                raise self.fault(f"there are more than {MOST_ROWS} rows; record or keep fewer")
            yield cells

    def short(self, cells: list[str]) -> Fault:
        """What is wrong with a row that ends before a column that is needed."""
        return self.fault(
            f"the row has {len(cells)} cells and the header {len(self.header)}; complete or remove the line"
        )

    def number(self, column: int, text: str) -> float:
        """A cell as a number; NaN if it says that there is none, as ``NaN``, ``OVLD`` or an empty cell do.

        Raises:
            Fault: if it is neither (ARTIFACT).
        """
        value = number_of(text, decimal_comma=self._delimiter != ",")
        if value is None:
            raise self.wrong(column, text)
        return value

    def wrong(self, column: int, text: str) -> Fault:
        """What is wrong with a cell that is no number."""
        name, cell = f"column '{shown(self.header[column])}'", shown(text.strip())
        if not cell:
            return self.fault(f"{name}: the cell is empty; correct or remove the line")
        if "\n" in text or "\r" in text:
            return self.fault(f"{name}: a quotation mark before this line is not closed; remove it")
        if cell.lstrip("+-").casefold() in ("nan", "inf", "infinity"):
            return self.fault(f"{name}: '{cell}' is no finite number; correct or remove the line")
        if self._delimiter == "," and "," in text:
            return self.fault(f"{name}: '{cell}' has a decimal comma; separate the cells by semicolons or tabs")
        return self.fault(f"{name}: '{cell}' is no number; correct or remove the line")

    def _header_place(self, lines: list[str], is_header: Callable[[list[str]], bool]) -> int:
        """The first line that names what is wanted and has numbers below it; else that above the first numbers."""
        for place, line in enumerate(lines):
            cells = self._titles(self._cells(line))
            below = lines[place + 1 : place + 1 + BELOW]
            if is_header(cells) and any(self._numeric(each, self._mark(line)) for each in below):
                return place
        first = next((i for i, line in enumerate(lines) if self._numeric(line, self._mark(line))), 0)
        width = len(self._cells(lines[first]))
        above = [place for place in range(first) if len(self._cells(lines[place])) == width]
        return max(above, default=max(first - 1, 0))

    def _mark(self, line: str) -> str:
        """What cells are apart by, on a line."""
        # The ones before may stand beside decimal commas, and names may hold commas.
        found = self._separator or next((mark for mark in "\t;|," if mark in line), "")
        return found or (" " if len(line.split()) > 1 else ",")

    def _cells(self, line: str) -> list[str]:
        mark = self._mark(line)
        if mark == " ":
            # A unit in brackets belongs to the name before it.
            return re.split(r"\s{2,}" if "  " in line.strip() else r"\s+(?![\[(])", line.strip())
        return [cell.strip() for cell in next(csv.reader([line], delimiter=mark, skipinitialspace=True), [])]

    def _titles(self, cells: list[str]) -> list[str]:
        """Titles, also of a line as ``Time, s, Pressure, kPa`` that is apart by commas."""
        if len(cells) > 3 and len(cells) % 2 == 0 and all(map(is_usual, cells[1::2])):
            return [f"{name} [{unit}]" for name, unit in zip(cells[::2], cells[1::2], strict=True)]
        return cells

    def _numeric(self, line: str, mark: str) -> bool:
        """Whether a line, its cells apart by a mark, is a row of numbers: two or more, and no fewer than half."""
        cells = line.split() if mark == " " else line.rstrip("\r\n").split(mark)
        filled = [cell for cell in cells if cell.strip()]
        return sum(map(is_value, filled)) >= max(2.0, 0.5 * len(filled))

    def _units(self, cells: list[str]) -> list[str]:
        """The units of a line that holds nothing else; none if it is no such line."""
        filled = [cell for cell in cells if cell]
        if len(cells) <= len(self.header) and filled and not any(map(_is_number, filled)) and all(map(is_unit, filled)):
            return [without_brackets(cell) for cell in cells]
        return []

    def _lines(self) -> Iterator[str]:
        """What stands below the header."""
        for number, line in self._below:
            self.line = number
            yield line
        yield from self._rest

    def _read_lines(self) -> Iterator[str]:
        while line := self._file.readline(LONGEST_LINE):
            self.line += 1
            if len(line) >= LONGEST_LINE:
                raise self.fault(f"is too long for a table; check that this is {self._what}")
            if line.startswith("#"):
                self._comments.append((self.line, line[1:].strip()))
            elif line.strip():
                told = _MONITOR.match(line)
                yield f"{told[1]}{self._mark(told[2])}{told[2]}" if told else line


def _is_number(cell: str) -> bool:
    """Whether a cell is a number, and no unit that looks like one, as - for none."""
    return is_value(cell) and not is_usual(cell)


@contextmanager
def open_table(path: Path, what: str, is_header: Callable[[list[str]], bool]) -> Iterator[Table]:
    """Open a table.

    Args:
        path: the file.
        what: it should be, for messages: "the recorded test".
        is_header: whether cells name what is wanted.

    Raises:
        Fault: if the file is missing, or is no table (ARTIFACT).
    """
    try:
        with path.open("rb") as start:
            encoding = _encoding(path, start.read(4096), what)
        with path.open(encoding=encoding, errors="replace", newline="") as file:
            yield Table(path, file, what, is_header)
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
    if b"\0" in head[::2] and b"\0" not in head[1::2]:
        return "utf-16-be"
    if b"\0" in head[1::2] and b"\0" not in head[::2]:
        return "utf-16-le"
    if b"\0" in head:
        raise Fault(ExitCode.ARTIFACT, f"{path}: this is no text file; export {what} as CSV.")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"  # µ and ° of older Windows programs
    return "utf-8-sig"
