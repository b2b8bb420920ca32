"""Stage ``optimize``: from the initial design to a stationary point of the total objective (Section 2.3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from pydantic import Field

from stages.chambers import posed, refuse_joined
from stages.design import Result, lines, pack
from stages.domains import DomainSettings
from stages.ended import Reached, recorded, told
from stages.events import Compiled, DesignUpdate, Message, Observer, silent
from stages.initial import InitialSettings, first_design
from stages.load import arm_end, held, refuse_across
from stages.regions import regions_on
from stages.settings import ProblemSettings, Section
from stages.similarity import Units, similar
from stages.task import Compute, Need, Task

if TYPE_CHECKING:
    from actuator.arrays import Floats
    from actuator.domains.interface import Domain
    from actuator.optimiser.loop import Optimiser, Outcome, Progress
    from actuator.solve.reduced import Evaluation, ReducedObjective
    from stages.initial import Given
    from stages.regions import Bodies

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
    bodies: Bodies | None = None,
) -> Result:
    """Optimise a case.

    Args:
        settings: the case.
        compute: threads and linear solver.
        observer: receives an event per design, the initial one included.
        resume: the checkpoint of an earlier, interrupted run of the same settings.
        initial: what the file holds that the settings name to begin with.
        bodies: what the files hold that regions name, by the number of the region.

    Raises:
        actuator.failure.InvalidSettings: if the design to begin with is none, or a region cannot be kept.
        actuator.failure.NotManifold: if the triangles in a file bound no solid.
        actuator.solve.equilibrium.NoState: if it has no state.
        actuator.failure.SolveFailure: if a linear solve fails its check.
    """
    # The whole model, and numba with it: only where it runs.
    from actuator.compilation import compile_kernels
    from actuator.geometry.zero_set import Surface
    from actuator.optimiser.loop import Optimiser
    from actuator.solve.reduced import ReducedObjective
    from actuator.threads import use_threads

    refuse_joined(settings)
    refuse_across(settings)
    bodies = bodies or {}
    _check_regions(settings, bodies)
    observer(Message("Preparing the model; the first run after an installation compiles it, which takes a minute."))
    core, units = similar(settings)
    material, _, limits = core.parameters()
    compile_kernels(material.law, lambda done, total: observer(Compiled(done, total)))
    compute = compute or Compute()
    use_threads(compute.threads)
    optimizer, domain = settings.optimizer, posed(core)
    in_units = {number: Surface(body.vertices / units.length, body.triangles) for number, body in bodies.items()}
    regions = regions_on(domain, core.regions, in_units)
    objective = ReducedObjective(
        domain,
        material,
        core.load_cases(),
        limits,
        state_tolerance=optimizer.state_tolerance,
        adjoint_tolerance=optimizer.adjoint_tolerance,
        solver=compute.linear_solver,
        threads=compute.threads,
        scheme=settings.elements.scheme(),
        regions=regions,
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

    if held(settings) and settings.objective.goal is None:
        observer(Message(HELD))
    if resume is None:
        first, widths = first_design(settings.initial, settings, initial), (limits.interface_width, limits.length_unit)
        if first is None:
            first = regions.fitted(domain.initial_design(domain.points, *widths), *widths)
        else:
            first = regions.clipped(first, *widths)
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
    result = replace(_result(settings.domain.build(), objective, outcome, checkpoint, units), bodies=bodies)
    end = arm_end(settings, result.summary["spring_elongation"])
    result.summary.update(end, negative_eigenvalues=negative)
    return result


def _check_regions(settings: Settings, bodies: Bodies) -> None:
    """Refuse regions that cannot be kept, in the units of the case, before anything is compiled."""
    if settings.regions:
        _, _, limits = settings.parameters()
        regions_on(settings.domain.build(), settings.regions, bodies).check(limits.interface_width, limits.length_unit)


def _begin(optimiser: Optimiser, chi: Floats, observer: Observer) -> Progress:
    """The first design with its state, by way of smaller pressures where Newton's method from rest does not find it."""
    from actuator.solve.equilibrium import NoState  # as in run
    from actuator.solve.loading import loaded
    from actuator.solve.stacking import stacked

    try:
        return optimiser.begin(chi)
    except NoState as failure:
        observer(Message(f"{str(failure).partition(':')[0]}; the pressure is raised from zero in steps."))
    states = []
    for case in optimiser.objective.cases:
        of_case = f" of load case '{case.name}'" if case.name else ""

        def reached(load: float, of_case: str = of_case) -> None:
            observer(Message(f"  state at {load:.0%} of p_in{of_case}"))

        states.append(loaded(case.equilibrium, chi, reached))
    return optimiser.begin(chi, (stacked([state.x for state in states]), stacked([state.p for state in states])))


