"""The paper's problem on small meshes, with the designs that benchmarks share."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from actuator.arrays import Floats
from actuator.domains.interface import Domain
from actuator.linear import SolverName
from actuator.parameters import Load, Material, Objective
from actuator.solve.reduced import ReducedObjective
from stages.domains import HalfCylinderSettings
from stages.settings import ObjectiveSettings, ProblemSettings

#: m, k, layers.
Mesh = tuple[int, int, int]

#: 48 cells, 168 cells, the 1,080 cells of configs/quick.yaml, and the 9,504 of the paper.
TINY: Mesh = (2, 1, 3)
SMALL: Mesh = (3, 2, 4)
QUICK: Mesh = (6, 2, 9)
PAPER: Mesh = (12, 5, 18)


def problem(mesh: Mesh) -> ProblemSettings:
    """Table 1 of the paper on a mesh."""
    core, rings, layers = mesh
    return ProblemSettings(
        domain=HalfCylinderSettings(core_cells=core, rings=rings, layers=layers),
        objective=ObjectiveSettings(strain_energy_shift="4/L_i"),
    )


def reduced_objective(
    settings: ProblemSettings,
    domain: Domain | None = None,
    *,
    solver: SolverName = "auto",
    state_tolerance: float = 1e-8,
    adjoint_tolerance: float = 1e-10,
    **changes: float,
) -> ReducedObjective:
    """The reduced objective of a problem, on one thread.

    Args:
        domain: another mesh than that of the settings.
        changes: of the model's parameters, by the names of :mod:`actuator.parameters`; any value, where a case file has
            limits.
    """
    material, load, limits = settings.parameters()
    return ReducedObjective(
        domain or settings.domain.build(),
        replace(material, **_fitting(material, changes)),
        replace(load, **_fitting(load, changes)),
        replace(limits, **_fitting(limits, changes)),
        state_tolerance=state_tolerance,
        adjoint_tolerance=adjoint_tolerance,
        solver=solver,
        threads=1,
    )


def _fitting(parameters: Material | Load | Objective, changes: dict[str, float]) -> dict[str, Any]:
    names = {field.name for field in fields(parameters)}
    return {name: value for name, value in changes.items() if name in names}


def first_design(domain: Domain) -> Floats:
    """The initial design of Appendix C, (n_vertices,)."""
    return domain.initial_design(domain.points, ObjectiveSettings().interface_width)


def direction(domain: Domain) -> Floats:
    """A smooth change of the design of size one, (n_vertices,)."""
    return np.cos(domain.points @ [0.25, -0.4, 0.3])
