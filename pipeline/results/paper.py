"""What Mehta & Poulios (arXiv:2605.20101) report of their two designs, and how to tell that a case is one of theirs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from stages.domains import DomainSettings, HalfCylinderSettings
from stages.settings import ProblemSettings

CITATION = "Mehta & Poulios, arXiv:2605.20101"

#: Cells of the paper's mesh, 18 x 528.
CELLS = 9504


@dataclass(frozen=True)
class Reference:
    """A converged design of the paper: Table 2, and T3 from Section 3.

    Attributes:
        strain_limit: sqrt(2 Ψ_lim / E).
        C0: main objective.
        T3: displacement of the arm's root, mm.
        theta2: rotation of the arm, rad; printed in degrees in Table 2.
        elongation: of the spring, mm.
    """

    strain_limit: float
    C0: float
    T3: float
    theta2: float
    elongation: float


REFERENCES = (
    Reference(0.14, -0.255447, -2.305, math.radians(12.535), 15.327),
    Reference(0.11, -0.206272, -1.625, math.radians(10.322), 12.376),
)

#: Table 1 but for the mesh and the strain limit, spelt out: defaults of the program may change, the paper does not.
#: What it leaves open is not compared, but told: see :func:`reading`.
TABLE_1: dict[str, dict[str, float]] = {
    "domain": {"radius": 15.0, "length": 15.0},
    "material": {
        "youngs_modulus": 2.736,
        "poisson_ratio": 0.48,
        "ramp_penalty": 3.0,
        "stiffness_contrast": 1.0e-6,
        "void_permeability_rate": 1000.0,
        "permeability_contrast": 1.0e-6,
    },
    "load": {"pressure_ratio": 2.0e-2, "arm_ratio": 4.0, "spring_ratio": 1.6e-2},
    "objective": {
        "area_weight": 1.0e-3,
        "slope_weight": 1.0,
        "leak_weight": 1.0e6,
        "strain_energy_weight": 1.0e6,
        "passive_weight": 1.0e5,
        "interface_width": 3.0,
        "diffusivity_length": 15.0,
        "length_unit": 1.0,
    },
}


def reference_of(problem: ProblemSettings) -> Reference | None:
    """The paper's design of the same problem, on whatever mesh; None if the problem is another one."""
    material, limits = problem.material, problem.objective
    theirs = isinstance(problem.domain, HalfCylinderSettings) and material.law.name == "neo-hooke"
    if not theirs or limits.terms or limits.goal or problem.load.cases:
        return None
    found = problem.model_dump()
    found["objective"]["diffusivity_length"] = problem.parameters()[2].diffusivity_length
    for section, keys in TABLE_1.items():
        if any(not _same(found[section][key], value) for key, value in keys.items()):
            return None
    return next((each for each in REFERENCES if _same(each.strain_limit, problem.objective.strain_limit)), None)


def reading(problem: ProblemSettings) -> str:
    """How a case reads what the paper leaves open; docs/explain/readings.md compares the ways."""
    shift = problem.parameters()[2].energy_shift
    as_printed = "4/L_i in mm as Eq. (14) prints it"
    read = as_printed if _same(shift, 4.0 / 3.0) else f"{shift:.3g} where Eq. (14) has 4/L_i"
    elements = {"fitted": "fitted to the cells", "summed": "with rows summed", "plain": "plain"}
    return (
        f"the shift of χ {read}, c_r = {problem.material.hessian_regularisation:g} L² K_s, "
        f"elements of p {elements[problem.elements.pressure]}"
    )


def on_the_papers_mesh(domain: DomainSettings) -> bool:
    """Whether the mesh has the paper's cells: 528 in the section, 18 layers."""
    return isinstance(domain, HalfCylinderSettings) and (domain.cells, domain.layers) == (CELLS, 18)


def _same(one: Any, other: float) -> bool:
    return math.isclose(one, other, rel_tol=1e-9)
