"""Uniaxial tests as CSV: a header that names stretch or strain and engineering stress, and one row per point."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from actuator.arrays import Floats
from pipeline.exit_codes import ExitCode, Fault, shown
from pipeline.measured.titles import name_and_unit
from pipeline.store.tables import Table, open_table

LEAST_POINTS = 3

#: N/mm² in a unit of stress, and strain in a unit of strain; by the unit's name in lower case.
STRESS_UNITS = {"mpa": 1.0, "n/mm2": 1.0, "n/mm²": 1.0, "n/mm^2": 1.0, "kpa": 1e-3, "pa": 1e-6}
STRAIN_UNITS = {"": 1.0, "-": 1.0, "1": 1.0, "mm/mm": 1.0, "%": 0.01}

_STRETCH = {"stretch", "stretch ratio", "lambda", "λ"}
_STRAIN = {"strain", "engineering strain", "nominal strain"}
_STRESS = {"stress", "engineering stress", "nominal stress", "first piola stress"}
_TRUE = {"true stress", "cauchy stress", "true strain", "logarithmic strain"}


@dataclass(frozen=True)
class UniaxialTest:
    """Points of a test.

    Attributes:
        stretch: length over initial length, (n,).
        stress: force over initial area, (n,), N/mm².
        unit: of the stress, as found or assumed.
        lines: of the file in which the points stand.
        bare_strain: whether the strain is given and its unit is not.
    """

    stretch: Floats
    stress: Floats
    unit: str
    lines: list[int]
    bare_strain: bool


def read_uniaxial_test(path: Path, unit: str | None = None) -> UniaxialTest:
    """Read a test.

    Columns other than stretch or strain and stress are passed over.

    Args:
        path: the CSV file.
        unit: of the stress if the header has none; MPa by default.

    Raises:
        Fault: if the file is no such test (ARTIFACT), or ``unit`` is not that of its header (USAGE).
    """
    with open_table(path, "a uniaxial test") as table:
        columns = _Columns(table, unit)
        rows = [(table.line, columns.point(cells)) for cells in table.rows()]
        points = np.array([point for _, point in rows])
        if len(points) < LEAST_POINTS:
            raise table.fault(f"there are {len(points)} points, fewer than {LEAST_POINTS}; add some")
        if np.ptp(points[:, 0]) == 0.0:
            raise table.fault("all points have the same stretch; add points at other stretches")
    lines = [line for line, _ in rows]
    return UniaxialTest(points[:, 0], points[:, 1], columns.unit, lines, columns.bare_strain)


class _Columns:
    """Which columns hold what, and in which unit."""

    def __init__(self, table: Table, unit: str | None) -> None:
        self.table, header = table, table.header
        found = [name_and_unit(cell, STRESS_UNITS) for cell in header]
        named = [(" ".join(name.replace("_", " ").lower().split()), unit) for name, unit in found]
        for (name, _), cell in zip(named, header, strict=True):
            if name in _TRUE:
                remedy = "give stretch or engineering strain and engineering stress (force over initial area)"
                raise table.fault(f"column '{shown(cell)}' cannot be used; {remedy}")
        extension = [i for i, (name, _) in enumerate(named) if name in _STRETCH | _STRAIN]
        stress = [i for i, (name, _) in enumerate(named) if name in _STRESS]
        for places, wanted in ((extension, "'stretch' or 'strain'"), (stress, "'stress'")):
            if len(places) != 1:
                have = "no column" if not places else "more than one column"
                raise table.fault(f"{have} of {wanted}; write a header such as 'stretch,stress [MPa]'")
        self.extension, self.stress = extension[0], stress[0]
        self.is_strain = named[self.extension][0] in _STRAIN
        of_strain, of_stress = named[self.extension][1], named[self.stress][1]
        self.bare_strain = self.is_strain and not of_strain
        if of_strain.lower() not in STRAIN_UNITS or (of_strain == "%" and not self.is_strain):
            remedy = "write strain [%], or no unit"
            raise table.fault(f"unit '{shown(of_strain)}' of stretch or strain is unknown; {remedy}")
        if unit is not None and of_stress and STRESS_UNITS.get(of_stress.lower()) != STRESS_UNITS[unit.lower()]:
            sentence = f"{table.where}: the stress is in '{shown(of_stress)}', not in {unit}; leave out --unit."
            raise Fault(ExitCode.USAGE, sentence)
        self.unit = of_stress or unit or "MPa"
        if self.unit.lower() not in STRESS_UNITS:
            raise table.fault(f"unit '{shown(self.unit)}' of stress is unknown; write MPa, N/mm², kPa or Pa")
        self.strain_scale, self.stress_scale = STRAIN_UNITS[of_strain.lower()], STRESS_UNITS[self.unit.lower()]

    def point(self, cells: list[str]) -> tuple[float, float]:
        """Stretch and stress (N/mm²) of a row."""
        extension, stress = (self.table.number(column, cells[column]) for column in (self.extension, self.stress))
        stretch = 1.0 + self.strain_scale * extension if self.is_strain else extension
        if not stretch > 0.0:
            raise self.table.fault(f"the stretch is {stretch:g}; it is length over initial length, above zero")
        return stretch, self.stress_scale * stress
