"""Uniaxial tests: files with stretch or strain and engineering stress, or with extension and load, a row per point.

The same tables are read as of recorded tests, with all their spellings of units and numbers.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from actuator.arrays import Floats
from pipeline.exit_codes import ExitCode, Fault, shown
from pipeline.measured.rows import LeftOut, read_rows
from pipeline.measured.table import Table, open_table
from pipeline.measured.titles import name_and_unit, words
from pipeline.measured.units import Kind, factor_of

LEAST_POINTS = 3

#: Words of columns. What is measured across the specimen, or as a rate or a limit, is none of them.
_STRETCH = {"stretch", "lambda", "λ"}
_STRAIN = {"strain"}
_STRESS = {"stress"}
_TRUE = {"true", "cauchy", "log", "logarithmic", "natural", "hencky"}
_EXTENSION = {"extension", "displacement", "elongation", "crosshead", "travel", "stroke", "disp"}
_LOAD = {"load", "force"}
_OTHER = {"lateral", "transverse", "shear", "width", "rate", "speed", "limit", "energy", "time"}

#: What the lines above the header may say of the specimen, by the words of its name.
_GAUGE = {"gauge length", "gage length", "initial length", "original length", "length", "l0", "grip separation"}
_AREA = {"area", "cross sectional area", "cross section area", "cross section", "initial area", "a0"}
_ENTRY = re.compile(
    r"\W*(?P<name>[A-Za-z][A-Za-z _-]*?0?)\s*(?:[\[(](?P<of>[^\])]*)[\])])?[\s:=]*"
    r"(?P<number>\d+(?:[.,]\d+)?)[\s\[(]*(?P<unit>[^\s\])]*)"
)


@dataclass(frozen=True)
class UniaxialTest:
    """Points of a test.

    Attributes:
        stretch: length over initial length, (n,).
        stress: force over initial area, (n,), N/mm².
        unit: of the stress, as found or assumed.
        lines: of the file in which the points stand.
        bare_strain: whether the strain is given and its unit is not.
        left_out: rows that hold no numbers.
        notes: sentences about what was made of the columns.
    """

    stretch: Floats
    stress: Floats
    unit: str
    lines: list[int]
    bare_strain: bool
    left_out: tuple[LeftOut, ...] = ()
    notes: tuple[str, ...] = field(default=())

    @property
    def remarks(self) -> list[str]:
        """Sentences about what was left out, and about what was made of the columns."""
        return [*(f"left out: {each}" for each in self.left_out), *self.notes]


def read_uniaxial_test(
    path: Path, unit: str | None = None, *, gauge_length: float | None = None, area: float | None = None
) -> UniaxialTest:
    """Read a test.

    Columns other than stretch or strain and stress, or in their place extension and load, are passed over.

    Args:
        path: the file; see :mod:`pipeline.measured.table`.
        unit: of the stress if the header has none; MPa by default.
        gauge_length: over which an extension is measured, mm; by default what the lines above the header say.
        area: initial cross section that a load acts on, mm²; likewise.

    Raises:
        Fault: if the file is no such test (ARTIFACT), or an option is missing or does not fit its header (USAGE).
    """
    with open_table(path, "a uniaxial test", _is_header) as table:
        columns = _Columns(table, unit, gauge_length, area)
        rows = read_rows(table, [columns.extension, columns.stress])
        last, stretch = table.line, columns.stretch(rows.values[columns.extension])
        if not (stretch > 0.0).all():
            wrong = int((stretch <= 0.0).argmax())
            table.line = int(rows.lines[wrong])
            raise table.fault(f"the stretch is {stretch[wrong]:g}; it is length over initial length, above zero")
        table.line = last
        if len(stretch) < LEAST_POINTS:
            raise table.fault(f"there are {len(stretch)} points, fewer than {LEAST_POINTS}; add some")
        if np.ptp(stretch) == 0.0:
            raise table.fault("all points have the same stretch; add points at other stretches")
    return UniaxialTest(
        stretch,
        columns.stress_scale * rows.values[columns.stress],
        columns.unit,
        rows.lines.tolist(),
        columns.bare_strain,
        rows.left_out,
        tuple(columns.notes),
    )


def _is_header(cells: list[str]) -> bool:
    """Whether a line names strain and stress, or what they are made of, each in a cell of its own."""
    strained = set(_places(cells, _STRETCH | _STRAIN | _EXTENSION, true=None))
    stressed = set(_places(cells, _STRESS | _LOAD, true=None))
    return any(place != other for place in strained for other in stressed)


def _places(titles: list[str], wanted: set[str], *, true: bool | None = False) -> list[int]:
    """Columns with one of the words in their name; with ``true`` the true ones, without it the others."""
    found = []
    for place, title in enumerate(titles):
        spelt = set(words(name_and_unit(title, list(Kind))[0]))
        # An extension is no strain, though a strain may be by extension.
        stranger = (_STRAIN | _STRETCH | _STRESS) & spelt if wanted <= _EXTENSION | _LOAD else set()
        if wanted & spelt and not _OTHER & spelt and not stranger and true in (None, bool(_TRUE & spelt)):
            found.append(place)
    return found


class _Columns:
    """Which columns hold what, and in which unit."""

    def __init__(self, table: Table, unit: str | None, gauge_length: float | None, area: float | None) -> None:
        self.table, self.header, self.notes = table, table.header, list[str]()
        self.gauge_length = self.area = 1.0
        self.is_strain, self.bare_strain = True, False
        strained, stressed = _places(self.header, _STRETCH | _STRAIN), _places(self.header, _STRESS)
        extended, loaded = _places(self.header, _EXTENSION), _places(self.header, _LOAD)
        used = {*strained, *stressed} if strained and stressed else set()
        for place in _places(self.header, _STRETCH | _STRAIN | _STRESS, true=True):
            if not used and not (extended and loaded):
                remedy = "give stretch or engineering strain and engineering stress (force over initial area)"
                raise table.fault(f"column '{shown(self.header[place])}' cannot be used; {remedy}")
        self.extension = self._strain(strained, extended, gauge_length)
        self.stress = self._stress(stressed, loaded, area, unit)
        true = [shown(self.header[place]) for place in _places(self.header, _STRETCH | _STRAIN | _STRESS, true=True)]
        if true:
            self.notes.append(f"passed over: {', '.join(true)}; the engineering columns beside are used")

    def stretch(self, values: Floats) -> Floats:
        """Stretch of what the column of the extension holds."""
        scaled = self.strain_scale * values / self.gauge_length
        return 1.0 + scaled if self.is_strain else scaled

    def _one(self, places: list[int], wanted: str, otherwise: str = "") -> int:
        if len(places) != 1:
            have = "no column" if not places else "more than one column"
            raise self.table.fault(f"{have} of {wanted}; write a header such as 'stretch,stress [MPa]'{otherwise}")
        return places[0]

    def _strain(self, strained: list[int], extended: list[int], gauge_length: float | None) -> int:
        if not strained and len(extended) == 1:
            place = extended[0]
            length = gauge_length or self._above(_GAUGE, Kind.LENGTH)
            self.gauge_length = self._given(length, place, "--gauge-length", "the gauge length in mm")
            self.strain_scale = self._factor(place, Kind.LENGTH, "mm")
            self.notes.append(f"strain is '{shown(self.header[place])}' over a gauge length of {length:g} mm")
            return place
        place = self._one(strained, "'stretch' or 'strain'")
        name, unit = name_and_unit(self.header[place], [Kind.STRAIN])
        self.is_strain = bool(_STRAIN & set(words(name)))
        self.bare_strain = self.is_strain and not unit
        scale = factor_of(unit, Kind.STRAIN)
        if scale is None or (scale != 1.0 and not self.is_strain):
            raise self.table.fault(
                f"unit '{shown(unit)}' of stretch or strain is unknown; write strain [%], or no unit"
            )
        self.strain_scale = scale
        return place

    def _stress(self, stressed: list[int], loaded: list[int], area: float | None, unit: str | None) -> int:
        section = area or self._area_above()
        if not stressed and len(loaded) == 1 and (section or self.gauge_length != 1.0):
            place = loaded[0]
            self.area = self._given(section, place, "--area", "the initial cross section in mm²")
            self.stress_scale = self._factor(place, Kind.FORCE, "N") / self.area
            self.notes.append(f"stress is '{shown(self.header[place])}' over an area of {self.area:g} mm²")
            self.unit = "N/mm²"
            return place
        place = self._one(stressed, "'stress'", ", or give --area, which a load acts on" if loaded else "")
        own = name_and_unit(self.header[place], [Kind.STRESS])[1]
        factor = factor_of(own or unit or "MPa", Kind.STRESS)
        if factor is None:
            raise self.table.fault(f"unit '{shown(own)}' of stress is unknown; write MPa, N/mm², kPa, Pa or psi")
        if unit is not None and own and factor != factor_of(unit, Kind.STRESS):
            sentence = f"{self.table.where}: the stress is in '{shown(own)}', not in {unit}; leave out --unit."
            raise Fault(ExitCode.USAGE, sentence)
        self.unit, self.stress_scale = own or unit or "MPa", factor
        return place

    def _factor(self, place: int, kind: Kind, default: str) -> float:
        """Of the unit of an extension or a load."""
        unit = name_and_unit(self.header[place], [kind])[1]
        factor = factor_of(unit or default, kind)
        if factor is None:
            title = shown(self.header[place])
            raise self.table.fault(f"column '{title}': '{shown(unit)}' is unknown; write '[{default}]' behind its name")
        if not unit:
            self.notes.append(f"'{shown(self.header[place])}' has no unit; it is read as {default}")
        return factor

    def _given(self, value: float | None, place: int, option: str, what: str) -> float:
        if value is None or not value > 0.0:
            raise Fault(
                ExitCode.USAGE, f"{self.table.where}: column '{shown(self.header[place])}' needs {what}; give {option}."
            )
        return value

    def _area_above(self) -> float | None:
        """The area that the lines above the header give, themselves or by width and thickness or diameter."""
        width, thickness, diameter = (self._above({name}, Kind.LENGTH) for name in ("width", "thickness", "diameter"))
        sides = width * thickness if width and thickness else None
        return self._above(_AREA, Kind.AREA) or sides or (math.pi / 4.0 * diameter**2 if diameter else None)

    def _above(self, names: set[str], kind: Kind) -> float | None:
        """What the lines above the header say of the specimen, in mm or mm²; None if nothing."""
        for text in (*(" ".join(cells) for cells in self.table.above), *self.table.comments):
            entry = _ENTRY.match(text)
            if entry and " ".join(words(entry["name"])) in names:
                factor = factor_of(entry["of"] or entry["unit"], kind)
                return float(entry["number"].replace(",", ".")) * (1.0 if factor is None else factor)
        return None