def _second_order_leak(objective: ReducedObjective, at: Evaluation) -> dict[str, float]:
    """The leak by second-order elements; nothing if they cannot: a result is not lost because a check fails."""
    from actuator.failure import SolveFailure  # as in run
    from actuator.solve.leak_check import second_order_leak

    try:
        leaks = [
            second_order_leak(case.equilibrium, state) for case, state in zip(objective.cases, at.states, strict=True)
        ]
    except SolveFailure:
        return {}
    return {
        "wall_leak_second_order": max(leak.largest for leak in leaks),
        "C_p_second_order": sum(0.5 * objective.objective.leak_weight * leak.mean_square for leak in leaks),
    }


def _negative_eigenvalues(objective: ReducedObjective, at: Evaluation) -> int | None:
    """Of the states' stiffness, together; None if not known. A result is not lost because a factorisation fails."""
    from actuator.failure import SolveFailure  # as in run

    try:
        found = [
            case.equilibrium.linearise(state, fresh=True).negative_eigenvalues
            for case, state in zip(objective.cases, at.states, strict=True)
        ]
    except SolveFailure:
        return None
    return sum(known) if len(known := [each for each in found if each is not None]) == len(found) else None


def _fields(at: Evaluation, units: Units) -> dict[str, Floats]:
    """Design and state at the vertices, which are the first of the nodes; N/mm² and mm."""
    displacement = at.state.displacement[: len(at.chi)]
    return {"chi": at.chi, "pressure": units.stress * at.state.p, "displacement": units.length * displacement}


#: Bytes that a cell with shape functions of its own adds. Kept are 14 points with gradients of 8 and 20 functions, one
#: weight and 3 coordinates, and 20 x 20 products of second derivatives, in double precision: 13.1 kB. While they are
#: made there are about three of them.
OF_A_CLASS = 3 * 8 * (14 * (3 * (8 + 20) + 1 + 3) + 20 * 20)


def least_memory(cells: int, classes: int = 0, load_cases: int = 1) -> float:
    """Memory that one evaluation of a design, or a simulation, needs on a mesh, bytes.

    Fitted to benchmarks/results/scaling.md, 1,080 to 30,000 cells, to 25 %: the program itself, what is kept per cell,
    and factors whose fill grows as n^(4/3) under nested dissection (A. George, doi:10.1137/0710032). A long
    optimisation keeps more. Every load case has a tangent and factors of its own.

    Args:
        cells: of the mesh.
        classes: how many of them have shape functions of their own in a domain that is not swept.
        load_cases: how many there are.
    """
    states = load_cases * (6.1e-5 * cells + 5.1e-6 * cells ** (4.0 / 3.0))
    return (0.45 + states) * 2.0**30 + OF_A_CLASS * classes


def _result(
    domain: Domain, objective: ReducedObjective, outcome: Outcome, checkpoint: dict[str, Floats], units: Units
) -> Result:
    from actuator.solve.reduced import wall_leak  # as in run

    at, passive = outcome.progress.evaluation, objective.design.passive
    checks = {
        "wall_leak": max(
            wall_leak(objective.domain, state.p, case.load.pressure)
            for case, state in zip(objective.cases, at.states, strict=True)
        ),
        **_second_order_leak(objective, at),
        "passive_share": passive.share(at.chi),
        **({"solid_missing": passive.missing(at.chi)} if passive.lower is not None else {}),
    }
    state = Reached(
        [case.case for case in objective.cases],
        [case.equilibrium.kinematics for case in objective.cases],
        at.chi,
        [state.x for state in at.states],
        [state.p for state in at.states],
    )
    return told(domain, state, outcome.progress.history, tuple(at.terms), checks, outcome, checkpoint, units)


def coarser(domain: DomainSettings) -> str:
    """What to change for a mesh of fewer cells."""
    if not domain.counts:
        return "give a coarser mesh"
    *most, last = (f"domain.{key}" for key in domain.counts)
    return f"lower {' or '.join([', '.join(most), last] if most else [last])}"


def needed(domain: DomainSettings, load_cases: int = 1) -> Need:
    """Least memory for states of that many load cases."""
    return Need(domain.cells, least_memory(domain.cells, domain.classes, load_cases), coarser(domain))


def needs(case: Any) -> Need:
    """Least memory for a case."""
    return needed(case.domain, len(case.load.cases) or 1)


def instability(summary: Mapping[str, Any], path: str) -> str:
    """Why the last design's state would not last; empty if it is stable, or the solver did not tell."""
    negative = summary.get("negative_eigenvalues")
    return f"{path}: {UNSTABLE.format(negative)}" if negative else ""


def start(task: Task) -> Result:
    """Optimise a case."""
    resume = None if task.resume is None else dict(task.resume)
    return run(
        task.case.optimize,
        compute=task.compute,
        observer=task.observer,
        resume=resume,
        initial=task.initial,
        bodies=task.bodies,
    )
