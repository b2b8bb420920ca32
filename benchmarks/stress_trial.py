"""One case under stress: its state and gradient from rest, or a few design updates, with errors and reasons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import process_time
from typing import Any

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.failure import Failure
from actuator.optimiser.loop import Optimiser
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from actuator.solver_name import SolverName
from actuator.threads import use_threads
from stages.domains import HalfCylinderSettings
from stages.settings import ObjectiveSettings, ProblemSettings
from stages.similarity import similar

#: 320 cells of about 3 mm: m, k, layers.
MESH = {"core_cells": 4, "rings": 2, "layers": 5}

#: Tighter than the program's, so that errors of the method are seen and not the tolerance.
STATE, ADJOINT = 1e-11, 1e-11

#: Terms of C that depend on the state; a derivative below this part of their sum counts as that part.
PHYSICS, LEAST = ("C0", "C_p", "C_psi"), 1e-6

#: Step of the fourth-order central differences of χ.
STEP = 1e-3


def settings(**changes: float) -> ProblemSettings:
    """The paper's case on the small mesh with changes, named ``section__key``."""
    printed = ObjectiveSettings(strain_energy_shift="4/L_i")
    data: dict[str, Any] = ProblemSettings(domain=HalfCylinderSettings(**MESH), objective=printed).model_dump()
    for name, value in changes.items():
        section, key = name.split("__")
        data[section][key] = value
    return ProblemSettings.model_validate(data)


@dataclass(frozen=True)
class Trial:
    """What is tried.

    Attributes:
        what, value: of the row.
        case: the problem.
        design: χ at the vertices of a domain; None for that of Appendix C.
        domain: another mesh than the case's.
        updates: design updates.
        solver, threads: as the program takes them.
        tolerance: relative residual of the state.
    """

    what: str
    value: str
    case: ProblemSettings = field(default_factory=settings)
    design: Callable[[Domain], Floats] | None = None
    domain: Domain | None = None
    updates: int = 0
    solver: SolverName = "auto"
    threads: int = 1
    tolerance: float = STATE

    @property
    def core(self) -> ProblemSettings:
        """The case in the units in which the program computes it."""
        return similar(self.case)[0]

    def objective(self) -> ReducedObjective:
        """The case's objective, on this trial's mesh."""
        use_threads(self.threads)
        domain = self.domain or self.core.domain.build()
        return ReducedObjective(
            domain,
            *self.core.parameters(),
            state_tolerance=self.tolerance,
            adjoint_tolerance=ADJOINT if self.tolerance == STATE else 1e-10,
            solver=self.solver,
            threads=self.threads,
        )

    def chi(self, domain: Domain) -> Floats:
        """The design to begin with, (n_vertices,)."""
        if self.design is not None:
            return self.design(domain)
        limits = self.core.objective
        return domain.initial_design(domain.points, limits.interface_width, limits.length_unit)


@dataclass
class Found:
    """What came of a trial.

    Attributes:
        trial: the trial.
        objective: of the case.
        evaluation, gradient: of the last design; None if there is no state.
        start: evaluation of the first design.
        reason: what the program said where it failed or stopped; empty if all went well.
        history: records of the design updates.
        newton, krylov, factorisations: work of the state and the gradient, or of all updates.
        seconds: processor time of it.
    """

    trial: Trial
    objective: ReducedObjective
    evaluation: Evaluation | None = None
    gradient: Gradient | None = None
    start: Evaluation | None = None
    reason: str = ""
    history: list[dict[str, float]] = field(default_factory=list)
    newton: int = 0
    krylov: int = 0
    factorisations: int = 0
    seconds: float = 0.0

    @property
    def converged(self) -> bool:
        """Whether there is a state with a gradient."""
        return self.gradient is not None

    @property
    def at(self) -> Evaluation:
        assert self.evaluation is not None, self.reason
        return self.evaluation

    @property
    def slope(self) -> Gradient:
        assert self.gradient is not None, self.reason
        return self.gradient

    @cached_property
    def length(self) -> float:
        return self.objective.domain.length

    @property
    def answers(self) -> dict[str, Floats]:
        """What does not depend on units: T1/L, T3/L, θ2, p/p_in, the terms of C, and dC/dχ."""
        state, pressure = self.at.state, self.objective.load.pressure or 1.0
        return {
            "T1/L": state.arm[:1] / self.length,
            "T3/L": state.arm[1:2] / self.length,
            "theta2": state.arm[2:],
            "p/p_in": state.p / pressure,
            **{name: np.array([value]) for name, value in self.at.terms.items()},
            "dC/dchi": self.slope.total,
        }


