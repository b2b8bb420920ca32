"""The outer loop: design updates that each lower the total objective.

Every update solves the inner problem for the current model, checks the model along the step by an exact
Hessian-vector product and learns from it until model and truth agree, tests the predicted state at several step
lengths, and only then pays for Newton's method. Δt is a trust region.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np

from actuator.domain import Floats
from actuator.failure import SolveFailure
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.inner import InnerProblem
from actuator.optimiser.metric import Metric
from actuator.optimiser.model import Model
from actuator.optimiser.stationarity import stationarity
from actuator.reduced import Evaluation, Gradient, Product, ReducedObjective

#: Most exact products per update, and how well model and truth must agree along the step.
MAX_PRODUCTS = 3
AGREEMENT = 0.1
#: Thresholds and factors of the trust region, after Conn, Gould & Toint 2000, Alg. 6.1.1.
ACCEPT, POOR, GOOD, VERY_GOOD = 0.01, 0.25, 0.5, 0.8
SHRINK, SHORTEN, WIDEN, GROW = 0.5, 0.3, 1.3, 2.0
#: Share of the step term in the predicted change above which Δt is what limits the step.
BINDING = 0.05
#: Step lengths along the inner solution at which the predicted state is tried.
LENGTHS = (1.0, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1)
#: The search ends where Δt has shrunk to this part of its first value and χ would change by no more than this.
SMALLEST_STEP, SMALLEST_CHANGE = 1e-4, 1e-5
#: Counts of work that the history holds.
COUNTS = ("newton", "krylov", "products", "factorisations")

Record = dict[str, float]


@dataclass
class Progress:
    """Where an optimisation stands: everything a resumed run needs.

    Attributes:
        evaluation, gradient: of the last accepted design.
        dt: Δt of the next update.
        curvature: what has been learnt of the mechanics.
        history: one record per accepted design, the initial one first.
        evaluations: designs whose state was solved for, accepted or not.
        seconds: spent so far, over all sessions.
    """

    evaluation: Evaluation
    gradient: Gradient
    dt: float
    curvature: Curvature
    history: list[Record] = field(default_factory=list)
    evaluations: int = 1
    seconds: float = 0.0


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


@dataclass(frozen=True)
class _Candidate:
    delta: Floats
    model_change: float
    bound: bool
    product: Product


@dataclass(frozen=True)
class _Trial:
    length: float
    change: float
    start: tuple[Floats, Floats]


class Optimiser:
    """Lowers a reduced objective from an initial design.

    Args:
        objective: the case.
        first_step: Δt of the first update.
        tolerance: stationarity at which the optimisation is converged.
        product_tolerance: relative residual of the solves in Hessian-vector products.
    """

    def __init__(
        self,
        objective: ReducedObjective,
        *,
        first_step: float = 100.0,
        tolerance: float = 1e-3,
        product_tolerance: float = 1e-8,
    ) -> None:
        self.objective = objective
        self.first_step, self.tolerance, self.product_tolerance = first_step, tolerance, product_tolerance
        self.metric = Metric(
            objective.discretisation,
            objective.objective.diffusivity_length,
            objective.design.gather,
            solver=objective.equilibrium.solver,
            threads=objective.equilibrium.threads,
        )
        self._inner = InnerProblem(objective, self.metric)

    # -------------------------------------------------------------------- start

    def begin(self, chi: Floats) -> Progress:
        """Evaluate the initial design.

        Raises:
            actuator.state.NoState: if it has no state.
        """
        began = perf_counter()
        evaluation = self.objective.evaluate(chi)
        gradient = self.objective.gradient(evaluation)
        progress = Progress(evaluation, gradient, self.first_step, Curvature(self.metric))
        progress.seconds = perf_counter() - began
        progress.history.append(self._record(progress, 0.0))
        return progress

    def checkpoint(self, progress: Progress) -> dict[str, Floats]:
        """Everything :meth:`resume` needs, as arrays."""
        state = progress.evaluation.state
        columns = {f"history.{key}": np.array([r[key] for r in progress.history]) for key in progress.history[0]}
        return {
            "chi": state.chi,
            "x": state.x,
            "p": state.p,
            "adjoint_x": progress.gradient.adjoint[0],
            "adjoint_p": progress.gradient.adjoint[1],
            "gradient": progress.gradient.total,
            "scalars": np.array([progress.dt, progress.evaluations, progress.seconds]),
            **{f"curvature.{key}": value for key, value in progress.curvature.arrays().items()},
            **columns,
        }

    def resume(self, arrays: dict[str, Floats]) -> Progress:
        """Continue from the arrays of :meth:`checkpoint`."""
        evaluation = self.objective.evaluate(np.array(arrays["chi"]), (np.array(arrays["x"]), np.array(arrays["p"])))
        adjoint = np.array(arrays["adjoint_x"]), np.array(arrays["adjoint_p"])
        gradient = Gradient(np.array(arrays["gradient"]), adjoint)
        curvature = Curvature(self.metric)
        curvature.restore(_part(arrays, "curvature."))
        dt, evaluations, seconds = (float(v) for v in arrays["scalars"])
        columns = _part(arrays, "history.")
        rows = len(next(iter(columns.values())))
        history = [{key: float(column[i]) for key, column in columns.items()} for i in range(rows)]
        work = self.objective.equilibrium.work
        for key in COUNTS:  # go on counting where the history ends
            setattr(work, key, int(history[-1][key]))
        return Progress(evaluation, gradient, dt, curvature, history, int(evaluations), seconds)

    # --------------------------------------------------------------------- loop

    def run(self, progress: Progress, max_updates: int, accepted: Callable[[Progress], None] | None = None) -> Outcome:
        """Update the design until it is stationary, ``max_updates`` in all are made, or no step helps.

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
            if not self._update(progress):
                return Outcome(
                    progress, False, f"No smaller step lowers the objective any more; the measure is {measure:.1e}."
                )
            if accepted is not None:
                accepted(progress)

    def _update(self, progress: Progress) -> bool:
        """One accepted design update, or False if Δt shrinks to nothing."""
        began = perf_counter()
        old = progress.evaluation
        # One fresh factorisation per accepted design: the run does not depend on where it was interrupted.
        self.objective.equilibrium.refresh()
        model = Model(self.objective, old, progress.gradient, progress.curvature)
        while True:
            candidate = self._candidate(progress, model)
            small = float(np.abs(candidate.delta).max()) < SMALLEST_CHANGE
            if small and progress.dt < SMALLEST_STEP * self.first_step:
                return False
            trial = self._predict(old, model, candidate) if candidate.model_change < 0.0 else None
            if trial is None:
                progress.dt *= SHRINK
                continue
            delta = trial.length * candidate.delta
            progress.evaluations += 1
            try:
                new = self.objective.evaluate(old.chi + delta, trial.start)
            except SolveFailure:  # no state, or too close to a limit point for the linear solves
                progress.dt *= SHRINK * trial.length
                continue
            ratio = (new.value - old.value) / trial.change
            if not ratio > ACCEPT:
                progress.dt *= SHRINK * trial.length
                continue
            progress.evaluation, progress.gradient = new, self.objective.gradient(new, progress.gradient.adjoint)
            model.learn_from(new, progress.gradient)
            agreement = trial.change / candidate.model_change if trial.length == 1.0 else 0.0
            used = progress.dt
            factor = _trust(min(ratio, 2.0 - ratio), agreement, trial.length)
            progress.dt *= factor if candidate.bound else min(factor, 1.0)
            progress.seconds += perf_counter() - began
            progress.history.append(self._record(progress, used))
            return True

    def _candidate(self, progress: Progress, model: Model) -> _Candidate:
        """Inner solution along which the model knows state and curvature."""
        old = progress.evaluation
        for _ in range(MAX_PRODUCTS):
            step = self._inner.solve(model, progress.dt)
            product = self.objective.product(old, progress.gradient, step.delta, self.product_tolerance)
            if model.learn(step.delta, product) <= AGREEMENT * abs(step.change):
                break
        # Δt holds the step back only if the step term weighs something in the model.
        bound = step.step_term > BINDING * abs(step.change)
        return _Candidate(step.delta, step.change, bound, product)

    def _predict(self, old: Evaluation, model: Model, candidate: _Candidate) -> _Trial | None:
        """The length along the candidate whose linearly predicted state promises most, or None if none does."""
        best: _Trial | None = None
        for length in LENGTHS:
            dx = length * candidate.product.dx
            predicted = model.predict(length * candidate.delta, dx)
            change = np.inf if predicted is None else predicted[0]
            if best is not None and not change < best.change:
                break
            if predicted is not None and change < 0.0:
                best = _Trial(length, change, (old.state.x + dx, predicted[1]))
        if best is None or best.change > ACCEPT * candidate.model_change:
            return None
        return best

    def _record(self, progress: Progress, dt: float) -> Record:
        at, work = progress.evaluation, self.objective.equilibrium.work
        return {
            "update": float(len(progress.history)),
            "evaluations": float(progress.evaluations),
            "C": at.value,
            **at.terms,
            "T1": float(at.state.arm[0]),
            "T3": float(at.state.arm[1]),
            "theta2": float(at.state.arm[2]),
            "dt": dt,
            "stationarity": stationarity(at, progress.gradient, self.metric),
            "energy_ratio": at.energy_ratio,
            "steepest": at.design.steepest,
            **{key: float(getattr(work, key)) for key in COUNTS},
            "seconds": progress.seconds,
        }


def _part(arrays: dict[str, Floats], prefix: str) -> dict[str, Floats]:
    return {key.removeprefix(prefix): value for key, value in arrays.items() if key.startswith(prefix)}


def _trust(ratio: float, agreement: float, length: float) -> float:
    """Factor on Δt from truth over prediction, prediction over model, and the length taken."""
    if length < 1.0:
        return max(length, SHORTEN)
    if ratio < POOR or agreement < POOR:
        return SHRINK
    if ratio > VERY_GOOD and agreement > VERY_GOOD:
        return GROW
    return WIDEN if ratio > GOOD and agreement > GOOD else 1.0
