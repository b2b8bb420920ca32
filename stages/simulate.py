"""Stage ``simulate``: the response from zero to more than the pressure of the optimisation, and back.

The path of states of the optimised density field is followed by arc length (:mod:`actuator.solve.path`), so that limit
points are passed and reported.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np
from pydantic import BeforeValidator, Field, PositiveFloat

from actuator.failure import InvalidSettings
from stages.chambers import posed
from stages.curves import Result, lines, pack, shortfall
from stages.datasets import Source, design
from stages.design import Design, OtherState
from stages.events import Compiled, LoadStep, Message, Observer, silent
from stages.optimize import needed
from stages.response import COLUMNS, Response, Snapshot, summarised
from stages.settings import ProblemSettings, Section
from stages.similarity import Units, similar
from stages.task import Compute, Need, Task

if TYPE_CHECKING:
    from actuator.solve.equilibrium import Equilibrium
    from actuator.solve.path import Control, Point
    from actuator.solve.pressurisation import Pressurisation
    from actuator.solve.state import State

__all__ = ["COLUMNS", "Result", "Settings", "lines", "needs", "pack", "run", "shortfall", "start"]

VERSION = 3

#: The pressure the design was optimised for, as a load factor.
TARGET = 1.0


def _as_tuple(value: Any) -> Any:
    """A list of a case file as what stays as it is; strict reading would refuse it."""
    return tuple(value) if isinstance(value, list) else value


class Settings(Section):
    """How far and how finely the pressure is raised."""

    gone: ClassVar[Mapping[str, str]] = dict.fromkeys(
        ("fields", "sharpness", "mesh"), "remove it; `poro inflate` computes the part as it is printed"
    )

    load_case: str | None = Field(
        None,
        exclude_if=lambda name: name is None,  # simulations of a single load keep their keys
        description="load case that is followed, by its name; the first one if left out",
    )
    max_load: float = Field(1.5, gt=0, le=100, description="largest pressure over p_in [-]")
    first_step: float = Field(0.1, gt=0, le=1, description="first step of the load factor [-]")
    least_step: float = Field(1.0e-4, gt=0, description="arc length below which a path is given up [-]")
    largest_step: float = Field(0.3, gt=0, description="largest arc length of a step [-]")
    max_points: int = Field(200, ge=2, description="most points of a path, up or down [-]")
    max_newton: int = Field(10, ge=2, description="most Newton iterations per point [-]")
    state_tolerance: float = Field(1.0e-8, gt=0, lt=1, description="relative residual of a state [-]")
    states: Annotated[tuple[PositiveFloat, ...], BeforeValidator(_as_tuple)] = Field(
        (0.5, 1.0, 1.5), description="load factors whose states are stored, up to max_load [-]"
    )


def run(
    design: Design,
    problem: ProblemSettings,
    settings: Settings,
    *,
    compute: Compute | None = None,
    observer: Observer = silent,
) -> Result:
    """Follow the response of a design.

    Args:
        design: the optimised design, in its state under the load case that is followed.
        problem: domain, material, load and objective of its case.
        settings: of the simulation.
        compute: threads and linear solver.
        observer: receives a :class:`~stages.events.LoadStep` per point.

    Returns:
        What has been found, also after an interruption (KeyboardInterrupt) or where a path could not be followed.

    Raises:
        actuator.failure.InvalidSettings: if the case has no pressure, or no load case of the name.
        actuator.failure.SolveFailure: if not even the state at rest can be linearised.
    """
    from actuator.compilation import compile_kernels
    from actuator.threads import use_threads

    problem = _followed(problem, settings.load_case)
    if problem.parameters()[1].pressure == 0.0:
        raise InvalidSettings("The case has no pressure to raise: set load.pressure_ratio above zero.")
    compute = compute or Compute()
    core, units = similar(problem)
    compile_kernels(core.parameters()[0].law, lambda done, total: observer(Compiled(done, total)))
    use_threads(compute.threads)
    observer(Message(f"{design.domain.mesh.nelements} cells"))
    response, finished = Response(design.domain, design.chi, units), True
    try:
        _follow(response, _equilibrium(core, settings, compute), design, settings, observer)
    except KeyboardInterrupt:
        if not response.records:
            raise
        finished = False
        observer(Message("Interrupted; what has been found is kept."))
    pressure = problem.parameters()[1].pressure
    return Result(response, summarised(response, pressure) | {"finished": finished}, finished)


def _followed(problem: ProblemSettings, load_case: str | None) -> ProblemSettings:
    """The problem under the load case that is followed alone."""
    if load_case is None:
        return problem.leading
    cases = {case.name: case for case in problem.load.cases}
    if load_case not in cases:
        there = f"there are {', '.join(cases)}" if cases else "the case has a single load"
        raise InvalidSettings(
            f"simulate.load_case: there is no load case '{load_case}'; {there}: write one of these, or leave it out."
        )
    return problem.under(cases[load_case])


def _equilibrium(problem: ProblemSettings, settings: Settings, compute: Compute) -> Equilibrium:
    from actuator.solve.equilibrium import Equilibrium

    return Equilibrium(
        posed(problem),
        *problem.parameters(),
        tolerance=settings.state_tolerance,
        solver=compute.linear_solver,
        threads=compute.threads,
        scheme=problem.elements.scheme(),
    )


def _follow(
    response: Response, equilibrium: Equilibrium, design: Design, settings: Settings, observer: Observer
) -> None:
    """Follow the field up and down and compare; the response fills as points are found."""
    from actuator.failure import SolveFailure
    from actuator.solve.path import Control
    from actuator.solve.pressurisation import Pressurisation

    problem, units = Pressurisation(equilibrium, response.chi), response.units
    control = Control(
        first=settings.first_step,
        least=settings.least_step,
        largest=settings.largest_step,
        tolerance=settings.state_tolerance,
        most_newton=settings.max_newton,
        most_points=settings.max_points,
    )
    stops = {load for load in (*settings.states, TARGET) if 0.0 < load <= settings.max_load}
    stored = {load for load in settings.states if 0.0 < load <= settings.max_load}
    try:
        for point, loading in _up_and_down(problem, settings.max_load, control, sorted(stops)):
            state = problem.state(point.z, point.load)
            record = response.add(equilibrium, point, state, loading)
            if loading and point.load in stops and point.load not in response.states:
                response.states[point.load] = Snapshot(
                    units.length * state.displacement, units.stress * state.p, point.load in stored
                )
                if point.load == TARGET:
                    response.difference = _difference(state, design, units)
            observer(LoadStep("density", record, settings.max_load))
    except SolveFailure as failure:
        if not response.records:
            raise
        response.ended = str(failure)
        observer(Message(response.ended))


def _up_and_down(
    problem: Pressurisation, max_load: float, control: Control, stops: list[float]
) -> Iterator[tuple[Point, bool]]:
    """Points of the way up, the first at rest, and of the way down, whose first is the last of the way up."""
    from actuator.solve.path import begin, follow

    last = begin(problem, problem.rest, 0.0, control)
    yield last, True
    for point in follow(problem, last, max_load, control, stops=stops, lowest=-max_load):
        yield point, True
        last = point
    back = last.reversed()
    yield back, False
    for point in follow(problem, back, 0.0, control, stops=stops, lowest=-max_load):
        yield point, False


def _difference(reached: State, design: Design, units: Units) -> dict[str, float]:
    """Relative differences of a state at p_in from the optimised one."""
    displacement, arm = design.displacement / units.length, design.arm / (units.length, units.length, 1.0)
    return {
        "T3": _relative(reached.arm[1] - arm[1], arm[1]),
        "theta2": _relative(reached.arm[2] - arm[2], arm[2]),
        "displacement": _relative(
            float(np.linalg.norm(reached.displacement - displacement)), float(np.linalg.norm(displacement))
        ),
    }


def _relative(difference: float, whole: float) -> float:
    return abs(float(difference)) / abs(float(whole)) if whole else math.inf


def needs(case: Any) -> Need:
    """Least memory for a case: one load case is followed."""
    return needed(case.domain)


def start(task: Task) -> Result:
    """Simulate the optimised design of a case."""
    case = task.case
    reached = optimised(task.upstream, case.simulate.load_case, [each.name for each in case.load.cases[1:]])
    return run(reached, case.optimize, case.simulate, compute=task.compute, observer=task.observer)


def optimised(source: Source, load_case: str | None = None, others: Sequence[str] = ()) -> Design:
    """What the simulation starts from and compares with, from the artifact of the optimisation.

    Args:
        source: the artifact.
        load_case: that is followed.
        others: load cases after the first.
    """
    if load_case in others:
        return Design(*design(source), *OtherState.read(source, str(load_case)))
    return Design(*design(source), *source.read("nodes/displacement", "vertices/pressure", "arm"))