def difference(found: Found, reference: Found) -> float:
    """Largest difference of two results in any of :attr:`Found.answers`, relative to the reference's."""
    ours, theirs = found.answers, reference.answers
    return max(float(np.abs(ours[name] - value).max() / (np.abs(value).max() or 1.0)) for name, value in theirs.items())


def run(trial: Trial) -> Found:
    """State and gradient from rest, and design updates if there are to be any; NumPy's warnings are errors."""
    objective = trial.objective()
    found = Found(trial, objective)
    began = process_time()
    with np.errstate(all="raise", under="ignore"):
        try:
            if trial.updates:
                _update(found)
            else:
                found.start = found.evaluation = objective.evaluate(trial.chi(objective.domain))
                found.gradient = objective.gradient(found.evaluation)
        except Failure as reason:
            found.reason = str(reason)
    found.seconds = process_time() - began
    work = objective.equilibrium.work
    found.newton, found.krylov, found.factorisations = work.newton, work.krylov, work.factorisations
    if found.converged and not all(np.isfinite(values).all() for values in found.answers.values()):
        raise FloatingPointError(f"{trial.what} {trial.value}: the result is not finite")
    return found


def _update(found: Found) -> None:
    optimiser = Optimiser(found.objective)
    progress = optimiser.begin(found.trial.chi(found.objective.domain))
    found.start = found.evaluation = progress.evaluation
    found.gradient = progress.gradient
    try:
        outcome = optimiser.run(progress, found.trial.updates)
    finally:
        found.evaluation, found.gradient, found.history = progress.evaluation, progress.gradient, progress.history
    if len(progress.history) <= found.trial.updates:
        found.reason = outcome.reason


# ------------------------------------------------------------------------------------------- errors


def residual(found: Found) -> float:
    """Relative residual of the state, by an equilibrium that has never seen it."""
    trial, state = found.trial, found.at.state
    equilibrium = Equilibrium(found.objective.domain, *trial.core.parameters(), threads=1)
    rx, rp, _, lowest = equilibrium.residual(state.chi, state.x, state.p)
    return equilibrium.norm(rx, rp) if lowest > 0.0 else np.inf


def gradient_error(found: Found) -> float:
    """Adjoint derivative against fourth-order differences of converged states, along a wave; relative.

    Of the physics alone: the terms of the design are exact elsewhere, and so large that they would hide it.
    """
    objective, at = found.objective, found.at
    points = objective.domain.points * (15.0 / objective.domain.size)
    wave = np.cos(points @ [0.25, -0.4, 0.3])
    state, (lx, lp) = at.state, found.slope.adjoint
    physical, _, _ = objective.derivatives(state.chi, state.x, state.p, lx, lp, state.nodal)
    slope = float(physical @ wave)

    def physics(h: float) -> float:
        there = objective.evaluate(at.chi + h * wave, (state.x, state.p))
        return sum(there.terms[name] for name in PHYSICS)

    try:
        near, far = physics(STEP) - physics(-STEP), physics(2.0 * STEP) - physics(-2.0 * STEP)
    except Failure:  # a neighbour has no state: nothing to compare with
        return np.nan
    measured = (8.0 * near - far) / (12.0 * STEP)
    size = LEAST * sum(abs(at.terms[name]) for name in PHYSICS)
    return abs(slope - measured) / (max(abs(measured), size) or 1.0)


def again(trial: Trial, **changes: Any) -> Found:
    """Run a trial with some of its attributes replaced."""
    return run(replace(trial, **changes))
