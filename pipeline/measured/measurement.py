"""Recorded tests: files with the pressure and what a part answers to it, or with the voltages of the sensors.

The header tells what a column holds, by name and unit: ``pressure [kPa]``. Only the numbers of the columns used are
kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from actuator.arrays import Floats, Ints
from pipeline.exit_codes import ExitCode, Fault
from pipeline.measured.column_names import RESPONSES, Column, Quantity, columns_of, is_header, named
from pipeline.measured.rows import LeftOut, Rows, read_rows
from pipeline.measured.table import open_table
from stages.compare import Recording

#: How voltages become physical, kPa/V and mm/V: the paper's calibration with a water column of its Honeywell 142PC15D,
#: and its Micro-Epsilon ILD 1402-50.
SENSITIVITIES = {Quantity.PRESSURE: 19.17, Quantity.DISPLACEMENT: 12.5}
_SENSORS = {
    Quantity.PRESSURE: "kPa/V, of the paper's Honeywell 142PC15D,",
    Quantity.DISPLACEMENT: "mm/V, of the paper's Micro-Epsilon ILD 1402-50,",
}

#: Days since 1900 as spreadsheets count them, from 1954 to 2119; a recording is shorter than one.
SPREADSHEET_DAYS = (20_000.0, 80_000.0)
#: Whole numbers without a unit that would be a longer recording in seconds than this are milliseconds, s.
LONGEST_SECONDS = 36_000.0


@dataclass(frozen=True)
class Measurement:
    """A file and what was read from it.

    Attributes:
        path: the file.
        columns: name, unit and place of what was read, by quantity.
        factors: of the numbers in the file to kPa, s, mm, degrees and N.
        comments: lines before the header that begin with #, without it.
        recordings: by what the part answers, the first of :data:`RESPONSES` that there is first; in kPa, s, and mm,
            degrees or N.
        lines: of the file, of each row.
        left_out: rows that hold no numbers.
        assumed: sensitivities that nobody gave, kPa/V and mm/V.
        notes: sentences about what was assumed or passed over.
    """

    path: Path
    columns: dict[Quantity, Column]
    factors: dict[Quantity, float]
    comments: tuple[str, ...]
    recordings: dict[Quantity, Recording]
    lines: Ints
    left_out: tuple[LeftOut, ...]
    assumed: dict[Quantity, float]
    notes: tuple[str, ...]

    @property
    def recording(self) -> Recording:
        """What is compared first."""
        return next(iter(self.recordings.values()))


def read_measurement(
    path: Path,
    wanted: Mapping[Quantity, str | None] | None = None,
    given: Mapping[Quantity, float | None] | None = None,
) -> Measurement:
    """Read a recorded test.

    Args:
        path: a table with a header; see :mod:`pipeline.measured.table`.
        wanted: names of columns by quantity, as the header has them; None to find them.
        given: sensitivities of columns in V; None takes those of :data:`SENSITIVITIES`, and allows physical units.

    Raises:
        Fault: if the file is missing or not understood (ARTIFACT), or an option does not fit it (USAGE).
    """
    wanted, given = wanted or {}, given or {}
    with open_table(path, "the recorded test", lambda cells: is_header(cells, wanted)) as table:
        columns, notes = columns_of(table.where, table.header, wanted)
        factors = {quantity: _factor(column, quantity, given.get(quantity)) for quantity, column in columns.items()}
        clock = columns.get(Quantity.TIME)
        rows = read_rows(table, [column.index for column in columns.values()], clock.index if clock else None)
    if not len(rows.lines):
        raise Fault(ExitCode.ARTIFACT, f"{path}: there are no rows below the header; give the recorded test.")
    assumed = {
        quantity: SENSITIVITIES[quantity]
        for quantity, column in columns.items()
        if column.voltage and given.get(quantity) is None
    }
    notes += [
        f"nobody gave a sensitivity for {named(columns[quantity])}: {value:g} {_SENSORS[quantity]} is assumed; "
        f"give that of your sensor with --{quantity}-sensitivity"
        for quantity, value in assumed.items()
    ]
    values = {quantity: factors[quantity] * rows.values[column.index] for quantity, column in columns.items()}
    if clock and (unit := _unit_of_times(clock, rows)):
        values[Quantity.TIME], sentence = unit
        notes += [f"{named(clock)} {sentence}"] if sentence else []
    recordings = {
        quantity: Recording(
            values[Quantity.PRESSURE],
            values[quantity],
            values.get(Quantity.TIME),
            quantity.value,
            quantity.kind.value,
        )
        for quantity in RESPONSES
        if quantity in values
    }
    return Measurement(
        path, columns, factors, tuple(table.comments), recordings, rows.lines, rows.left_out, assumed, tuple(notes)
    )


def _factor(column: Column, quantity: Quantity, sensitivity: float | None) -> float:
    """What a number of a column is in kPa, s, mm, degrees or N.

    Raises:
        Fault: if a sensitivity is given for a column that is no voltage (USAGE).
    """
    if column.voltage:
        return column.factor * (SENSITIVITIES[quantity] if sensitivity is None else sensitivity)
    if sensitivity is not None:
        raise Fault(
            ExitCode.USAGE,
            f"--{quantity}-sensitivity goes with a voltage, and {named(column)} is none; remove the option or name "
            f"the voltage's column with --{quantity}-column.",
        )
    return column.factor


def _unit_of_times(column: Column, rows: Rows) -> tuple[Floats, str] | None:
    """Times in s of a column without a unit, and a sentence about how they were read; None if it has one."""
    times = rows.values[column.index]
    if rows.clock:
        return times - times[0], ""
    if column.unit:
        return None
    low, high = SPREADSHEET_DAYS
    span = float(np.ptp(times))
    if times[0] >= low and times[-1] <= high and span < 1.0:
        return 86400.0 * (times - times[0]), "has no unit; it is read as a spreadsheet's days"
    if span > LONGEST_SECONDS and not (times % 1.0).any():
        return 1e-3 * times, "has no unit; it is read as ms"
    return times, "has no unit; it is read as s"
