"""The response of a density field to a rising and falling pressure, and what a summary says of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from actuator.arrays import Floats
from stages.similarity import Units

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.solve.equilibrium import Equilibrium
    from actuator.solve.path import Point
    from actuator.solve.state import State


#: Columns of a curve, in the order of a table. ``leak`` is the largest p on the outer wall over p_in.
COLUMNS = ("load_factor", "pressure", "T1", "T3", "theta2", "elongation", "energy_ratio", "leak", "loading", "newton")
#: What is reported at p_in.
FIGURES = ("T3", "theta2", "elongation", "energy_ratio", "leak")
#: Relative difference below which two states are one; converged to 1e-8 they agree to about that.
SAME = 1e-4


@dataclass(frozen=True)
class Snapshot:
    """A state at one load factor.

    Attributes:
        displacement: u, (n_nodes, 3), mm.
        pressure: p, (n_vertices,), N/mm².
        stored: whether the user asked for it.
    """

    displacement: Floats
    pressure: Floats
    stored: bool


@dataclass
class Response:
    """What is known of a field's path; it grows point by point.

    Attributes:
        domain, chi: mesh, mm, and field, (n_vertices,).
        units: those of the computation.
        records: points along the path, :data:`COLUMNS`.
        negative: negative eigenvalues of the tangent with the pressure held, one per record; None if not known.
        limits: indices of records that are limit points.
        states: by load factor, where the way up first meets it.
        difference: at p_in from the optimised state; None if the path did not come there.
        ended: one sentence if the path could not be followed to its end.
    """

    domain: Domain
    chi: Floats
    units: Units
    records: list[dict[str, float]] = field(default_factory=list)
    negative: list[int | None] = field(default_factory=list)
    limits: list[int] = field(default_factory=list)
    states: dict[float, Snapshot] = field(default_factory=dict)
    difference: dict[str, float] | None = None
    ended: str = ""

    def add(self, equilibrium: Equilibrium, point: Point, state: State, loading: bool) -> dict[str, float]:
        """Append a point; returns its record."""
        from actuator.solve.reduced import spring_elongation, wall_leak  # numba, as in stages.simulate.run
        from actuator.terms.strain_energy import strain_energy_excess

        full, length = equilibrium.coefficients.pressure, self.units.length
        _, ratio = strain_energy_excess(equilibrium.geometry, equilibrium.coefficients, self.chi, state.displacement)
        values = (
            point.load,
            self.units.stress * point.load * full,
            length * state.arm[0],
            length * state.arm[1],
            state.arm[2],
            length * spring_elongation(equilibrium.kinematics, state),
            ratio,
            wall_leak(equilibrium.domain, state.p, full),
            loading,
            point.newton,
        )
        record = {name: float(value) + 0.0 for name, value in zip(COLUMNS, values, strict=True)}  # no -0
        if point.limit:
            self.limits.append(len(self.records))
        self.records.append(record)
        self.negative.append(point.negative)
        return record

    @property
    def curves(self) -> dict[str, Floats]:
        """Columns of the curve along the path, (n_points,) each."""
        return {name: np.array([record[name] for record in self.records]) for name in COLUMNS}

    def first(self, load: float, *, loading: bool) -> dict[str, float] | None:
        """The record where the way up, or down, first meets a load factor exactly."""
        wanted = float(loading)
        return next((r for r in self.records if r["loading"] == wanted and r["load_factor"] == load), None)


def summarised(response: Response, pressure: float) -> dict[str, Any]:
    """What a summary says of a path to a multiple of the pressure p_in, N/mm²; see docs/use/simulation.md."""
    target, last = response.first(1.0, loading=True), response.records[-1]
    limits = _limit_points(response)
    difference = response.difference
    return {
        "pressure_in": pressure,
        "reached": difference is not None and max(difference.values()) < SAME,
        "snaps_before_target": any(limit["loading"] and limit["before_target"] for limit in limits),
        "difference": difference or {},
        "limit_points": limits,
        "instabilities": _instabilities(response),
        "at_target": {name: target[name] for name in FIGURES} if target else None,
        "hysteresis": _hysteresis(response),
        "largest_load": max(record["load_factor"] for record in response.records),
        "points": len(response.records),
        "newton": int(sum(record["newton"] for record in response.records)),
        "cells": response.domain.mesh.nelements,
        "complete": not response.ended and not last["loading"] and last["load_factor"] == 0.0,
        "ended": response.ended,
    }


def _limit_points(response: Response) -> list[dict[str, Any]]:
    """Limit points in order, each with the jump that a prescribed pressure would make from there."""
    from actuator.solve.path import snap

    found = []
    for at in response.limits:
        record = response.records[at]
        way = [k for k, r in enumerate(response.records) if r["loading"] == record["loading"]]
        loads = [response.records[k]["load_factor"] for k in way]
        here = way.index(at)
        maximum = loads[here] >= loads[here - 1]
        jump = snap(loads, here) if maximum == bool(record["loading"]) else None
        landing = None
        if jump:
            k, t = jump
            one, two = response.records[way[k]], response.records[way[k + 1]]
            landing = {name: (1.0 - t) * one[name] + t * two[name] for name in FIGURES}
        met = next((k for k, load in enumerate(loads) if load == 1.0), len(loads))
        found.append(
            {
                "load_factor": record["load_factor"],
                "kind": "maximum" if maximum else "minimum",
                "loading": bool(record["loading"]),
                "before_target": here < met,
                **{name: record[name] for name in FIGURES[:3]},
                "jump_to": landing,
            }
        )
    return found


def _instabilities(response: Response) -> list[dict[str, Any]]:
    """Where the number of negative eigenvalues changes between successive points of the same way."""
    found = []
    for k in range(1, len(response.records)):
        before, after = response.negative[k - 1], response.negative[k]
        one, two = response.records[k - 1], response.records[k]
        if before is None or after is None or before == after or one["loading"] != two["loading"]:
            continue
        found.append(
            {
                "load_factors": [one["load_factor"], two["load_factor"]],
                "loading": bool(two["loading"]),
                "negative_eigenvalues": [before, after],
                "at_limit_point": bool({k - 1, k} & set(response.limits)),
            }
        )
    return found


def _hysteresis(response: Response) -> dict[str, float] | None:
    """Largest differences between the ways up and down at load factors that both meet exactly; None without one.

    Relative to the largest value on the curve.
    """
    loads = {record["load_factor"] for record in response.records}
    pairs = [(response.first(load, loading=True), response.first(load, loading=False)) for load in loads]
    top = max(loads)
    both = [(up, down) for up, down in pairs if up and down and up["load_factor"] != top]
    if not both:
        return None
    found = {}
    for name in FIGURES[:3]:
        largest = max(abs(record[name]) for record in response.records) or 1.0
        found[name] = max(abs(up[name] - down[name]) for up, down in both) / largest
    return found
