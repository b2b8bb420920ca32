"""The terms of the objective, Eqs. (9) to (15): value, gradient and curvature of each in one file.

The paper's six are part of every problem. :data:`TERMS` has the classes of further ones by name; a problem has those
that the case's ``objective.terms`` names, made with the parameters given there:

    TERMS.register("C_V", Volume)    # class Volume(DesignTerm): def __init__(self, problem, *, weight, share=0.3)

The step term C_t is not part of the objective but of every design update: :mod:`actuator.terms.step`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from actuator.equations.assembly import Gather
from actuator.registry import Registry
from actuator.terms.design import DesignObjective
from actuator.terms.interface import DesignTerm, Problem, StateTerm
from actuator.terms.total import PAPER, StateObjective, TotalObjective

__all__ = ["PAPER", "TERMS", "DesignTerm", "Problem", "StateTerm", "TotalObjective", "total_objective"]

TERMS: Registry[Callable[..., DesignTerm | StateTerm]] = Registry("further term of the objective")


def total_objective(problems: Sequence[Problem], weights: Sequence[float], gather: Gather) -> TotalObjective:
    """The objective of a problem: the paper's terms and those that it names besides.

    Args:
        problems: what the terms are built from, for every load case; they differ in the load alone.
        weights: of the load cases.
        gather: pattern of upper triangles on vertices.

    Raises:
        KeyError: if there is no term of a name.
        TypeError: if a term does not take the parameters it is given.
    """
    further = problems[0].objective.terms
    others = [{name: TERMS[name](problem, **values) for name, values in further.items()} for problem in problems]
    of_design = {name: term for name, term in others[0].items() if isinstance(term, DesignTerm)}
    cases = [
        StateObjective(problem, {name: term for name, term in terms.items() if isinstance(term, StateTerm)}, weight)
        for problem, terms, weight in zip(problems, others, weights, strict=True)
    ]
    return TotalObjective(DesignObjective(problems[0], of_design, gather), cases, (*PAPER, *further))
