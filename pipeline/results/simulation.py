"""The pressure-displacement curve as its artifact holds it, for drawing, tables and reports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from actuator.arrays import Floats
from pipeline.case.model import Case, stored_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import artifact, contents
from pipeline.store import tables as table_file
from stages.curves import UNITS
from stages.response import COLUMNS
from stages.rig import RigUnits
from stages.simulate import VERSION


class Curves(Protocol):
    """What a simulation or an inflation is drawn and compared from: as it was computed, or read from its artifact."""

    @property
    def curves(self) -> Mapping[str, Floats]:
        """Columns along the path, (n_points,) each."""

    @property
    def summary(self) -> Mapping[str, Any]:
        """Of the stage."""


@dataclass(frozen=True)
class Simulation:
    """A simulation.

    Attributes:
        name: of the case.
        curves: columns along the path, (n_points,) each; see :data:`stages.response.COLUMNS`.
        summary: of the stage.
    """

    name: str
    curves: dict[str, Floats]
    summary: dict[str, Any]


def rig_units(case: Case) -> RigUnits:
    """The units of the part of a case, of the case's own material where it does not say what it is printed of."""
    modulus = case.rig.youngs_modulus or case.material.youngs_modulus
    return RigUnits(case.optimize, case.export.scale, modulus)


def is_current(path: Path) -> bool:
    """Whether an artifact of ``simulate`` is there, and of the version that is read here."""
    return path.is_file() and artifact.read_header(path).stage_version == VERSION


def read_simulation(path: Path) -> Simulation:
    """Read the artifact of ``simulate``.

    Raises:
        Fault: if the artifact is missing, unreadable, of another stage, or of another version of this (ARTIFACT).
    """
    header, summary = artifact.read_header(path), contents.summary(path, "simulate")
    if header.stage_version != VERSION:
        raise Fault(
            ExitCode.ARTIFACT,
            f"{path}: made by another version of 'simulate'; run `poro simulate` again, or delete it.",
        )
    name = stored_case(header.case_resolved, path).name
    return Simulation(name, artifact.read_group(path, "simulate", "curves"), summary)


@dataclass(frozen=True)
class Fields:
    """The stored states of a simulation.

    Attributes:
        chi: design field at the nodes, (n_nodes,); the vertices come first.
        loads: load factors, ascending, (n_states,).
        displacement: mm, (n_states, n_nodes, 3).
        pressure: N/mm², (n_states, n_nodes).
    """

    chi: Floats
    loads: Floats
    displacement: Floats
    pressure: Floats


def read_fields(path: Path) -> Fields:
    """Read the states in an artifact of ``simulate``.

    Raises:
        Fault: if the artifact is missing, unreadable, of another stage, or holds no states (ARTIFACT).
    """
    if not artifact.holds(path, "simulate", "states"):
        sentence = f"{path}: holds no states; name load factors in simulate.states and run `poro simulate` again."
        raise Fault(ExitCode.ARTIFACT, sentence)
    found = artifact.read_group(path, "simulate", "states")
    loads, n = found["load_factor"], len(found["points"])
    shape = len(loads), n
    return Fields(found["chi"], loads, found["displacement"].reshape(*shape, 3), found["pressure"].reshape(shape))


def as_csv(simulation: Simulation, rig: RigUnits | None = None) -> str:
    """The curve as a table with the units in its first line, and in the rig's units if they are given."""
    columns = {f"{name} [{UNITS.get(name, '1')}]": simulation.curves[name] for name in COLUMNS}
    columns |= rig.columns(simulation.curves) if rig else {}
    return table_file.as_csv(
        list(columns), ([f"{value:.10g}" for value in row] for row in zip(*columns.values(), strict=True))
    )
