"""Stage ``inflate``: the response of the exported part itself to air pressure, on a mesh that fits it.

The path of states is followed by arc length (:mod:`actuator.solve.path`) from zero to more than p_in. Lengths, forces
and stresses count in the units of the case: the part is scaled back to the size of the domain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import Field

from actuator.arrays import Floats, Ints
from actuator.failure import InvalidSettings, Leaking, NotInflatable, NotManifold, SolveFailure
from actuator.geometry.printing.directions import Axis
from stages import check
from stages.events import LoadStep, Message, Observer, silent
from stages.inflation import TARGET, Course, Result, lines, pack, shortfall, verdict
from stages.settings import ProblemSettings, Section
from stages.task import Compute, Task

if TYPE_CHECKING:
    from actuator.body.inflation import Inflation
    from actuator.body.mesh import BodyMesh
    from actuator.body.plates import Glued
    from actuator.parameters import Load, Material

__all__ = ["VERSION", "Result", "Settings", "lines", "pack", "run", "shortfall", "start", "verdict"]

VERSION = 1

#: Stiffness of a spring that holds the arm's end, over E R: the deflection left is a millionth of the length or less.
HELD = 1e3
#: Largest arc length of a step, about the whole of p_in, and how far the path may turn on it: the parts respond almost
#: linearly, and a step that is too long is cut.
LARGEST_STEP, LEAST_COSINE = 1.0, 0.9


class Settings(Section):
    """The part as printed under pressure: its mesh, and how far it is inflated."""

    size: float = Field(1.5, gt=0, description="largest edge of the tetrahedra, in lengths of the domain [mm]")
    max_load: float = Field(1.5, gt=0, description="largest pressure over p_in [-]")
    points: int = Field(6, ge=1, le=100, description="states between zero and the largest pressure that are stored [-]")
    pressure: float | None = Field(
        None, ge=0, description="p_in on the print of rig.youngs_modulus, instead of the case's [kPa]"
    )
    part_scale: float | None = Field(
        None, gt=0, description="size of the part over size of the domain; by their lengths if left out [-]"
    )
    axis: Axis = Field("x", description="axis of the part, between the faces that plates are glued on [-]")
    blocked: bool = Field(False, description="also compute the force at the arm's end if that is held")


def run(
    vertices: Floats,
    triangles: Ints,
    problem: ProblemSettings,
    settings: Settings,
    compute: Compute | None = None,
    observer: Observer = silent,
    youngs_modulus: float | None = None,
    optimised: Mapping[str, Any] | None = None,
) -> Result:
    """Inflate a part between two plates.

    Args:
        vertices: of the part, (n, 3), mm.
        triangles: (m, 3), counter-clockwise seen from outside.
        problem: material, pressure, arm and spring; the domain's lengths say how large the part is in the case.
        settings: mesh and largest pressure.
        compute: threads and linear solver.
        observer: is told what happens.
        youngs_modulus: Ē of the print, N/mm², which a pressure in kPa refers to.
        optimised: summary of the optimisation that the part came from, to compare with.

    Raises:
        actuator.failure.NotInflatable: if the part is not one closed body with a closed chamber between flat ends, or
            the mesh too coarse for it.
        actuator.failure.InvalidSettings: if a pressure is given without the print's modulus.
        actuator.failure.SolveFailure: if there is no state near zero pressure.
    """
    # scikit-fem, SciPy, Mmg: only where it runs
    from actuator.body.meshing import mesh_of
    from actuator.threads import use_threads

    compute = compute or Compute()
    use_threads(compute.threads)
    solid = _glued(vertices, triangles, settings.axis, observer)
    scale = settings.part_scale or solid.length / problem.domain.length
    solid = _in_case_units(solid, scale)
    refuse_unlike(problem)
    problem = _with_pressure(problem.leading, settings, youngs_modulus)
    material, load, _ = problem.parameters()
    mesh = mesh_of(solid, settings.size)
    kind = "half of it, as it is symmetric" if mesh.half else "all of it"
    observer(Message(f"{len(mesh.cells)} quadratic tetrahedra, {len(mesh.nodes)} nodes, for {kind}"))
    course = Course(mesh, problem, scale)
    _follow(inflation_of(mesh, material, load, problem, compute), course, settings, observer)
    if settings.blocked and not course.ended:
        held = replace(load, spring_stiffness=HELD * problem.material.youngs_modulus * problem.domain.size)
        force = Course(mesh, problem, scale)
        _follow(inflation_of(mesh, material, held, problem, compute), force, settings, silent)
        course.blocked = force.column("spring_force")[force.column("load_factor") == 1.0].tolist()
    # At another pressure the optimiser's values say nothing.
    return course.result(optimised if settings.pressure is None else None)


def _glued(vertices: Floats, triangles: Ints, axis: Axis, observer: Observer) -> Glued:
    """The solid between plates; one that leaks is refused with the place where the air gets out."""
    from actuator.body.plates import glued

    try:
        sound = check.sound(vertices, triangles)
    except NotManifold as failure:
        raise NotInflatable(str(failure)) from None
    if sound.within:
        observer(Message(f"vertices within {sound.within:.1g} mm merged"))
    surface = sound.surface
    try:
        return glued(surface.vertices, surface.triangles, axis)
    except Leaking:
        air = check.air_chamber(surface, check.Settings(axis=axis))
        if air.verdict == "pass":
            raise
        found = air.text[0].lower() + air.text[1:].removesuffix(".")
        remedy = "mend it where it was made, a design of poro's own by a lower mirror.threshold"
        raise NotInflatable(f"The solid does not hold air: {found}; {remedy}.") from None


def _in_case_units(solid: Glued, scale: float) -> Glued:
    from actuator.geometry.zero_set import Surface

    surface = Surface(solid.surface.vertices / scale, solid.surface.triangles)
    return replace(solid, surface=surface, length=solid.length / scale)


def refuse_unlike(problem: ProblemSettings) -> None:
    """Refuse a part that is loaded by more than one pressure and a spring.

    Raises:
        actuator.failure.InvalidSettings: if the case has several chambers, or a force at the arm's end.
    """
    if problem.load.chambers:
        raise InvalidSettings(
            "The part of a case with load.chambers is not inflated: all its cavities would get one pressure; "
            "`poro simulate` follows the chambers of the first load case, `poro export` makes the part."
        )
    if problem.leading.load.force_ratio:
        raise InvalidSettings(
            "The part of a case with load.force_ratio is not inflated: its arm would have no force at its end; "
            "`poro simulate` follows the design with it, `poro export` makes the part."
        )


def _with_pressure(problem: ProblemSettings, settings: Settings, youngs_modulus: float | None) -> ProblemSettings:
    if settings.pressure is not None:
        if youngs_modulus is None:
            raise InvalidSettings(
                "A pressure in kPa needs the Young's modulus of the print: set rig.youngs_modulus (--youngs)."
            )
        ratio = 1e-3 * settings.pressure / youngs_modulus
        problem = problem.model_copy(update={"load": problem.load.model_copy(update={"pressure_ratio": ratio})})
    if problem.load.pressure_ratio == 0.0:
        raise InvalidSettings("The case has no pressure to raise: set load.pressure_ratio above zero.")
    return problem


def inflation_of(
    mesh: BodyMesh, material: Material, load: Load, problem: ProblemSettings, compute: Compute
) -> Inflation:
    """The problem that a mesh poses with a case's material, load and spring."""
    from actuator.body.inflation import Inflation

    # The spring of the model is that of half an actuator, or of a whole one.
    halves = (1.0 if mesh.half else 2.0) / problem.domain.halves
    return Inflation(
        mesh,
        material,
        pressure=load.pressure,
        reach=load.arm_length,
        stiffness=halves * load.spring_stiffness,
        threads=compute.threads,
        solver=compute.linear_solver,
    )


