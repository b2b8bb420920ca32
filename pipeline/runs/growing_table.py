"""The tables that grow while stages run: design updates, and points of a curve."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """A column of a table that grows by lines.

    Attributes:
        heading: above it.
        width: of it, with the blank that parts it from the one before.
        style: of its numbers that fit.
        factor: from the record's unit to that of the heading.
    """

    heading: str
    width: int
    style: str
    factor: float = 1.0

    @property
    def head(self) -> str:
        """The heading in its place."""
        return f"{self.heading:>{self.width}}"

    def cell(self, value: float) -> str:
        """A number in its place, with fewer digits where it would touch the one before."""
        text = format(self.factor * value, self.style)
        digits = self.width
        while len(text) >= self.width and digits > 0:
            digits -= 1
            text = f"{self.factor * value:.{digits}e}"
        return f"{text:>{self.width}}"


_TERM = ".2e"
UPDATE_COLUMNS = {
    "update": Column("update", 7, ".0f"),
    "C": Column("C", 12, ".6f"),
    "C0": Column("C0", 12, ".6f"),
    **{name: Column(name, 10, _TERM) for name in ("C_chi", "C_A", "C_i", "C_p", "C_psi", "dt")},
    "seconds": Column("time/s", 10, ".1f"),
}

#: Columns of a pressure-displacement curve; the angle in degrees.
LOAD_COLUMNS = {
    "load_factor": Column("load", 8, ".4f"),
    "T3": Column("T3/mm", 11, ".5f"),
    "theta2": Column("theta2", 9, ".4f", math.degrees(1.0)),
    "elongation": Column("travel", 9, ".4f"),
    "energy_ratio": Column("energy", 9, ".4f"),
    "leak": Column("leak", 10, ".2e"),
    "strain_p99": Column("strain 99%", 12, ".4f"),
    "share_above": Column("above", 9, ".4f"),
    "newton": Column("Newton", 8, ".0f"),
}

#: Of the parts on the way to the finished one.
FINISH_COLUMNS = {
    "step": Column("step", 6, ".0f"),
    "travel": Column("travel/mm", 11, ".3f"),
    "energy_ratio": Column("Ψ/limit", 9, ".3f"),
    "share_above": Column("above", 9, ".4f"),
    "largest_ratio": Column("largest", 9, ".2f"),
    "wall": Column("wall/mm", 9, ".2f"),
    "gap": Column("gap/mm", 8, ".2f"),
    "seconds": Column("time/s", 8, ".1f"),
}


@dataclass(frozen=True)
class Table:
    """A table that is shown while it grows, line by line, each a record of numbers.

    Attributes:
        columns: by the names of the numbers in the records.
    """

    columns: Mapping[str, Column]

    def heading(self, width: int | None = None) -> str:
        """The line above all others; ``width`` is as for :meth:`row`."""
        return "".join(column.head for column in self._shown(width).values())

    def row(self, record: Mapping[str, float], width: int | None = None) -> str:
        """A record as a line.

        Args:
            record: numbers by name; those that are missing are not known.
            width: of a terminal, for which columns are left out from the right.
        """
        return "".join(column.cell(record.get(name, math.nan)) for name, column in self._shown(width).items())

    def _shown(self, width: int | None) -> dict[str, Column]:
        ends = itertools.accumulate(column.width for column in self.columns.values())
        fitting = zip(self.columns.items(), ends, strict=True)
        return {name: column for (name, column), end in fitting if width is None or end <= width}


UPDATES, FINISH = Table(UPDATE_COLUMNS), Table(FINISH_COLUMNS)


def load_table(record: Mapping[str, float]) -> Table:
    """A table of the columns that the records of a curve have."""
    return Table({name: column for name, column in LOAD_COLUMNS.items() if name in record})
