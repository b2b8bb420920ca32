"""The response of a part as printed: what is kept of it, and what a user reads of it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator.arrays import Floats
from stages.datasets import QUADRATIC_TETRAHEDRON, Dataset, GridPaths, Packed
from stages.load import held

if TYPE_CHECKING:
    from actuator.body.inflation import Inflation
    from actuator.body.mesh import BodyMesh
    from actuator.body.strain import Strains
    from actuator.solve.path import Point
    from stages.rig import RigUnits
    from stages.settings import ProblemSettings

#: The pressure the design was optimised for, as a load factor.
TARGET = 1.0
#: Units of the columns of a curve, in the order of a table. Forces, moments and volumes are those of the whole part.
UNITS = {
    "load_factor": "1",
    "pressure": "N/mm^2",
    "T1": "mm",
    "T3": "mm",
    "theta2": "rad",
    "elongation": "mm",
    "chamber_volume": "mm^3",
    "spring_force": "N",
    "stored_energy": "N mm",
    "air_work": "N mm",
    "strain_max": "1",
    "strain_p99": "1",
    "share_above": "1",
    "stretch_max": "1",
    "stretch_p99": "1",
    "fixed_force_1": "N",
    "fixed_force_3": "N",
    "fixed_moment_2": "N mm",
    "arm_force_1": "N",
    "arm_force_3": "N",
    "arm_moment_2": "N mm",
    "limit_point": "1",
    "newton": "1",
}
#: What is reported at p_in.
FIGURES = (
    "T1",
    "T3",
    "theta2",
    "elongation",
    "chamber_volume",
    "spring_force",
    "strain_max",
    "strain_p99",
    "share_above",
)
#: Atmospheric pressure, N/mm²: the air that fills the chamber is counted at it.
ATMOSPHERE = 0.101325
#: How far apart the spots of largest strain must be, over the length; chosen.
APART = 0.1


@dataclass(frozen=True)
class Result:
    """A path of states of a part.

    Attributes:
        curves: columns along the path by name, (n_points,) each; :data:`UNITS`.
        summary: the figures at p_in, and what else is said of the path.
        mesh: of the part, scaled to the size of the domain.
        states: displacement (n_nodes, 3), mm, and mean strain of the cells around each node, (n_nodes,), by load
            factor.
        finished: false if the user interrupted.
    """

    curves: dict[str, Floats]
    summary: dict[str, Any]
    mesh: BodyMesh
    states: dict[float, tuple[Floats, Floats]]
    finished: bool


@dataclass
class Course:
    """What is known of a path; it grows point by point.

    Attributes:
        mesh, problem: of the part, and of the case.
        scale: size of the part over that of the domain.
        records: points along the path.
        slopes: dV/dλ of the chamber at each of them, mm³; NaN at limit points.
        states: as in :class:`Result`.
        worst: the spots of the largest strain at p_in, each with its place, mm.
        touching: the first load factor at which walls have passed into each other, and where, mm.
        blocked: force at the arm's end if that is held at p_in, N; none if not asked for.
        ended: one sentence if the path could not be followed to its end.
        finished: false if the user interrupted.
    """

    mesh: BodyMesh
    problem: ProblemSettings
    scale: float
    records: list[dict[str, float]] = field(default_factory=list)
    slopes: list[float] = field(default_factory=list)
    states: dict[float, tuple[Floats, Floats]] = field(default_factory=dict)
    worst: list[tuple[float, tuple[float, float, float]]] = field(default_factory=list)
    touching: tuple[float, tuple[float, float, float]] | None = None
    blocked: list[float] = field(default_factory=list)
    ended: str = ""
    finished: bool = True

    def add(self, inflation: Inflation, point: Point, *, stored: bool = False) -> dict[str, float]:
        """Append a point; returns its record."""
        from actuator.body.strain import strains, touching

        state = inflation.state(point.z, point.load)
        whole = 2.0 if self.mesh.half else 1.0
        modulus = self.problem.material.youngs_modulus
        found = strains(self.mesh, state.displacement, state.density, modulus)
        motion = dict(zip(inflation.arm.names, state.motion.tolist(), strict=True))
        elongation = inflation.arm.elongation(state.motion)
        self.slopes.append(inflation.volume_slope(point))
        values = {
            "load_factor": point.load,
            "pressure": point.load * inflation.pressure,
            **{name: motion[name] for name in ("T1", "T3", "theta2")},
            "elongation": elongation,
            "chamber_volume": whole * state.volume,
            "spring_force": whole * inflation.arm.stiffness * elongation,
            "stored_energy": whole * (state.stored + state.spring),
            "air_work": whole * self._work(point.load, state.volume, inflation.pressure),
            "strain_max": float(found.strain.max()),
            "strain_p99": found.percentile(found.strain, 0.99),
            "share_above": found.share_above(self.problem.objective.strain_limit),
            "stretch_max": float(found.stretch.max()),
            "stretch_p99": found.percentile(found.stretch, 0.99),
            **_plate_forces(
                self.mesh,
                state.displacement,
                inflation.arm.full(state.motion)[:3],
                whole * inflation.reactions(point.z, point.load),
            ),
            "limit_point": float(point.limit),
            "newton": float(point.newton),
        }
        record = {name: float(values[name]) + 0.0 for name in UNITS}  # no -0
        self.records.append(record)
        if stored:
            self.states[point.load] = state.displacement, _on_nodes(self.mesh, found)
            place = touching(self.mesh, state.displacement) if self.touching is None else None
            if place is not None:
                self.touching = point.load, place
        if point.load == TARGET and not self.worst:
            self.worst = found.spots(APART * self.mesh.length)
        return record

    def column(self, name: str) -> Floats:
        """A column of the curve, (n_points,)."""
        return np.array([record[name] for record in self.records])

    def _work(self, load: float, volume: float, pressure: float) -> float:
        """∫ p dV up to a point, N mm, of what is modelled: by parts, with V by cubics between the points."""
        if not self.records:
            return 0.0
        whole = 2.0 if self.mesh.half else 1.0
        before, start, end = self.records[-1], self.slopes[-2], self.slopes[-1]
        step, old = load - before["load_factor"], before["chamber_volume"] / whole
        between = 0.5 * step * (old + volume) + step**2 / 12.0 * (start - end)
        work = load * volume - before["load_factor"] * old - between
        return before["air_work"] / whole + pressure * work

    def result(self, optimised: Mapping[str, Any] | None = None) -> Result:
        """What has been found.

        Args:
            optimised: summary of the optimisation, to compare with.
        """
        at = next((record for record in self.records if record["load_factor"] == TARGET), None)
        last = self.records[-1]
        limit = self.problem.objective.strain_limit
        summary: dict[str, Any] = {
            "reached": at is not None,
            "pressure_in": self.problem.parameters()[1].pressure,
            "at_target": {name: at[name] for name in FIGURES} if at else None,
            "strain_limit": limit,
            "scale": self.scale,
            "half": self.mesh.half,
            "cells": len(self.mesh.cells),
            "nodes": len(self.mesh.nodes),
            "largest_load": max(record["load_factor"] for record in self.records),
            "full_over_half": self._full_over_half(),
            "limit_points": [record["load_factor"] for record in self.records if record["limit_point"]],
            "worst": [{"strain": strain, "at": place} for strain, place in self.worst],
            "touching": {"load_factor": self.touching[0], "at": self.touching[1]} if self.touching else None,
            "volume_at_rest": self.records[0]["chamber_volume"],
            "air_needed": air_needed(self.records[0]["chamber_volume"], at["chamber_volume"], at["pressure"])
            if at
            else None,
            "blocked_force": self._blocked(at),
            "optimised": _compared(at, optimised) if at and optimised else None,
            "energy_error": abs(last["air_work"] - last["stored_energy"]) / (abs(last["stored_energy"]) or 1.0),
            "points": len(self.records),
            "newton": int(sum(record["newton"] for record in self.records)),
            "complete": not self.ended and self.finished,
            "ended": self.ended,
            "finished": self.finished,
        }
        curves = {name: self.column(name) for name in UNITS}
        return Result(curves, summary, self.mesh, self.states, self.finished)

    def _blocked(self, at: Mapping[str, float] | None) -> float | None:
        """Force at the arm's end where that is held at p_in, N: by the case's own spring, or as was asked for."""
        if self.blocked:
            return self.blocked[0]
        return at["spring_force"] if at and held(self.problem) else None

    def _full_over_half(self) -> float | None:
        """Travel at p_in over travel at half of it, 2 for a linear response; None if not both were met."""
        load, travel = self.column("load_factor"), self.column("elongation")
        rising = np.maximum.accumulate(load) == load
        if load.max() < TARGET or not rising.all():
            return None
        full, half = np.interp([TARGET, 0.5 * TARGET], load, travel)
        return float(full / half) if half else None


def _plate_forces(mesh: BodyMesh, displacement: Floats, moved: Floats, reactions: Floats) -> dict[str, float]:
    """What the body pulls at the plates by, N, and its moments about their centres, N mm: the load of the glue.

    The air on the plates themselves comes in addition. ``moved`` is the displacement of the centre of the arm's plate,
    (3,), mm.
    """
    forces = {}
    centres = ("fixed", mesh.fixed, np.zeros(3)), ("arm", mesh.tip, np.array([mesh.length, 0.0, 0.0]) + moved)
    for name, nodes, centre in centres:
        pull = -reactions[nodes]
        arm = mesh.nodes[nodes] + displacement[nodes] - centre
        forces[f"{name}_force_1"], forces[f"{name}_force_3"] = float(pull[:, 0].sum()), float(pull[:, 2].sum())
        forces[f"{name}_moment_2"] = float(np.sum(arm[:, 2] * pull[:, 0] - arm[:, 0] * pull[:, 2]))
    return forces


def _on_nodes(mesh: BodyMesh, found: Strains) -> Floats:
    """Strain of the cells around every node, by their volumes, (n_nodes,)."""
    volume = found.weights.sum(axis=1)
    mean = (found.strain * found.weights).sum(axis=1)
    counts = np.bincount(mesh.cells.ravel(), np.repeat(volume, mesh.cells.shape[1]), len(mesh.nodes))
    return np.asarray(np.bincount(mesh.cells.ravel(), np.repeat(mean, mesh.cells.shape[1]), len(mesh.nodes)) / counts)


def air_needed(rest: float, volume: float, pressure: float) -> float:
    """Volume of air, at atmospheric pressure, that goes into a chamber from rest to p_in, mm³.

    Args:
        rest, volume: of the chamber at rest and at p_in, mm³.
        pressure: p_in, N/mm².
    """
    return volume * (1.0 + pressure / ATMOSPHERE) - rest


def _compared(at: Mapping[str, float], optimised: Mapping[str, Any]) -> dict[str, Any]:
    """What the optimiser found beside what the part does, with the relative difference of the part."""
    pairs = {"T3": "T3", "theta2": "theta2", "elongation": "spring_elongation"}
    return {
        name: {
            "optimised": optimised[key],
            # The optimisation counts the spring's end downwards.
            "relative": abs(at[name]) / abs(optimised[key]) - 1.0 if optimised[key] else None,
        }
        for name, key in pairs.items()
    }


def pack(result: Result) -> Packed:
    """The curve, and the stored states on the mesh of the part."""
    datasets = {
        f"curves/{name}": Dataset(values, UNITS[name], f"{name} along the path")
        for name, values in result.curves.items()
    }
    if not result.states:
        return Packed(result.summary, datasets)
    loads = sorted(result.states)
    displacement = np.concatenate([result.states[load][0] for load in loads])
    strain = np.concatenate([result.states[load][1] for load in loads])
    datasets |= {
        "states/points": Dataset(result.mesh.nodes, "mm", "undeformed nodes of the 10-node cells, the vertices first"),
        "states/connectivity": Dataset(result.mesh.cells.ravel(), "1", "nodes of the cells, 10 each, in VTK's order"),
        "states/displacement": Dataset(displacement, "mm", "u, one state after the other"),
        "states/strain": Dataset(strain, "1", "sqrt(2 Psi / E), mean around the node, one state after the other"),
        "states/load_factor": Dataset(np.array(loads), "1", "load factors of the states"),
        "states/boundary": Dataset(result.mesh.boundary, "1", "nodes of the boundary faces, 6 each, corners first"),
        "states/walls": Dataset(result.mesh.walls, "1", "nodes of the faces that the air presses on, corners first"),
    }
    fields = {name: f"/states/{name}" for name in ("displacement", "strain")}
    grid = GridPaths("/states/points", "/states/connectivity", QUADRATIC_TETRAHEDRON, fields, tuple(loads))
    return Packed(result.summary, datasets, grid)


def pressure_in(found: Mapping[str, Any], rig: RigUnits) -> float:
    """p_in that the part was inflated to, N/mm² of the case; that of the case where an older record does not say."""
    told: float = found.get("pressure_in") or rig.problem.parameters()[1].pressure
    return told


def verdict(found: Mapping[str, Any], rig: RigUnits) -> list[tuple[str, str]]:
    """That the part holds air, and what it does at p_in: travel, and strain against its limit."""
    at = found["at_target"]
    text = [("holds air", "yes")]
    if at is None:
        text.append(("as printed", f"p_in is not reached; largest load factor {found['largest_load']:.4g}"))
    else:
        pressure, travel, shift = pressure_in(found, rig), abs(at["elongation"]), at["T3"]
        angle = f"theta2 {math.degrees(at['theta2']):.3f} degrees"
        moved = f"travel {rig.millimetres(travel):.3f} mm, T3 {rig.millimetres(shift):.4f} mm, {angle}"
        text.append(("as printed", f"{moved}, at {rig.kilopascals(pressure):.3g} kPa"))
        if not rig.same:
            own = f"travel {travel:.3f} mm, T3 {shift:.4f} mm, at {1e3 * pressure:.3g} kPa"
            text.append(("", f"in size and modulus of the case {own}"))
        if found["optimised"]:
            change = found["optimised"]["elongation"]["relative"]
            which = "more" if change > 0.0 else "less"
            text.append(("", f"{100.0 * abs(change):.1f} % {which} than the optimiser found"))
        share, limit = 100.0 * at["share_above"], 100.0 * found["strain_limit"]
        above = f"strain above its limit of {limit:g} % in {share:.2g} % of the volume"
        text.append(("", f"{above}, 99 % stay below {100.0 * at['strain_p99']:.3g} %"))
    return text


def lines(found: Mapping[str, Any], rig: RigUnits) -> list[tuple[str, str]]:
    """What else a user reads of the summary; places and forces are those of the part."""
    text = []
    if found["full_over_half"]:
        text.append(f"full over half pressure gives {found['full_over_half']:.2f} times the travel")
    for load in found["limit_points"]:
        text.append(f"limit point at a load factor of {load:.4g}: the part snaps")
    if touching := found["touching"]:
        place = ", ".join(f"{rig.millimetres(x):.1f}" for x in touching["at"])
        load = touching["load_factor"]
        text.append(f"walls touch from a load factor of {load:.3g}, at ({place}) mm; not computed")
    if found["blocked_force"] is not None:
        text.append(f"blocked force at the arm's end {abs(rig.newtons(found['blocked_force'])):.4g} N")
    return [("inflated" if row == 0 else "", sentence) for row, sentence in enumerate(text)]


def shortfall(found: Mapping[str, Any], path: str) -> str:
    """Whether the path was followed to its end, and why not; empty if it was."""
    if not found["finished"]:
        return f"Interrupted; the curve so far is in {path}, run the same command to compute it to the end."
    return f"The curve is in {path} as far as it goes. {found['ended']}" if found["ended"] else ""
