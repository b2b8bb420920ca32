"""Exact Hessian-vector products of the reduced objective by Krylov solves with the coupled tangent.

An independent reference: the optimiser's model has its own, with fixed sweeps in place of the Krylov solves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from physics import Floats

from actuator.equations.tangent import symmetric_product
from actuator.solve.reduced import Evaluation, Gradient, ReducedObjective

#: The complex step subtracts nothing, so that it has no smallest sensible size.
TINY = 1e-40


@dataclass(frozen=True)
class Product:
    """Second-order response to a design direction d.

    Attributes:
        hessian: d²C/dχ² d, (n_vertices,).
        dx, dp: derivative of the state along d.
    """

    hessian: Floats
    dx: Floats
    dp: Floats


def hessian_product(
    objective: ReducedObjective, at: Evaluation, gradient: Gradient, direction: Floats, tolerance: float = 1e-10
) -> Product:
    """One tangent and one adjoint solve to a relative residual, and the complex step."""
    state, equilibrium = at.state, objective.equilibrium
    lx, lp = gradient.adjoint
    step = TINY / max(float(np.abs(direction).max()), 1e-300)
    chi = state.chi + 1j * step * direction
    rx, rp, _, _ = equilibrium.residual(chi, state.x, state.p)
    dx, dp = equilibrium.linearise(state).solve(-rx.imag / step, -rp.imag / step, tolerance)
    x, p = state.x + 1j * step * dx, state.p + 1j * step * dp
    _, _, nodal, _ = equilibrium.residual(chi, x, p)
    h_chi, hx, hp = (g.imag / step for g in objective.derivatives(chi, x, p, lx, lp, nodal))
    mx, mp = equilibrium.linearise(state).solve(-hx, -hp, tolerance, transposed=True)
    # The derivative of Λ·R alone: what the multipliers make of that of C + Λ·R.
    response, terms = (
        objective.derivatives(state.chi, state.x, state.p, *multipliers, state.nodal)[0]
        for multipliers in ((mx, mp), (0.0 * mx, 0.0 * mp))
    )
    return Product(h_chi + response - terms + design_product(objective, at, direction), dx, dp)


def design_product(objective: ReducedObjective, at: Evaluation, direction: Floats) -> Floats:
    """Hessian of C_χ + C_A + C_i times a direction, (n_vertices,)."""
    return symmetric_product(objective.design.gather.matrix(at.design.hessian), direction)
