"""Stage ``optimize``: from the initial design to a stationary point of the total objective (Section 2.3)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from pydantic import Field

from stages.design import Result, lines, pack
from stages.domains import DomainSettings
from stages.ended import Reached, recorded, told
from stages.events import Compiled, DesignUpdate, Message, Observer, silent
from stages.initial import InitialSettings, first_design
from stages.load import arm_end, held
from stages.settings import ProblemSettings, Section
from stages.similarity import Units, similar
from stages.task import Compute, Need, Task

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from actuator.domains.interface import Domain
    from actuator.optimiser.loop import Optimiser, Outcome, Progress
    from actuator.solve.reduced import Evaluation, ReducedObjective
    from stages.initial import Given

__all__ = ["VERSION", "Compute", "Result", "Settings", "least_memory", "lines", "needs", "pack", "run", "start"]

VERSION = 16

#: What is said of a state in which a part would not stay.
UNSTABLE = (
    "the design is stored, but its state is not stable: its stiffness with the pressure held has negative eigenvalues "
    "({}), often of void that buckles. `poro inflate` says what the part itself does, `poro simulate` whether the "
    "state is reached from zero pressure; if not, raise material.hessian_regularisation or lower load.pressure_ratio, "
    "and optimise again."
)


#: What is said of a case in which there is nothing to move.
HELD = (
    "The spring is so stiff that it holds the arm's end: C0, which is the travel of that end over L_arm, stays 0 "
    "whatever the design, and only the other terms of C are lowered. Lower load.spring_ratio to optimise; the force at "
    "the held end is in the summary, that of the part in `poro inflate`."
)


class OptimizerSettings(Section):
    """How far and how precisely to optimise."""

    max_updates: int = Field(200, ge=0, description="most design updates [-]")
    stationarity: float = Field(1.0e-3, gt=0, description="stop at this scale-free stationarity measure [-]")
    least_gain: float = Field(
        0.0, ge=0, lt=1, description="stop when five design updates gain less than this share of C; 0 never does [-]"
    )
    state_tolerance: float = Field(1.0e-8, gt=0, lt=1, description="relative residual of the state [-]")
    adjoint_tolerance: float = Field(1.0e-11, gt=0, lt=1, description="relative residual of the adjoint [-]")
    max_inner_steps: int = Field(60, ge=1, description="most steps of the inner problem per design update [-]")
    first_step: float = Field(100.0, gt=0, description="first pseudo-time step Δt [-]")
    keep_updates: int = Field(
        1, ge=0, description="keep the fields of every n-th design update for ParaView; 0 keeps the last only [-]"
    )


class Settings(ProblemSettings):
    """Settings of the optimisation: the problem, the design to begin with, and the optimiser."""

    initial: InitialSettings = InitialSettings()
    optimizer: OptimizerSettings = OptimizerSettings()


def run(
    settings: Settings,
    *,
    compute: Compute | None = None,
    observer: Observer = silent,
    resume: dict[str, Any] | None = None,
    initial: Given | None = None,
) -> Result:
    """Optimise a case.

    Args:
        settings: the case.
        compute: threads and linear solver.
        observer: receives an event per design, the initial one included.
        resume: the checkpoint of an earlier, interrupted run of the same settings.
        initial: what the file holds that the settings name to begin with.

    Raises:
        actuator.failure.InvalidSettings: if the design to begin with is none.
        actuator.solve.equilibrium.NoState: if it has no state.
        actuator.failure.SolveFailure: if a linear solve fails its check.
    """
    # The whole model, and numba with it: only where it runs.
    from actuator.compilation import compile_kernels
    from actuator.optimiser.loop import Optimiser
    from actuator.solve.reduced import ReducedObjective
    from actuator.threads import use_threads

    observer(Message("Preparing the model; the first run after an installation compiles it, which takes a minute."))
    core, units = similar(settings)
    material, load, limits = core.parameters()
    compile_kernels(material.law, lambda done, total: observer(Compiled(done, total)))
    compute = compute or Compute()
    use_threads(compute.threads)
    optimizer, domain = settings.optimizer, core.domain.build()
    objective = ReducedObjective(
        domain,
        material,
        load,
        limits,
        state_tolerance=optimizer.state_tolerance,
        adjoint_tolerance=optimizer.adjoint_tolerance,
        solver=compute.linear_solver,
        threads=compute.threads,
        scheme=settings.elements.scheme(),
    )
    optimiser = Optimiser(
        objective,
        first_step=optimizer.first_step,
        tolerance=optimizer.stationarity,
        least_gain=optimizer.least_gain,
        max_inner_steps=optimizer.max_inner_steps,
    )

    def report(progress: Progress) -> None:
        checkpoint, fields = partial(optimiser.checkpoint, progress), partial(_fields, progress.evaluation, units)
        observer(DesignUpdate(recorded(progress.history[-1], units), optimizer.max_updates, checkpoint, fields))

    if held(settings):
        observer(Message(HELD))
    if resume is None:
        first = first_design(settings.initial, settings, initial)
        if first is None:
            first = domain.initial_design(domain.points, limits.interface_width, limits.length_unit)
        progress = _begin(optimiser, first, observer)
    else:
        progress = optimiser.resume(resume)
        observer(Message(f"Continuing after design update {len(progress.history) - 1}."))
    report(progress)
    outcome = optimiser.run(progress, optimizer.max_updates, report)
    checkpoint = optimiser.checkpoint(progress)  # before other factors are made
    negative = _negative_eigenvalues(objective, progress.evaluation)
    if negative:
        observer(Message(f"The last design's state is not stable ({negative} negative eigenvalues)."))
    result = _result(settings.domain.build(), objective, outcome, checkpoint, units)
    end = arm_end(settings, result.summary["spring_elongation"])
    result.summary.update(end, negative_eigenvalues=negative)
    return result


def _begin(optimiser: Optimiser, chi: Floats, observer: Observer) -> Progress:
    """The first design with its state, by way of smaller pressures where Newton's method from rest does not find it."""
    from actuator.solve.equilibrium import NoState  # as in run
    from actuator.solve.loading import loaded

    try:
        return optimiser.begin(chi)
    except NoState as failure:
        observer(Message(f"{str(failure).partition(':')[0]}; the pressure is raised from zero in steps."))
    state = loaded(
        optimiser.objective.equilibrium, chi, lambda load: observer(Message(f"  state at {load:.0%} of p_in"))
    )
    return optimiser.begin(chi, (state.x, state.p))


