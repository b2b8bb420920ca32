"""Bounds on a design step by a primal-dual interior point method.

    min over s of  F(s) + Σ_q w_q c/2 ⟨a_q·s − d_q⟩²

for the bounds of C_χ at the quadrature points (Eq. 21: d_q = limit_q − χ_q, c = c_χ; where regions are to stay solid
also from below), and, c being infinite, for the largest change of χ at the vertices.

A wall as steep as C_χ is flat right up to its kink. Newton's method, which sees no wall from where it stands, runs far
through it at a thousand points at once, and with the wall's stiffness added there it hardly moves: it stalls. Slacks
and multipliers hold the place of the wall instead,

    y_q = d_q − a_q·s + λ_q / c,   λ_q y_q = β → 0,   y, λ > 0

(Nocedal & Wright 2006, ch. 19): a few Newton steps, however many constraints are active.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from actuator.arrays import Bools, Floats
from actuator.optimiser.controls import CONTROLS, Controls


@dataclass(frozen=True)
class Bounds:
    """Bounds a_q·s ≤ d_q.

    Attributes:
        room: d_q.
        volumes: w_q, same shape.
        compliance: 1 / c; 0 where the bound is rigid.
        at_points: a_q·s of a step (n_vertices,).
        from_points: Σ w_q λ_q a_q, (n_vertices,).
        stiffness: Σ w_q σ_q a_q a_qᵀ, data of the upper triangle.
    """

    room: Floats
    volumes: Floats
    compliance: float
    at_points: Callable[[Floats], Floats]
    from_points: Callable[[Floats], Floats]
    stiffness: Callable[[Floats], Floats]


@dataclass
class _Walls:
    """Slacks and multipliers of one set of bounds, and their Newton step."""

    bounds: Bounds
    y: Floats
    multiplier: Floats
    missed: Floats = field(init=False)
    slope: Floats = field(init=False)
    constant: Floats = field(init=False)

    @property
    def gap(self) -> float:
        return float(np.sum(self.bounds.volumes * self.multiplier * self.y))

    def linearise(self, s: Floats) -> Floats:
        bounds, multiplier = self.bounds, self.multiplier
        self.missed = bounds.room - bounds.at_points(s) + multiplier * bounds.compliance - self.y
        self.slope = self.y + multiplier * bounds.compliance
        return bounds.stiffness(multiplier / self.slope)

    def push(self, target: Floats | float) -> Floats:
        self.constant = (target - self.multiplier * (self.y + self.missed)) / self.slope
        return self.bounds.from_points(self.multiplier + self.constant)

    def step(self, ds: Floats) -> tuple[Floats, Floats]:
        at_points = self.bounds.at_points(ds)
        multiplier = self.constant + self.multiplier / self.slope * at_points
        return self.missed - at_points + multiplier * self.bounds.compliance, multiplier


class Barrier:
    """The bounds of one subproblem, from s = 0.

    Args:
        bounds: one or more sets of them.
        start: λ y to begin with; positive.
        controls: the numbers that steer it.
    """

    def __init__(self, bounds: Sequence[Bounds], start: float, controls: Controls = CONTROLS) -> None:
        self._controls = controls
        self._walls: list[_Walls] = []
        self._steps: list[tuple[Floats, Floats]] = []
        self._share = 0.0
        for each in bounds:
            y = np.maximum(each.room, controls.least_slack)
            self._walls.append(_Walls(each, y, start / y))
        self._volume = sum(float(each.volumes.sum()) for each in bounds)

    @property
    def gap(self) -> float:
        """Σ w λ y: F may fall by at most about as much; near the end it is mostly far less."""
        return sum(wall.gap for wall in self._walls)

    def linearise(self, s: Floats) -> Floats:
        """Take up a step; what the bounds add to the Hessian there, data of its upper triangle."""
        return np.asarray(sum(wall.linearise(s) for wall in self._walls))

    def push(self, along: Floats | None = None) -> Floats:
        """What the bounds add to the residual of a Newton step, (n_vertices,).

        Args:
            along: the step without a barrier, β = 0. How far it may go sets the barrier, and what it misses of the
                product λ y is added (S. Mehrotra 1992, doi:10.1137/0802028). None for that step itself.
        """
        if along is None:
            return np.asarray(sum(wall.push(0.0) for wall in self._walls))
        share = self.longest(along)
        left = sum(
            float(np.sum(wall.bounds.volumes * (wall.y + share * dy) * (wall.multiplier + share * d_multiplier)))
            for wall, (dy, d_multiplier) in zip(self._walls, self._steps, strict=True)
        )
        barrier = (left / self.gap) ** 3 * self.gap / self._volume
        return np.asarray(
            sum(
                wall.push(barrier - dy * d_multiplier)
                for wall, (dy, d_multiplier) in zip(self._walls, self._steps, strict=True)
            )
        )

    def longest(self, ds: Floats) -> float:
        """Share of a Newton step ds, at most 1, that leaves slacks and multipliers positive."""
        share, self._steps = 1.0, [wall.step(ds) for wall in self._walls]
        for wall, changes in zip(self._walls, self._steps, strict=True):
            for value, change in zip((wall.y, wall.multiplier), changes, strict=True):
                falling = change < 0.0
                to_zero = float(np.min(-value[falling] / change[falling], initial=np.inf))
                share = min(share, self._controls.boundary_share * to_zero)
        return share

    def move(self, share: float) -> None:
        """Go a share of the last Newton step given to :meth:`longest`."""
        self._share = share
        for wall, (dy, d_multiplier) in zip(self._walls, self._steps, strict=True):
            wall.y, wall.multiplier = wall.y + share * dy, wall.multiplier + share * d_multiplier

    def met(self, sets: int) -> list[Bools] | None:
        """Which of the first sets of bounds the solution touches, or None where the last step does not tell.

        With the barrier, the slacks of these fall to zero and their multipliers stay; of the others it is the
        multipliers that fall (El-Bakry, Tapia & Zhang 1994, doi:10.1137/1036003).
        """
        controls = self._controls
        contrasts = [
            d_multiplier / wall.multiplier - dy / wall.y
            for wall, (dy, d_multiplier) in zip(self._walls[:sets], self._steps, strict=False)
        ]
        met = [np.asarray(contrast > 0.0) for contrast in contrasts]
        alike = sum(int((np.abs(contrast) < controls.alike).sum()) for contrast in contrasts)
        if self._share < controls.good_agreement or alike > controls.unclear * sum(int(each.sum()) for each in met):
            return None
        return met
