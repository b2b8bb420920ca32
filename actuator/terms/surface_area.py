"""C_A of Eq. (11): the area of the interface between void and solid, c_A 8 / L_i |Ω|^(-2/3) ∫ ρ (1 - ρ)."""

from __future__ import annotations

from numba import njit

from actuator.material.ersatz import sigmoid
from actuator.terms.interface import Problem


def area_weight(problem: Problem) -> float:
    """c_A 8 / L_i |Ω|^(-2/3), 1/mm³."""
    objective = problem.objective
    return objective.area_weight / problem.discretisation.volume ** (2.0 / 3.0) * 8.0 / objective.interface_width


@njit(cache=True, inline="always")
def surface_area(weight, dx, x):
    """C_A at a point of volume dx and its first and second derivative with respect to χ."""
    rho, void = sigmoid(x), sigmoid(-x)
    bump, tilt = rho * void, void - rho
    return (
        weight * dx * bump,
        weight * dx * bump * tilt,
        weight * dx * bump * (tilt * tilt - 2.0 * bump),
    )
