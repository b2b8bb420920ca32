"""What the model skips: terms without a weight, loads and penalties that are zero, factorisations that are at hand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from actuator.arrays import Floats
from actuator.equations.tangent_kernels import darcy_metric, darcy_tangent
from actuator.material.elasticity import energy_density
from actuator.optimiser.loop import Optimiser
from actuator.optimiser.model import Model, ModelPoint
from actuator.solve.equilibrium import Equilibrium, State
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective
from actuator.solve.sensitivity import Sensitivity
from actuator.terms.design_terms import DesignObjective
from benchmarks.skip_rows import Skip, count_skip, largest_difference, parts, time_skip
from benchmarks.small_cases import QUICK, direction, first_design, problem, reduced_objective
from stages.settings import ProblemSettings

#: So small a weight or coefficient that it changes no result, but neither zero nor so small that its products are slow.
ALMOST = 1e-200

WEIGHT, PENALTY, REST, WHERE, PART, AGAIN = (
    "terms with zero weight",
    "c_r = 0",
    "p_in = 0",
    "C_Ψ where it can act",
    "elements and DOFs",
    "refactorisation",
)


def model_skips() -> Iterator[Skip]:
    """All rows of the model, on the mesh of ``configs/quick.yaml``."""
    objective = reduced_objective(problem(QUICK))
    at = objective.evaluate(first_design(objective.domain))
    gradient = objective.gradient(at)
    yield from _weights(at, gradient)
    yield from _penalty(at, gradient)
    yield _spring(at)
    yield _rest()
    yield _energy(objective, at)
    yield from _parts(objective, at)
    yield from _factorisations(objective, at)
    yield _passive()


def _with(parameter: str, value: float) -> ReducedObjective:
    """The case with another value of one parameter."""
    changes: dict[str, Any] = {parameter: value}
    return reduced_objective(problem(QUICK), **changes)


def _product(objective: ReducedObjective, at: Evaluation, gradient: Gradient) -> list[Floats]:
    """The kernel's part of a Hessian product: the Lagrangian's derivatives by complex step."""
    chi = at.chi + 1e-20j * direction(objective.domain)
    return parts(*objective.derivatives(chi, at.state.x, at.state.p, *gradient.adjoint, at.state.nodal))


def _weights(at: Evaluation, gradient: Gradient) -> Iterator[Skip]:
    against = f"weight {ALMOST:g}"
    almost, zero = (_with("strain_energy_weight", weight) for weight in (ALMOST, 0.0))
    yield time_skip(
        WEIGHT,
        "c_Ψ: C_Ψ in the Lagrangian's derivatives",
        against,
        lambda: _product(almost, at, gradient),
        lambda: _product(zero, at, gradient),
    )
    for key, symbol in (("area_weight", "c_A"), ("slope_weight", "c_i"), ("passive_weight", "weight of C_χ")):
        some, none = (_with(key, weight).design for weight in (ALMOST, 0.0))
        yield time_skip(
            WEIGHT,
            f"{symbol}: terms of the design, with derivatives and without",
            against,
            partial(_design_terms, some, at.chi),
            partial(_design_terms, none, at.chi),
            repeats=31,
            remark="" if key == "area_weight" else "a comparison per point: no code for it",
        )
    leaking, tight = (_diagonal(_with("leak_weight", weight)) for weight in (ALMOST, 0.0))
    yield time_skip(
        WEIGHT,
        "c_p: estimate of the leak's curvature, 32 solves",
        against,
        lambda: leaking[0].diagonal(leaking[1]),
        lambda: tight[0].diagonal(tight[1]),
    )


def _design_terms(design: DesignObjective, chi: Floats) -> list[Floats]:
    return [design(chi).gradient, np.array(design.value(chi))]


def _diagonal(objective: ReducedObjective) -> tuple[Model, ModelPoint]:
    at = objective.evaluate(first_design(objective.domain))
    model = Model(objective, Sensitivity(objective.equilibrium), at, objective.gradient(at))
    start = model.start()
    model.gradient(start)
    return model, start


def _penalty(at: Evaluation, gradient: Gradient) -> Iterator[Skip]:
    against = f"c_r = {ALMOST:g} N"
    almost, none = (_with("hessian_penalty", c_r) for c_r in (ALMOST, 0.0))
    state = at.state
    yield time_skip(
        PENALTY,
        "second derivatives of u in the residual",
        against,
        lambda: almost.equilibrium.residual(state.chi, state.x, state.p)[:2],
        lambda: none.equilibrium.residual(state.chi, state.x, state.p)[:2],
        repeats=21,
    )
    yield time_skip(
        PENALTY,
        "second derivatives of Λ_u in the Lagrangian's derivatives",
        against,
        lambda: _product(almost, at, gradient),
        lambda: _product(none, at, gradient),
    )


def _spring(at: Evaluation) -> Skip:
    almost, none = (_with("spring_stiffness", stiffness).equilibrium for stiffness in (ALMOST, 0.0))
    fields = at.state.chi, at.state.x, at.state.p
    return time_skip(
        "no spring",
        "force of the spring, in the residual",
        f"k_sp = {ALMOST:g} N/mm",
        lambda: almost.residual(*fields)[:2],
        lambda: none.residual(*fields)[:2],
        remark="three numbers, nine in the tangent: no code for it",
        repeats=21,
    )


def _rest() -> Skip:
    """State, adjoint and what of the gradient depends on them."""
    objective = _with("pressure", 0.0)
    equilibrium, chi = objective.equilibrium, first_design(objective.domain)
    size = float(np.abs(objective.design(chi).gradient).max())

    def solved() -> list[Floats]:
        """What the equations have done for them with any other pressure."""
        equilibrium.refresh()
        x = np.zeros(equilibrium.kinematics.size)
        p = equilibrium.pressure(chi, x)
        _, _, nodal, lowest = equilibrium.residual(chi, x, p)
        state = State(chi, x, p, equilibrium.kinematics.displacement(x), nodal, 0.0, lowest)
        _, gx, gp = objective.derivatives(chi, x, p, 0.0 * x, 0.0 * p, nodal)
        adjoint = equilibrium.solve_adjoint(state, -gx, -gp, objective.adjoint_tolerance)
        return [x, p, objective.derivatives(chi, x, p, *adjoint, nodal)[0] / size]

    def skipped() -> list[Floats]:
        at = objective.evaluate(chi)
        return [at.state.x, at.state.p, (objective.gradient(at).total - at.design.gradient) / size]

    row = time_skip(REST, "state and adjoint", "solved for, as with any other pressure", solved, skipped)
    absolute = max(float(np.abs(a - b).max()) for a, b in zip(solved(), skipped(), strict=True))
    remark = "x (mm), p (N/mm²), and the gradient over that of the terms of χ; the latter are in the time that is left"
    return replace(row, difference=absolute, remark=remark)


def _energy(objective: ReducedObjective, at: Evaluation) -> Skip:
    """Quadrature points at which Ψ at full stiffness is above the limit: nowhere else can Ψ(χ + 4/L_i) be."""
    geometry, c = objective.equilibrium.geometry, objective.equilibrium.coefficients
    gradients = geometry.gradient20[geometry.cell_class]  # (n_cells, n_q, 20, 3)
    u = at.state.displacement[geometry.node_cells]
    F = np.eye(3) + np.einsum("eai,eqaj->eqij", u, gradients)
    log_J = np.log(np.linalg.det(F))
    density = energy_density(c, log_J, np.exp(-2.0 / 3.0 * log_J), np.sum(F**2, axis=(2, 3)), None)
    x = at.chi[geometry.cells] @ geometry.shape.T + c.energy_shift
    rho = 1.0 / (1.0 + np.exp(-x))
    factor = c.stiffness_contrast + (1.0 - c.stiffness_contrast) * rho / (1.0 + c.ramp_penalty * (1.0 - rho))
    left_out = density <= c.energy_limit
    lost = np.maximum(factor * density / c.energy_limit - 1.0, 0.0)[left_out]
    return count_skip(
        WHERE,
        "stiffness with its derivative at a quadrature point, in the Lagrangian's derivatives",
        "every point",
        "points",
        (density.size, density.size - left_out.sum()),
        difference=float(lost.max(initial=0.0)),
        remark="difference: the largest Ψ / Ψ_lim - 1 left out; in C_Ψ's value the same saved nothing: no code for it",
    )


def _parts(objective: ReducedObjective, at: Evaluation) -> Iterator[Skip]:
    equilibrium, state, domain = objective.equilibrium, at.state, objective.domain
    chi, x, p = state.chi, state.x, state.p
    tip = domain.tip.nodes
    yield time_skip(
        PART,
        "forces on Γ from the last layer of cells alone",
        "all cells",
        lambda: equilibrium.residual(chi, x, p)[2][tip],
        lambda: equilibrium.tip_forces(chi, x, p)[tip],
        repeats=21,
    )
    yield time_skip(
        PART,
        "flow equations without the stresses",
        "both residuals",
        lambda: equilibrium.residual(chi, x, p)[1],
        lambda: equilibrium.flow_residual(chi, x, p),
        repeats=21,
    )
    tangent, geometry = equilibrium.tangent, equilibrium.geometry

    def all_blocks() -> Floats:
        tangent.assemble(equilibrium.source, equilibrium.coefficients, chi, x, p, state.nodal)
        return tangent.pp.data.copy()

    def darcy_alone() -> Floats:
        metric = np.empty((len(geometry.cells), geometry.shape.shape[0], 6))
        elements = np.empty((len(geometry.cells), 8, 8))
        darcy_metric(geometry, state.displacement, metric)
        darcy_tangent(geometry, equilibrium.source, equilibrium.coefficients, chi, metric, elements)
        return tangent.darcy.data(elements.ravel())

    yield time_skip(PART, "Darcy block with u frozen", "all four blocks", all_blocks, darcy_alone)
    n_tip, n_nodes = len(tip), len(domain.nodes)
    kept = equilibrium.kinematics.size
    yield count_skip(
        PART,
        "displacements fixed, by symmetry or by the arm, and its multiplier q",
        "all unknowns of u, T and q",
        "unknowns",
        (3 * n_nodes + 3 + 3 * n_tip, kept),
        remark="eliminated exactly; tests/actuator/solve/test_multiplier.py compares with the system that has them",
    )
    upper = equilibrium.tangent.mechanics.nonzeros
    yield count_skip(
        PART, "lower triangle of the mechanical block", "the whole block", "entries", (2 * upper - kept, upper)
    )


class _Needless(Equilibrium):
    """Counts how often a Darcy matrix is asked for."""

    asked = 0

    def freeze(self, chi: Floats, x: Floats) -> None:
        self.asked += 1
        super().freeze(chi, x)


def _factorisations(objective: ReducedObjective, at: Evaluation) -> Iterator[Skip]:
    equilibrium, state = objective.equilibrium, at.state
    chi, d, start = at.chi, direction(objective.domain), (at.state.x, at.state.p)

    def states(*, fresh: bool) -> tuple[list[Floats], int]:
        equilibrium.refresh()
        before, found = equilibrium.work.factorisations, []
        for part in (0.02, 0.04, 0.06):
            if fresh:
                equilibrium.refresh()
            found.append(objective.evaluate(chi + part * d, start).state.arm)
        return found, equilibrium.work.factorisations - before

    (fresh, many), (kept, few) = states(fresh=True), states(fresh=False)
    difference = largest_difference(fresh, kept)
    row = time_skip(
        AGAIN,
        "factors of an older design as preconditioner, three states",
        "factorised anew for each",
        lambda: states(fresh=True)[0],
        lambda: states(fresh=False)[0],
        repeats=5,
        remark="both meet the state's tolerance of 1e-8",
    )
    yield row
    yield replace(
        row, unit="factorisations", needless=float(many), skipped=float(few), noise=None, difference=difference
    )

    linearised = [state]
    equilibrium.linearise(state)

    def linearise(*, same: bool) -> Floats:
        equilibrium.refresh()
        if not same:
            linearised[0] = replace(state)  # equal, but another object
        equilibrium.linearise(linearised[0])
        return equilibrium.tangent.xx.data.copy()

    yield time_skip(
        AGAIN,
        "assembly and Darcy block at a state that is linearised, before it is factorised",
        "an equal state",
        lambda: linearise(same=False),
        lambda: linearise(same=True),
        repeats=5,
    )
    other = chi + 0.02 * d

    def pressures(*, again: bool) -> list[Floats]:
        order = (chi, other, chi, other) if again else (chi, chi, other, other)
        found = [equilibrium.pressure(design, state.x) for design in order]
        return [found[0], found[1] if again else found[2]]

    yield time_skip(
        AGAIN,
        "Darcy matrix of the same χ and u, four pressures",
        "the two designs in turn",
        lambda: pressures(again=True),
        lambda: pressures(again=False),
    )
    counted = reduced_objective(problem(QUICK))
    counted.equilibrium.__class__ = _Needless
    needless = counted.equilibrium
    assert isinstance(needless, _Needless)
    optimiser = Optimiser(counted)
    progress = optimiser.begin(first_design(counted.domain))
    frozen = needless.frozen_darcy_solver.statistics
    needless.asked, made = 0, frozen.factorisations
    optimiser.run(progress, 2)
    yield count_skip(
        AGAIN,
        "Darcy matrices with u frozen in two design updates",
        "each one that is asked for",
        "factorisations",
        (needless.asked, frozen.factorisations - made),
        difference=0.0,
    )


def _passive() -> Skip:
    """How far the optimiser moves χ in the passive core, where C_χ holds it down."""
    settings: ProblemSettings = problem(QUICK)
    objective = reduced_objective(settings)
    optimiser = Optimiser(objective)
    progress = optimiser.begin(first_design(objective.domain))
    before = progress.evaluation.chi
    optimiser.run(progress, 2)
    r = np.hypot(objective.domain.points[:, 1], objective.domain.points[:, 2])
    core = r < 0.3 * settings.domain.size
    moved = float(np.abs(progress.evaluation.chi - before)[core].max())
    return count_skip(
        "passive regions",
        "χ at the vertices of the passive core",
        "χ everywhere",
        "unknowns",
        (len(core), len(core)),
        difference=moved,
        remark="not skipped: C_χ is a penalty and χ is free in the core; difference: how far two updates move it there",
    )