def _follow(inflation: Inflation, course: Course, settings: Settings, observer: Observer) -> None:
    """Follow the path up; the course fills as points are found."""
    from actuator.solve.path import Control, begin, follow

    loads = np.linspace(0.0, settings.max_load, settings.points + 1)
    # At half of p_in too, so that full over half pressure is computed, not interpolated.
    stops = sorted({*loads[1:].tolist(), *(load for load in (0.5 * TARGET, TARGET) if load <= settings.max_load)})
    control = Control(first=stops[0], largest=LARGEST_STEP, least_cosine=LEAST_COSINE)
    here = begin(inflation, inflation.rest, 0.0, control)
    course.add(inflation, here)
    try:
        for point in follow(inflation, here, settings.max_load, control, stops=stops, lowest=0.0):
            record = course.add(inflation, point, stored=point.load in stops)
            observer(LoadStep("as printed", record, settings.max_load))
    except SolveFailure as failure:
        course.ended = str(failure)
        observer(Message(course.ended))
    except KeyboardInterrupt:
        course.finished = False
        observer(Message("Interrupted; what has been found is kept."))


def start(task: Task) -> Result:
    """Inflate the part that a case was exported as."""
    case = task.case
    return run(
        *task.part,
        case.optimize,
        case.inflate,
        task.compute,
        task.observer,
        case.rig.youngs_modulus,
        task.optimised,
    )
