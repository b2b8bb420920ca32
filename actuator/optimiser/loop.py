"""The outer loop: design updates that each lower the total objective.

Every update solves the inner problem for the Lagrangian along predicted states, which follows the true objective
closely over large steps, and then pays for Newton's method and the adjoint at the new design. Δt is what holds back
a model that promises too much.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from actuator.arrays import Floats
from actuator.equations.arm import COORDINATES
from actuator.failure import SolveFailure
from actuator.optimiser.controls import CONTROLS, Controls
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.inner import InnerProblem, InnerStep, Trust
from actuator.optimiser.model import Model, ModelPoint
from actuator.optimiser.stationarity import stationarity
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from actuator.solve.state import State
from actuator.terms.step import Metric

#: Counts of work that the history holds, and the parts that seconds are booked on.
COUNTS = ("newton", "krylov", "factorisations")
PARTS = ("state", "adjoint", "inner")

Record = dict[str, float]


@dataclass
class Progress:
    """Where an optimisation stands: everything a resumed run needs.

    Attributes:
        evaluation, gradient: of the last accepted design.
        dt: Δt of the next update.
        curvature: from the gradients so far.
        trust: how far the next inner problem trusts quadratics.
        history: one record per accepted design, the initial one first.
        evaluations: designs whose state was solved for, accepted or not.
        inner: steps of all inner problems.
        seconds: computing time of each of :data:`PARTS`.
    """

    evaluation: Evaluation
    gradient: Gradient
    dt: float
    curvature: Curvature
    trust: Trust
    history: list[Record] = field(default_factory=list)
    evaluations: int = 1
    inner: int = 0
    seconds: dict[str, float] = field(default_factory=lambda: dict.fromkeys(PARTS, 0.0))


@dataclass(frozen=True)
class Outcome:
    """How an optimisation ended.

    Attributes:
        progress: the final design and its history.
        converged: whether the stationarity measure was reached.
        reason: one sentence.
    """

    progress: Progress
    converged: bool
    reason: str


class Optimiser:
    """Lowers a reduced objective from an initial design.

    Args:
        objective: the case.
        first_step: Δt of the first update.
        tolerance: stationarity at which the optimisation is converged.
        least_gain: share of C that the last few updates (:attr:`Controls.settled_updates`) must have gained together
            for it to go on.
        max_inner_steps: most steps of an inner problem.
        controls: all other numbers that steer it.
    """

    def __init__(
        self,
        objective: ReducedObjective,
        *,
        first_step: float = 100.0,
        tolerance: float = 1e-3,
        least_gain: float = 0.0,
        max_inner_steps: int = 60,
        controls: Controls = CONTROLS,
    ) -> None:
        self.objective, self.controls = objective, controls
        self.first_step, self.max_inner_steps = first_step, max_inner_steps
        self.tolerance, self.least_gain = tolerance, least_gain
        self.metric = Metric(
            objective.discretisation,
            objective.objective,
            objective.design.gather,
            solver=objective.equilibrium.solver,
            threads=objective.equilibrium.threads,
        )
        self._inner = InnerProblem(objective, self.metric, controls)

    # -------------------------------------------------------------------- start

    def begin(self, chi: Floats, start: tuple[Floats, Floats] | None = None) -> Progress:
        """Evaluate the initial design.

        Args:
            chi: design, (n_vertices,).
            start: x and p to begin Newton's method with; at rest if None.

        Raises:
            actuator.solve.equilibrium.NoState: if it has no state.
        """
        clock = _Clock()
        evaluation = self.objective.evaluate(chi, start)
        clock.lap("state")
        gradient = self.objective.gradient(evaluation)
        clock.lap("adjoint")
        trust = Trust.first(self.controls)
        progress = Progress(evaluation, gradient, self.first_step, self._inner.blank(), trust, seconds=clock.parts)
        progress.history.append(self._record(progress, 0.0))
        return progress

    def checkpoint(self, progress: Progress) -> dict[str, Floats]:
        """Everything :meth:`resume` needs, as arrays."""
        at = progress.evaluation
        columns = {f"history.{key}": np.array([r[key] for r in progress.history]) for key in progress.history[0]}
        return {
            "chi": at.chi,
            "x": at.x,
            "p": at.p,
            "adjoint_x": progress.gradient.adjoint[0],
            "adjoint_p": progress.gradient.adjoint[1],
            "gradient": progress.gradient.total,
            "curvature": progress.curvature.pairs,
            "scalars": np.array([progress.dt, progress.trust.stiffness, progress.trust.reach]),
            **{f"factors.{key}": value for key, value in self.objective.factors.items()},
            **columns,
        }

    def resume(self, arrays: dict[str, Floats]) -> Progress:
        """Continue from the arrays of :meth:`checkpoint`."""
        evaluation = self.objective.evaluate(np.array(arrays["chi"]), (np.array(arrays["x"]), np.array(arrays["p"])))
        adjoint = np.array(arrays["adjoint_x"]), np.array(arrays["adjoint_p"])
        gradient = Gradient(np.array(arrays["gradient"]), adjoint)
        dt, stiffness, reach = (float(v) for v in arrays["scalars"])
        curvature = self._inner.blank()
        curvature.restore(np.array(arrays["curvature"]))
        columns, factors = (
            {key.removeprefix(group): np.array(value) for key, value in arrays.items() if key.startswith(group)}
            for group in ("history.", "factors.")
        )
        self.objective.restore_factors(factors)
        rows = len(next(iter(columns.values())))
        history = [{key: float(column[i]) for key, column in columns.items()} for i in range(rows)]
        last, work = history[-1], self.objective.equilibrium.work
        for key in COUNTS:  # go on counting where the history ends
            setattr(work, key, int(last[key]))
        seconds = {part: last[f"seconds_{part}"] for part in PARTS}
        return Progress(
            evaluation,
            gradient,
            dt,
            curvature,
            Trust(stiffness, reach),
            history,
            int(last["evaluations"]),
            int(last["inner"]),
            seconds,
        )

    # --------------------------------------------------------------------- loop

    def run(self, progress: Progress, max_updates: int, accepted: Callable[[Progress], None] | None = None) -> Outcome:
        """Update the design until it is stationary, ``max_updates`` in all are made, or updates gain too little.

        Args:
            progress: from :meth:`begin` or :meth:`resume`; updated in place.
            accepted: called after every accepted update.
        """
        while True:
            measure = progress.history[-1]["stationarity"]
            if measure <= self.tolerance:
                return Outcome(progress, True, f"The design is stationary (measure {measure:.1e}).")
            if len(progress.history) > max_updates:
                return Outcome(progress, False, f"The limit of {max_updates} design updates is reached.")
            if self._settled(progress):
                return Outcome(
                    progress,
                    False,
                    f"The last {self.controls.settled_updates} design updates lowered C by less than "
                    f"{100.0 * self.least_gain:.2g} % of it; "
                    f"the measure is {measure:.1e}.",
                )
            if not self._update(progress):
                return Outcome(
                    progress, False, f"No smaller step lowers the objective any more; the measure is {measure:.1e}."
                )
            if accepted is not None:
                accepted(progress)

    def _settled(self, progress: Progress) -> bool:
        window = self.controls.settled_updates
        values = [record["C"] for record in progress.history[-window - 1 :]]
        return len(values) > window and values[0] - values[-1] < self.least_gain * abs(values[-1])

    def _update(self, progress: Progress) -> bool:
        """One accepted design update, or False if Δt shrinks to nothing."""
        clock, controls = _Clock(), self.controls
        # The first factors at hand are those of a state on the way from rest.
        model = Model(self.objective, progress.evaluation, progress.gradient, fresh=len(progress.history) == 1)
        clock.lap("state")
        while progress.dt > controls.least_time_step * self.first_step:
            step = self._inner.solve(model, progress.dt, self.max_inner_steps, progress.curvature, progress.trust)
            clock.lap("inner")
            taken, point = None, step.trail[-1] if step.trail else None
            while point is not None:
                taken = self._try(progress, point, step.change(point), clock)
                if taken is not None:
                    break
                point = _earlier(step, point, controls.backtracking)
            if taken is None or point is None:
                if step.trail:
                    # The tangent, and perhaps its factors, have moved to the refused design.
                    model = Model(self.objective, progress.evaluation, progress.gradient)
                    clock.lap("state")
                    progress.dt = min(controls.backtracking * progress.dt, self._holding(step.trail[0], step))
                else:
                    progress.dt *= controls.backtracking
                continue
            progress.evaluation, progress.gradient, ratio = taken
            used, progress.trust = progress.dt, step.trust
            factor = self._trust(min(ratio, 2.0 - ratio))
            if point is not step.trail[-1]:  # Δt grows only where all of the step was taken
                factor = min(factor, 1.0)
            # Far beyond the first Δt the step term weighs nothing: what grows on would only have to be shrunk again.
            progress.dt = min(factor * progress.dt, self.first_step / controls.least_time_step)
            progress.inner += step.steps
            for part, seconds in clock.parts.items():
                progress.seconds[part] += seconds
            progress.history.append(self._record(progress, used))
            return True
        return False

    def _holding(self, refused: ModelPoint, step: InnerStep) -> float:
        """Δt at which the step term of a refused point would have eaten up what it promised."""
        change = -step.change(refused)
        return self.metric.norm(refused.delta) / float(np.sqrt(2.0 * change)) if change > 0.0 else np.inf

    def _trust(self, agreement: float) -> float:
        """Factor on Δt; ``agreement`` is 1 where truth and prediction are equal."""
        controls = self.controls
        if agreement < controls.poor_agreement:
            return controls.backtracking
        return controls.trust_factor if agreement > controls.good_agreement else 1.0

    def _try(
        self, progress: Progress, point: ModelPoint, change: float, clock: _Clock
    ) -> tuple[Evaluation, Gradient, float] | None:
        """Evaluation and gradient of a candidate, and truth over prediction; None if it is refused."""
        progress.evaluations += 1
        try:
            new = self.objective.evaluate(point.chi, (point.x, point.p))
            clock.lap("state")
            ratio = (new.value - progress.evaluation.value) / change
            if not ratio > self.controls.sufficient_decrease:
                return None
            gradient = self.objective.gradient(new, progress.gradient.adjoint)
        except SolveFailure:  # no state, or too close to a limit point for the linear solves
            return None
        clock.lap("adjoint")
        return new, gradient, ratio

    def _record(self, progress: Progress, dt: float) -> Record:
        at, work = progress.evaluation, self.objective.equilibrium.work
        return {
            "update": float(len(progress.history)),
            "evaluations": float(progress.evaluations),
            "C": at.value,
            **at.terms,
            **self._motion(at.state),
            "dt": dt,
            "stationarity": stationarity(at, progress.gradient, self.metric),
            **at.measures,
            **self._by_case(at),
            **{key: float(getattr(work, key)) for key in COUNTS},
            "inner": float(progress.inner),
            **{f"seconds_{part}": seconds for part, seconds in progress.seconds.items()},
            "seconds": sum(progress.seconds.values()),
        }

    def _motion(self, state: State) -> Record:
        """The coordinates of the arm that are free, by name."""
        names = self.objective.equilibrium.kinematics.arm.names
        return {name: float(state.motion[COORDINATES.index(name)]) for name in names}

    def _by_case(self, at: Evaluation) -> Record:
        """What several load cases do, in columns with their names behind a point; C_0 without its weight."""
        record: Record = {}
        for case, state, values in zip(self.objective.cases, at.states, at.of_cases, strict=True):
            if not case.name:
                continue
            found = {"C0": values["C0"].value / case.weight, "C_p": values["C_p"].value}
            found |= self._motion(state)
            found |= {**values["C_psi"].measures, **values["C_p"].measures}
            record |= {f"{name}.{case.name}": value for name, value in found.items()}
        return record


class _Clock:
    """Seconds of each part of an update."""

    def __init__(self) -> None:
        self.parts = dict.fromkeys(PARTS, 0.0)
        self._last = perf_counter()

    def lap(self, part: str) -> None:
        """Book the time since the last lap."""
        now = perf_counter()
        self.parts[part] += now - self._last
        self._last = now


def _earlier(step: InnerStep, refused: ModelPoint, share: float) -> ModelPoint | None:
    """The last point before a refused one that promises at most a share of what it did."""
    limit = share * step.change(refused)
    return next((point for point in reversed(step.trail) if step.change(point) >= limit), None)
