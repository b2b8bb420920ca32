"""C_i of Eq. (12): a slope of χ steeper than the interface's width allows, c_i / 6 ∫ ⟨‖∇χ‖ - 8 / L_i⟩⁶."""

from __future__ import annotations

from numba import njit

from actuator.terms.interface import Problem


def slope_limit(problem: Problem) -> float:
    """8 / L_i, 1/mm."""
    return 8.0 / problem.objective.interface_width


@njit(cache=True, inline="always")
def interface_slope(weight, dx, norm, excess):
    """C_i at a point of volume dx, and its derivatives with respect to ∇χ.

    Args:
        norm: ‖∇χ‖, 1/mm.
        excess: ‖∇χ‖ - 8 / L_i, positive.

    Returns:
        The value; ``across``, with gradient = across ∇χ; and ``along``, with Hessian = along ∇χ ∇χᵀ + across I.
    """
    cube = excess * excess * excess
    value = weight / 6.0 * dx * cube * cube
    across = weight * dx * cube * excess * excess / norm
    along = (5.0 * weight * dx * cube * excess - across) / (norm * norm)
    return value, across, along
