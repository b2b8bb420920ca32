"""The terms of the objective, Eqs. (9) to (15): value, gradient and curvature of each in one file.

:data:`TERMS` has the class of every term by its name. The paper's are part of every problem; another one is where the
case's ``objective.terms`` names it, and is made with the parameters given there:

    TERMS.register("C_V", Volume)    # class Volume(DesignTerm): def __init__(self, problem, *, weight, share=0.3)

The step term C_t is not part of the objective but of every design update: :mod:`actuator.terms.step`.
"""

from __future__ import annotations

from collections.abc import Callable

from actuator.equations.assembly import Gather
from actuator.registry import Registry
from actuator.terms.interface import DesignTerm, Problem, StateTerm
from actuator.terms.interface_slope import InterfaceSlope
from actuator.terms.leak import Leak
from actuator.terms.main_objective import MainObjective
from actuator.terms.passive_region import PassiveRegion
from actuator.terms.strain_energy import StrainEnergy
from actuator.terms.surface_area import SurfaceArea
from actuator.terms.total import TotalObjective

TERMS: Registry[Callable[..., DesignTerm | StateTerm]] = Registry("term of the objective")
TERMS.register("C0", MainObjective)
TERMS.register("C_chi", PassiveRegion)
TERMS.register("C_A", SurfaceArea)
TERMS.register("C_i", InterfaceSlope)
TERMS.register("C_p", Leak)
TERMS.register("C_psi", StrainEnergy)
#: Names of the paper's terms, in the order in which they are reported.
PAPER = tuple(TERMS)


def total_objective(problem: Problem, gather: Gather) -> TotalObjective:
    """The objective of a problem: the paper's terms and those that it names besides.

    Args:
        problem: what the terms are built from.
        gather: pattern of upper triangles on vertices.

    Raises:
        KeyError: if there is no term of a name.
        TypeError: if a term does not take the parameters it is given.
    """
    terms = {name: TERMS[name](problem) for name in PAPER}
    others = {name: TERMS[name](problem, **values) for name, values in problem.objective.terms.items()}
    return TotalObjective(problem, terms | others, gather)