def _second_order_leak(objective: ReducedObjective, at: Evaluation) -> dict[str, float]:
    """The leak by second-order elements; nothing if they cannot: a result is not lost because a check fails."""
    from actuator.failure import SolveFailure  # as in run
    from actuator.solve.leak_check import second_order_leak

    try:
        leak = second_order_leak(objective.equilibrium, at.state)
    except SolveFailure:
        return {}
    return {
        "wall_leak_second_order": leak.largest,
        "C_p_second_order": 0.5 * objective.objective.leak_weight * leak.mean_square,
    }


def _negative_eigenvalues(objective: ReducedObjective, at: Evaluation) -> int | None:
    """Of the state's stiffness; None if not known. A result is not lost because one more factorisation fails."""
    from actuator.failure import SolveFailure  # as in run

    try:
        return objective.equilibrium.linearise(at.state, fresh=True).negative_eigenvalues
    except SolveFailure:
        return None


def _fields(at: Evaluation, units: Units) -> dict[str, Floats]:
    """Design and state at the vertices, which are the first of the nodes; N/mm² and mm."""
    displacement = at.state.displacement[: len(at.chi)]
    return {"chi": at.chi, "pressure": units.stress * at.state.p, "displacement": units.length * displacement}


#: Bytes that a cell with shape functions of its own adds. Kept are 14 points with gradients of 8 and 20 functions, one
#: weight and 3 coordinates, and 20 x 20 products of second derivatives, in double precision: 13.1 kB. While they are
#: made there are about three of them.
OF_A_CLASS = 3 * 8 * (14 * (3 * (8 + 20) + 1 + 3) + 20 * 20)


def least_memory(cells: int, classes: int = 0) -> float:
    """Memory that one evaluation of a design, or a simulation, needs on a mesh, bytes.

    Fitted to benchmarks/results/scaling.md, 1,080 to 30,000 cells, to 25 %: the program itself, what is kept per cell,
    and factors whose fill grows as n^(4/3) under nested dissection (A. George, doi:10.1137/0710032). A long
    optimisation keeps more.

    Args:
        cells: of the mesh.
        classes: how many of them have shape functions of their own in a domain that is not swept.
    """
    return (0.45 + 6.1e-5 * cells + 5.1e-6 * cells ** (4.0 / 3.0)) * 2.0**30 + OF_A_CLASS * classes


def _result(
    domain: Domain, objective: ReducedObjective, outcome: Outcome, checkpoint: dict[str, Floats], units: Units
) -> Result:
    from actuator.solve.reduced import wall_leak  # as in run

    at = outcome.progress.evaluation
    checks = {
        "wall_leak": wall_leak(objective.domain, at.state.p, objective.load.pressure),
        **_second_order_leak(objective, at),
        "passive_share": objective.design.passive.share(at.chi),
    }
    state = Reached(objective.equilibrium.kinematics, at.chi, at.state.x, at.state.p)
    return told(domain, state, outcome.progress.history, tuple(at.terms), checks, outcome, checkpoint, units)


def coarser(domain: DomainSettings) -> str:
    """What to change for a mesh of fewer cells."""
    if not domain.counts:
        return "give a coarser mesh"
    *most, last = (f"domain.{key}" for key in domain.counts)
    return f"lower {' or '.join([', '.join(most), last] if most else [last])}"


def needs(case: Any) -> Need:
    """Least memory for a case."""
    cells = case.domain.cells
    return Need(cells, least_memory(cells, case.domain.classes), coarser(case.domain))


def instability(summary: Mapping[str, Any], path: str) -> str:
    """Why the last design's state would not last; empty if it is stable, or the solver did not tell."""
    negative = summary.get("negative_eigenvalues")
    return f"{path}: {UNSTABLE.format(negative)}" if negative else ""


def start(task: Task) -> Result:
    """Optimise a case."""
    resume = None if task.resume is None else dict(task.resume)
    return run(task.case.optimize, compute=task.compute, observer=task.observer, resume=resume, initial=task.initial)
