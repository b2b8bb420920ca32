"""A flow of the surface of a part that keeps its strain limit and gives up as little travel as it can.

Every step meshes the part anew from the zero set of χ (Allaire, Dapogny & Frey 2014, doi:10.1016/j.cma.2014.08.028),
finds its state at p_in, and changes χ along the null-space direction of Feppon, Allaire & Dapogny (2020,
doi:10.1051/cocv/2020015): what lowers C_0 without a change of the strain, and what lowers the strain.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from actuator.arrays import Floats
from actuator.body.inflation import Inflation
from actuator.body.mesh import BodyMesh
from actuator.body.strain import Strains, strains
from actuator.domains.interface import Domain
from actuator.failure import EmptySolid, NotInflatable, NotManifold, SolveFailure
from actuator.parameters import Load
from actuator.regions.bounds import Bounds
from actuator.shaping.bounds import Widths, widths
from actuator.shaping.derivatives import main_objective, shape_gradient, strain_aggregate
from actuator.shaping.metric import Metric
from actuator.shaping.motion import SurfaceMotion
from actuator.shaping.part import Part, carried, part_of
from actuator.solve.path import Control, begin, correct, follow
from actuator.terms.goals.interface import Goal


@dataclass(frozen=True)
class Controls:
    """What steers the flow. Numbers without a source were tuned on ``case14``: docs/project/notebook/finish.md.

    Attributes:
        size: largest edge of the meshes, mm.
        radius: of the inner product of :class:`~actuator.shaping.metric.Metric`, mm.
        aim: Ψ / Ψ_lim that the flow holds the quantile at, so that it is below 1 in spite of the meshes' differences.
        power: p of the aggregate of Ψ / Ψ_lim.
        travel_move, strain_move: how far the surface moves in a step for the travel, and for the strain at most, mm.
        margin: how far above their least widths walls and gaps hold back what would narrow them, mm.
        spare: how far above their least width walls are held, mm: what a step takes from them in spite of that.
        recovery: how far the surface moves in a step where a wall is too thin, mm.
        moved: share of the nodes of the surface that moves no farther than that.
        strain_share: share of what Ψ is above the aim, in its logarithm, that a step is to take away at most.
        slack: how far, in the same logarithm, Ψ may be below the aim before the limit is left alone.
        cuts: how often a step that leaves no part or no state is halved.
        first_load: load factor of the first step of a path from rest.
        least_arc, most_points: of that path: a part whose path is longer is given up.
    """

    size: float = 2.0
    radius: float = 1.0
    aim: float = 0.95
    power: float = 4.0
    travel_move: float = 0.15
    strain_move: float = 0.3
    margin: float = 1.0
    spare: float = 0.25
    recovery: float = 0.25
    moved: float = 0.995
    strain_share: float = 0.5
    slack: float = 0.02
    cuts: int = 5
    first_load: float = 0.25
    least_arc: float = 0.02
    most_points: int = 12


@dataclass(frozen=True)
class Limits:
    """What the part must keep.

    Attributes:
        strain: sqrt(2 Ψ_lim / E), dimensionless.
        share: of the volume that may be above it.
        clamp: distance from the plates within which the strain does not count, mm.
        wall: least one, mm; that of the first part if None.
        gap: least one, mm.
    """

    strain: float
    share: float
    clamp: float
    wall: float | None
    gap: float


class Figures(NamedTuple):
    """What a part does at p_in.

    Attributes:
        main_objective: C_0, dimensionless.
        travel: of the arm's end, mm, downwards.
        quantile: Ψ / Ψ_lim below which all but the share of the volume stays that may be above the limit.
        largest: largest Ψ / Ψ_lim; both away from the clamps.
        above: share of the volume above the limit, with the clamps.
        wall, gap: least ones, mm; the size of the part where there is none.
        volume: of the part, mm³.
    """

    main_objective: float
    travel: float
    quantile: float
    largest: float
    above: float
    wall: float
    gap: float
    volume: float


class Step(NamedTuple):
    """A part on the way.

    Attributes:
        chi: its χ, (n_vertices,).
        figures: of the part.
        seconds: since the last one.
    """

    chi: Floats
    figures: Figures
    seconds: float


@dataclass
class _Known:
    """A part with its state at p_in."""

    chi: Floats
    part: Part
    inflation: Inflation
    z: Floats
    found: Strains
    weight: Floats
    motion: SurfaceMotion
    widths: Widths


class Flow:
    """The flow of one design.

    Args:
        domain: of the design.
        chi: χ at its vertices, (n_vertices,).
        bounds: on χ, of the passive region and of regions of the case, (n_vertices,); what lies beyond does not go
            farther.
        threshold: level of the surface.
        inflation_of: makes the problem of a mesh.
        goal: what C_0 is.
        load: pressure, arm and spring.
        youngs_modulus: E, N/mm².
        limits, controls: of the flow.
        threads: of the inner product.
    """

    def __init__(
        self,
        domain: Domain,
        chi: Floats,
        bounds: Bounds,
        threshold: float,
        inflation_of: Callable[[BodyMesh], Inflation],
        goal: Goal,
        load: Load,
        youngs_modulus: float,
        limits: Limits,
        controls: Controls,
        threads: int,
    ) -> None:
        self._domain, self._bounds, self._threshold = domain, bounds, threshold
        self._inflation_of, self._goal, self._load, self._modulus = inflation_of, goal, load, youngs_modulus
        self._limits, self._controls, self._least_wall = limits, controls, limits.wall
        self._tetrahedra = domain.tetrahedra()
        self._metric = Metric(domain, controls.radius, threads=threads)
        self._first = chi

    def steps(self) -> Iterator[Step]:
        """The first part, and those that follow from it, without end.

        Raises:
            actuator.failure.NotInflatable: if the first design is no part that can be inflated, or a step leaves none,
                however short.
            actuator.failure.SolveFailure: if there is no state at p_in.
        """
        start = time.perf_counter()
        known = self._known(self._first, None)
        while True:
            figures = self._figures(known)
            end = time.perf_counter()
            yield Step(known.chi, figures, end - start)
            start = time.perf_counter()
            self._least_wall = self._least_wall or figures.wall
            known = self._moved(known, self._change(known, figures.quantile, self._least_wall + self._controls.spare))

    # ------------------------------------------------------------------------------------------------ a part

    def _known(self, chi: Floats, before: _Known | None) -> _Known:
        part = part_of(self._domain, self._tetrahedra, chi, self._threshold, self._controls.size)
        inflation = self._inflation_of(part.mesh)
        z = self._inflated(inflation, before)
        state = inflation.state(z, 1.0)
        found = strains(part.mesh, state.displacement, state.density, self._modulus)
        x = found.places[..., 0].mean(axis=1)
        weight = (np.minimum(x, part.mesh.length - x) > self._limits.clamp).astype(np.float64)
        slope = self._metric.slope(chi)
        motion = SurfaceMotion(self._domain, self._tetrahedra, slope, part.mesh, inflation.points)
        between = widths(part.surface, part.mesh.nodes[motion.nodes], motion.outward)
        return _Known(chi, part, inflation, z, found, weight, motion, between)

    def _inflated(self, inflation: Inflation, before: _Known | None) -> Floats:
        """The state at p_in, from that of the part before, or else along a path from rest."""
        if before is not None:
            try:
                return correct(inflation, carried(before.inflation, before.z, inflation), 1.0, None, Control())[0]
            except SolveFailure:
                pass
        controls = self._controls
        control = Control(
            first=controls.first_load, least=controls.least_arc, largest=1.0, most_points=controls.most_points
        )
        point = begin(inflation, inflation.rest, 0.0, control)
        for reached in follow(inflation, point, 1.0, control, lowest=0.0):
            point = reached
        return point.z

    def _moved(self, known: _Known, change: Floats) -> _Known:
        """The part after a change of χ, or after half of it, and so on, where it is none."""
        for left in reversed(range(self._controls.cuts)):
            chi = known.chi + change
            try:
                return self._known(self._bounds.around(known.chi).kept(chi), known)
            except (EmptySolid, NotManifold, NotInflatable, SolveFailure):
                if not left:
                    raise
                change = 0.5 * change
        raise AssertionError("there is at least one cut")

    # ------------------------------------------------------------------------------------------------ a step

    def _figures(self, known: _Known) -> Figures:
        inflation, z, found, limits = known.inflation, known.z, known.found, self._limits
        counted = replace(found, weights=found.weights * known.weight[:, None])
        size = float(np.linalg.norm(np.ptp(known.part.surface.vertices, axis=0)))
        return Figures(
            main_objective=main_objective(inflation, z, self._goal, self._load).value,
            travel=-inflation.arm.elongation(z[inflation.of_arm]),
            quantile=(counted.percentile(found.strain, 1.0 - limits.share) / limits.strain) ** 2,
            largest=float((found.strain[known.weight > 0.0] / limits.strain).max()) ** 2,
            above=found.share_above(limits.strain),
            wall=min(float(known.widths.wall.min()), size),
            gap=min(float(known.widths.gap.min()), size),
            volume=float(found.weights.sum()),
        )

    def _change(self, known: _Known, quantile: float, least_wall: float) -> Floats:
        """The change of χ, (n_vertices,), of the next step."""
        inflation, z, motion, controls = known.inflation, known.z, known.motion, self._controls
        inflation.linearise(z, 1.0, fresh=True)
        limit = 0.5 * self._modulus * self._limits.strain**2
        aggregate = strain_aggregate(inflation, z, 1.0, limit=limit, power=controls.power, weight=known.weight)
        by_objective, by_aggregate = (
            motion.by_normal_motion(shape_gradient(inflation, z, 1.0, functional))
            for functional in (main_objective(inflation, z, self._goal, self._load), aggregate)
        )
        # The aggregate stands for the quantile, which has no derivative (Le, Norato, Bruns, Ha & Tortorelli 2010,
        # doi:10.1007/s00158-009-0440-y).
        by_strain = by_aggregate / aggregate.value
        violation = float(np.log(quantile / controls.aim))
        lower, strain = (
            self._metric.gradient(
                motion.by_chi(known.widths.held(derivative, least_wall, self._limits.gap, controls.margin))
            )
            for derivative in (by_objective, by_strain)
        )
        whole = motion.by_chi(by_strain)
        square = float(whole @ strain)
        against = float(whole @ lower) / square
        # Where less of C_0 also lowers the strain, or the limit is far, the limit holds nothing up.
        if violation > -controls.slack and against < 0.0:
            lower = lower - against * strain
        change = -self._within(lower, controls.travel_move, motion) * lower
        if violation > -controls.slack:
            relief = violation / square * strain
            change -= min(controls.strain_share, self._within(relief, controls.strain_move, motion)) * relief
        lack = known.widths.lack(least_wall, self._limits.gap, controls.margin)
        if lack.any():
            thicker = self._metric.gradient(motion.by_chi(lack))
            change += min(lack.max(), controls.recovery) / np.abs(motion.along_normal(thicker)).max() * thicker
        return change

    def _within(self, change: Floats, move: float, motion: SurfaceMotion) -> float:
        """Factor by which a change moves the surface so far, mm; infinite for one that moves nothing."""
        moved = float(np.quantile(np.abs(motion.along_normal(change)), self._controls.moved))
        return move / moved if moved > 0.0 else np.inf
