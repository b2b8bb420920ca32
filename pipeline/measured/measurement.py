"""Recorded tests: CSV files with pressure and displacement, or with the voltages of both sensors.

The header tells what a column holds, by name and unit: ``pressure [kPa]``. Only the numbers of the columns used are
kept.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.exit_codes import ExitCode, Fault
from pipeline.measured.column_names import Column, Quantity, columns_of, named
from pipeline.store.tables import Table, open_table
from stages.compare import Recording

#: How voltages become physical, kPa/V and mm/V: the paper's calibration with a water column of its Honeywell 142PC15D,
#: and its Micro-Epsilon ILD 1402-50.
SENSITIVITIES = {Quantity.PRESSURE: 19.17, Quantity.DISPLACEMENT: 12.5}


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


def read_measurement(
    path: Path,
    wanted: Mapping[Quantity, str | None] | None = None,
    given: Mapping[Quantity, float | None] | None = None,
) -> Measurement:
    """Read a recorded test.

    Args:
        path: CSV with a header; cells apart by comma, semicolon or tab, the latter two also with decimal commas.
        wanted: names of columns by quantity, as the header has them; None to find them.
        given: sensitivities of columns in V; None takes those of :data:`SENSITIVITIES`, and allows physical units.

    Raises:
        Fault: if the file is missing or not understood (ARTIFACT), or an option does not fit it (USAGE).
    """
    with open_table(path, "the recorded test") as table:
        columns = columns_of(table.where, table.header, wanted or {})
        comments = tuple(table.comments)
        factors = {
            quantity: _factor(column, quantity, (given or {}).get(quantity)) for quantity, column in columns.items()
        }
        values = _numbers(table, columns)
    scaled = {quantity: np.frombuffer(found) * factors[quantity] for quantity, found in values.items() if found}
    if not scaled:
        raise Fault(ExitCode.ARTIFACT, f"{path}: there are no rows below the header; give the recorded test.")
    recording = Recording(scaled[Quantity.PRESSURE], scaled[Quantity.DISPLACEMENT], scaled.get(Quantity.TIME))
    return Measurement(path, columns, comments, recording)


def _numbers(table: Table, columns: dict[Quantity, Column]) -> dict[Quantity, array[float]]:
    """The numbers of the columns, as they stand in the file.

    Raises:
        Fault: if a row is short, a cell is no finite number, or the time decreases (ARTIFACT).
    """
    found = {quantity: array("d") for quantity in columns}
    targets = [(found[quantity], column.index) for quantity, column in columns.items()]
    times = found.get(Quantity.TIME)
    last = -math.inf
    for cells in table.rows():
        for values, index in targets:
            values.append(table.number(index, cells[index]))
        if times is not None:
            if times[-1] < last:
                raise table.fault(
                    f"{named(columns[Quantity.TIME])}: the time {times[-1]:g} comes after {last:g}; put the rows in "
                    "the order of time"
                )
            last = times[-1]
    return found


def _factor(column: Column, quantity: Quantity, sensitivity: float | None) -> float:
    """What a number of a column is in kPa, mm or s.

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
