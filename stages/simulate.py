"""Stage ``simulate``: the response from zero to more than the pressure of the optimisation, and back.

The path of states is followed by arc length (:mod:`actuator.solve.path`), so that limit points are passed and
reported. Two density fields are followed: the optimised one, and the solid that is exported, as far as a mesh can
show it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PositiveFloat

from actuator.arrays import Floats
from actuator.failure import InvalidSettings
from stages import optimize, refine
from stages.curves import Result, lines, pack, shortfall
from stages.datasets import Source, design
from stages.design import Design
from stages.events import LoadStep, Message, Observer, silent
from stages.response import COLUMNS, Response, Snapshot, summarised
from stages.settings import ProblemSettings, Section
from stages.similarity import similar
from stages.task import Compute, Need, Task
from stages.words import FieldName

if TYPE_CHECKING:
    from actuator.domains.interface import Domain
    from actuator.solve.equilibrium import Equilibrium
    from actuator.solve.path import Control, Point
    from actuator.solve.pressurisation import Pressurisation

__all__ = ["COLUMNS", "Result", "Settings", "lines", "needs", "pack", "run", "shortfall", "start"]

VERSION = 2

MeshName = Literal["optimised", "refined"]

#: The pressure the design was optimised for, as a load factor.
TARGET = 1.0


def _as_tuple(value: Any) -> Any:
    """A list of a case file as what stays as it is; strict reading would refuse it."""
    return tuple(value) if isinstance(value, list) else value


class Settings(Section):
    """How far and how finely the pressure is raised, and of which density fields."""

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
    fields: Annotated[tuple[FieldName, ...], BeforeValidator(_as_tuple)] = Field(
        ("density", "thresholded"), min_length=1, description="which of density, thresholded to follow"
    )
    sharpness: float = Field(2.0, gt=0, le=100, description="factor on the filtered χ of the thresholded field [-]")
    mesh: MeshName = Field("optimised", description="mesh of the thresholded field: optimised or refined")


def run(
    design: Design,
    problem: ProblemSettings,
    settings: Settings,
    *,
    refinement: refine.Settings | None = None,
    threshold: float = 0.0,
    compute: Compute | None = None,
    observer: Observer = silent,
) -> Result:
    """Follow the response of a design.

    Args:
        design: the optimised design.
        problem: domain, material, load and objective of its case.
        settings: of the simulation.
        refinement: finer mesh and filter from which the thresholded field is made.
        threshold: χ above which the exported part is solid.
        compute: threads and linear solver.
        observer: receives a message per field and a :class:`~stages.events.LoadStep` per point.

    Returns:
        What has been found, also after an interruption (KeyboardInterrupt) or where a path could not be followed.

    Raises:
        actuator.failure.InvalidSettings: if the case has no pressure.
        actuator.failure.SolveFailure: if not even the state at rest can be linearised.
    """
    from actuator.compilation import compile_kernels
    from actuator.threads import use_threads

    if problem.load.pressure_ratio == 0.0:
        raise InvalidSettings("The case has no pressure to raise: set load.pressure_ratio above zero.")
    compute = compute or Compute()
    refinement = refinement or refine.Settings()
    core, units = similar(problem)
    compile_kernels(core.parameters()[0].law)
    use_threads(compute.threads)
    responses: dict[str, Response] = {}
    finished = False
    try:
        equilibrium: Equilibrium | None = None
        for name in dict.fromkeys(settings.fields):
            domain, chi = design.domain, design.chi
            if name == "thresholded":
                domain, chi = thresholded(design, refinement, threshold, settings, observer)
            finer = domain != design.domain
            if equilibrium is None or finer:
                equilibrium = None  # of two meshes at once the memory need not hold the factors
                mesh = core.domain.build()
                mesh = mesh.refined(refinement.factor) if finer else mesh
                equilibrium = _equilibrium(mesh, core, settings, compute)
            observer(Message(f"{name}: {domain.mesh.nelements} cells"))
            responses[name] = Response(name, domain, chi, units)
            _follow(responses[name], equilibrium, design, settings, observer)
        finished = True
    except KeyboardInterrupt:
        responses = {name: response for name, response in responses.items() if response.records}
        if not responses:
            raise
        observer(Message("Interrupted; what has been found is kept."))
    pressure = problem.parameters()[1].pressure
    return Result(responses, summarised(responses, pressure) | {"finished": finished}, finished)


def thresholded(
    design: Design, refinement: refine.Settings, threshold: float, settings: Settings, observer: Observer = silent
) -> tuple[Domain, Floats]:
    """The refined and filtered design with a steep interface where the exported surface is, and its mesh.

    χ' = sharpness (χ̄ - threshold): scaled, not clipped, so that the zero set of the interpolated field stays.
    """
    refined = refine.run(design.domain, design.chi, refinement, observer)
    chi = settings.sharpness * (refined.chi - threshold)
    if settings.mesh == "refined":
        return refined.domain, chi
    return design.domain, chi[design.domain.coinciding(refinement.factor)]


def _equilibrium(domain: Domain, problem: ProblemSettings, settings: Settings, compute: Compute) -> Equilibrium:
    from actuator.solve.equilibrium import Equilibrium

    return Equilibrium(
        domain,
        *problem.parameters(),
        tolerance=settings.state_tolerance,
        solver=compute.linear_solver,
        threads=compute.threads,
    )


def _follow(
    response: Response, equilibrium: Equilibrium, design: Design, settings: Settings, observer: Observer
) -> None:
    """Follow one field up and down and compare; the response fills as points are found."""
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
                    response.difference = _difference(problem, point, design, control, response)
            observer(LoadStep(response.name, record, settings.max_load))
    except SolveFailure as failure:
        if not response.records:
            raise
        response.ended = str(failure)
        observer(Message(f"{response.name}: {failure}"))


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


def _difference(
    problem: Pressurisation, point: Point, design: Design, control: Control, response: Response
) -> dict[str, float] | None:
    """Relative differences at p_in from the state found directly, by Newton's method from the optimised state.

    For the optimised field that is the optimised state itself. None if there is no state near it.
    """
    from actuator.failure import SolveFailure
    from actuator.solve.path import begin

    units, reached = response.units, problem.state(point.z, point.load)
    displacement, arm = design.displacement / units.length, design.arm / (units.length, units.length, 1.0)
    if response.name != "density":
        if response.domain != design.domain:
            return None  # the optimised state lives on another mesh
        try:
            start = problem.packed(displacement, arm, design.pressure / units.stress)
            direct = begin(problem, start, TARGET, control)
        except SolveFailure:
            return None
        state = problem.state(direct.z, TARGET)
        displacement, arm = state.displacement, state.arm
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
    """Least memory for the largest mesh on which a field is followed."""
    cells, remedy = case.domain.cells, optimize.coarser(case.domain)
    if case.simulate.mesh == "refined" and "thresholded" in case.simulate.fields:
        cells, remedy = cells * case.refine.factor**3, "set simulate.mesh to optimised"
    return Need(cells, optimize.least_memory(cells), remedy)


def start(task: Task) -> Result:
    """Simulate the optimised design of a case."""
    case = task.case
    return run(
        optimised(task.upstream),
        case.optimize,
        case.simulate,
        refinement=case.refine,
        threshold=case.mirror.threshold,
        compute=task.compute,
        observer=task.observer,
    )


def optimised(source: Source) -> Design:
    """What the simulation starts from and compares with, from the artifact of the optimisation."""
    return Design(*design(source), *source.read("nodes/displacement", "vertices/pressure", "arm"))
