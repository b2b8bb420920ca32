"""What the regression guard counts and measures of the model: states, adjoints, design updates, load paths."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict

from actuator.arrays import Floats
from actuator.linear import SolverName
from actuator.optimiser.loop import Optimiser
from actuator.optimiser.model import Model
from actuator.solve.linearisation import Work
from actuator.solve.path import Control, begin, follow
from actuator.solve.pressurisation import Pressurisation
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from benchmarks.figures import Figure, count, error
from benchmarks.small_cases import Mesh, direction, first_design, problem, reduced_objective

#: Change of the design by which the start of a state is off.
CHANGE = 0.1
#: Step of central differences.
STEP = 1e-3
STATE_TOLERANCE, PRECISE = 1e-8, 1e-11

#: What is counted, by the name of the count, with its unit.
COUNTS = {
    "newton": "Newton steps",
    "krylov": "Krylov iterations",
    "factorisations": "factorisations",
    "darcy_factorisations": "Darcy factorisations",
}


def state_figures(mesh: Mesh, solver: SolverName, reference: Mapping[str, float]) -> Iterator[Figure]:
    """The initial design from rest, another from a warm start, their adjoints, and the error of the mesh.

    Args:
        reference: T3 (mm), θ2 and C0 of the same design field on a finer mesh, from :func:`reference_of`.
    """
    settings, name = problem(mesh), mesh_name(mesh)
    objective = reduced_objective(settings, solver=solver, state_tolerance=STATE_TOLERANCE)
    chi, d, work = first_design(objective.domain), direction(objective.domain), objective.equilibrium.work

    with _counted(work) as counts:
        at = objective.evaluate(chi)
    yield from _counts(f"state from rest, {name}", counts, "newton", "krylov", "factorisations", "darcy_factorisations")
    yield error(f"state from rest, {name}: residual", at.state.residual, rounding=STATE_TOLERANCE)
    with _counted(work) as counts:
        gradient = objective.gradient(at)
    yield from _counts(f"adjoint, {name}", counts, "krylov", "factorisations")

    with _counted(work) as counts:
        warm = objective.evaluate(chi + CHANGE * d, (at.state.x, at.state.p))
    yield from _counts(f"state from a warm start, {name}", counts, "newton", "krylov", "factorisations")
    with _counted(work) as counts:
        objective.gradient(warm, gradient.adjoint)
    yield from _counts(f"adjoint from a warm start, {name}", counts, "krylov", "factorisations")

    for quantity, value in quantities(at).items():
        exact = reference[quantity]
        yield error(f"{quantity} against a finer mesh, {name}", abs(value - exact) / abs(exact))


def derivative_figures(mesh: Mesh, solver: SolverName) -> Iterator[Figure]:
    """Gradients of objective and model against differences, of so precise states that truncation is what is left."""
    objective = reduced_objective(problem(mesh), solver=solver, state_tolerance=PRECISE, adjoint_tolerance=PRECISE)
    at = objective.evaluate(first_design(objective.domain))
    gradient, d, name = objective.gradient(at), direction(objective.domain), mesh_name(mesh)
    yield error(f"gradient against differences, {name}", _gradient_error(objective, at, gradient, d))
    yield error(f"gradient of the model against differences, {name}", _model_error(objective, at, gradient, d))


def update_figures(mesh: Mesh, updates: int, solver: SolverName) -> Iterator[Figure]:
    """The first design updates."""
    objective = reduced_objective(problem(mesh), solver=solver)
    optimiser = Optimiser(objective)
    with _counted(objective.equilibrium.work) as counts:
        progress = optimiser.begin(first_design(objective.domain))
        optimiser.run(progress, updates)
    label = f"{updates} design updates, {mesh_name(mesh)}"
    yield from _counts(label, counts, *COUNTS)
    yield count(f"{label}: inner steps", progress.inner, "steps of inner problems")
    yield count(f"{label}: evaluations", progress.evaluations, "evaluations")


def path_figures(mesh: Mesh, solver: SolverName) -> Iterator[Figure]:
    """The initial design from zero pressure to p_in by arc length."""
    objective = reduced_objective(problem(mesh), solver=solver)
    equilibrium = objective.equilibrium
    path, control = Pressurisation(equilibrium, first_design(objective.domain)), Control()
    with _counted(equilibrium.work) as counts:
        start = begin(path, path.rest, 0.0, control)
        points = [start, *follow(path, start, 1.0, control)]
    label = f"path to full pressure, {mesh_name(mesh)}"
    yield count(f"{label}: points", len(points), "points")
    yield count(f"{label}: corrections", sum(point.newton for point in points), "Newton steps")
    yield from _counts(label, counts, "krylov", "factorisations")


def reference_of(mesh: Mesh, factor: int) -> dict[str, float]:
    """T3 (mm), θ2 and C0 of a mesh's initial design on a mesh with ``factor`` times the cells in each direction."""
    settings = problem(mesh)
    domain = settings.domain.build()
    chi = domain.prolongation(factor) @ first_design(domain)
    return quantities(reduced_objective(settings, domain.refined(factor)).evaluate(chi))


def quantities(at: Evaluation) -> dict[str, float]:
    """What is compared with a finer mesh: T3 (mm), θ2 (rad) and C0."""
    return {"T3": float(at.state.arm[1]), "theta2": float(at.state.arm[2]), "C0": at.terms["C0"]}


def mesh_name(mesh: Mesh) -> str:
    """A mesh by its number of cells."""
    return f"{problem(mesh).domain.cells} cells"


@contextmanager
def _counted(work: Work) -> Iterator[dict[str, int]]:
    """What the block adds to the counts of work."""
    before, counts = asdict(work), dict[str, int]()
    yield counts
    counts.update({name: value - before[name] for name, value in asdict(work).items()})


def _counts(label: str, counts: Mapping[str, int], *names: str) -> Iterator[Figure]:
    for name in names:
        yield count(f"{label}: {COUNTS[name]}", counts[name], COUNTS[name])


def _gradient_error(objective: ReducedObjective, at: Evaluation, gradient: Gradient, d: Floats) -> float:
    """Relative error of what depends on the state: the terms of χ alone have kinks."""

    def physics(h: float) -> float:
        there = objective.evaluate(at.chi + h * d, (at.state.x, at.state.p))
        return there.value - there.design.value

    slope = float((gradient.total - at.design.gradient) @ d)
    return abs((physics(STEP) - physics(-STEP)) / (2.0 * STEP) - slope) / abs(slope)


def _model_error(objective: ReducedObjective, at: Evaluation, gradient: Gradient, d: Floats) -> float:
    """Relative error of the slope of the model along a direction, against differences of its value."""
    model = Model(objective, at, gradient)
    start, dx = model.start(), model.sensitivity @ d

    def value(h: float) -> float:
        point = model(h * d, h * dx)
        assert point is not None, "so small a step inverts no element"
        return point.value

    slope = (value(STEP) - value(-STEP)) / (2.0 * STEP)
    return abs(float(model.gradient(start) @ d) - slope) / abs(slope)
