"""What a part does under pressure, as its artifact holds it, for drawing, tables and reports."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from actuator.arrays import Floats, Ints
from pipeline.case.model import stored_case
from pipeline.results.simulation import rig_units
from pipeline.store import artifact, contents
from pipeline.store import tables as table_file
from stages.inflation import TARGET, UNITS
from stages.rig import RigUnits


@dataclass(frozen=True)
class Inflation:
    """The response of a part.

    Attributes:
        name: of the part.
        curves: column -> values along the path, (n_points,); see :data:`stages.inflation.UNITS`.
        summary: of the stage.
        rig: what turns the curve into that of the part on the rig.
    """

    name: str
    curves: dict[str, Floats]
    summary: dict[str, Any]
    rig: RigUnits


@dataclass(frozen=True)
class Inflated:
    """One state of a part.

    Attributes:
        points: undeformed nodes, (n_nodes, 3), mm.
        cells: (n_cells, 10), in VTK's order.
        boundary: nodes of the faces of the surface, (n_faces, 6), corners first, counter-clockwise seen from outside;
            without those on the plane X2 = 0 of a half.
        displacement: (n_nodes, 3), mm.
        strain: sqrt(2 Ψ / E), mean around every node, (n_nodes,).
        limit: of the strain.
        half: whether the nodes are those of the half X2 >= 0.
    """

    points: Floats
    cells: Ints
    boundary: Ints
    displacement: Floats
    strain: Floats
    limit: float
    half: bool

    def scaled(self, scale: float) -> Inflated:
        """The same in another size, in which the strain is the same; the stage works in the lengths of the case."""
        return replace(self, points=scale * self.points, displacement=scale * self.displacement)


def part_name(path: Path) -> str:
    """The name of the part, by that of the artifact of ``inflate``."""
    return path.name.removesuffix(".inflation.h5")


def read_inflation(path: Path) -> Inflation:
    """Read the curve in an artifact of ``inflate``.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    case = stored_case(artifact.read_header(path).case_resolved, path)
    summary = contents.summary(path, "inflate")
    rig = replace(rig_units(case), scale=summary["scale"])
    return Inflation(part_name(path), artifact.read_group(path, "inflate", "curves"), summary, rig)


def read_states(path: Path) -> Inflated | None:
    """Read the state at p_in, or the last one before it, from an artifact of ``inflate``; None if it has none.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    states = read_path(path)
    before = [load for load in states if load <= TARGET]
    return states[max(before) if before else min(states)] if states else None


def read_path(path: Path) -> dict[float, Inflated]:
    """Read all states, by ascending load factor, from an artifact of ``inflate``.

    Raises:
        Fault: if the artifact is missing, unreadable, or of another stage (ARTIFACT).
    """
    if not artifact.holds(path, "inflate", "states"):
        return {}
    found, summary = artifact.read_group(path, "inflate", "states"), contents.summary(path, "inflate")
    n, cells = len(found["points"]), found["connectivity"].reshape(-1, 10)
    return {
        float(load): Inflated(
            found["points"],
            cells,
            found["boundary"],
            found["displacement"][n * number : n * (number + 1)],
            found["strain"][n * number : n * (number + 1)],
            summary["strain_limit"],
            summary["half"],
        )
        for number, load in enumerate(found["load_factor"])
    }


def as_csv(inflation: Inflation) -> str:
    """The curve as a table with the units in its first line, and in those of the part."""
    columns = {f"{name} [{unit}]": inflation.curves[name] for name, unit in UNITS.items()}
    columns |= inflation.rig.columns(inflation.curves)
    rows = [[f"{value:.10g}" for value in row] for row in zip(*columns.values(), strict=True)]
    return table_file.as_csv(columns, rows)
