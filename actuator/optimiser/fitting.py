"""A design moved to where the bounds of regions can be kept from, before the optimisation begins.

The interior point method of the subproblems starts near its bounds or within them. A design that keeps the bounds of
regions at the vertices may violate them by χ = 1 and more at the quadrature points between, and from there slacks run
into each other. So the nearest design within the bounds is looked for first: the minimum over s of

    D(χ + s) + c/2 ∫ s²,   D = C_χ + C_A + C_i,

with C_χ as what it is, a penalty, by Newton's method with a search along every step. No physics is computed here.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from actuator.arrays import Floats
from actuator.optimiser.controls import CONTROLS, Controls
from actuator.optimiser.curvature import Curvature
from actuator.optimiser.quadratic import Inverse, Quadratic
from actuator.solve.reduced import ReducedObjective
from actuator.terms.step import Metric

#: c over c_χ: what lies 1e-3 of χ beyond a bound then outweighs any change of χ that brings it back. And the share of
#: that by which the norm of C_t counts, which a curvature needs.
NEARNESS, SMOOTHNESS = 1e-7, 1e-6
#: Most steps; on meshes from 1,080 to 9,504 cells some 20 to 60 leave less than 1e-2 of χ beyond a bound.
MOST = 60
#: Relative decrease at which it ends.
SETTLED = 1e-6


def within_bounds(objective: ReducedObjective, norm: Metric, chi: Floats, controls: Controls = CONTROLS) -> Floats:
    """The nearest design within the bounds of regions, (n_vertices,); the same where no region bounds it.

    Args:
        objective: the case.
        norm: of the design.
        chi: χ at the vertices, (n_vertices,).
        controls: of its searches.
    """
    design = objective.design
    if design.bound is None or design.passive.by_class:
        return chi
    weight = NEARNESS * design.passive.weight
    mass = sp.csr_array(sp.triu(objective.discretisation.mass, format="csr"))
    mass.sort_indices()
    physics = Quadratic(
        np.zeros_like(chi), Curvature(norm, SMOOTHNESS * weight), design.gather.matrix(weight * mass.data)
    )
    inverse = Inverse(objective.equilibrium.vertex_solver(), norm, design.gather.indptr[:-1])
    s = np.zeros_like(chi)
    value = design.value(chi)
    for _ in range(MOST):
        there = design(chi + s)
        force = there.gradient + physics.bent(s)
        p = -inverse(there.hessian, physics)(force)
        slope, length, after = float(force @ p), 1.0, np.inf
        while length > controls.shortest:
            ahead = s + length * p
            after = design.value(chi + ahead) + physics.value(ahead, physics.bent(ahead))
            if after < value + controls.sufficient_decrease * length * slope:
                break
            length *= controls.backtracking
        gain = value - after
        if gain > 0.0:
            s, value = s + length * p, after
        if gain <= SETTLED * abs(value):
            break
    return chi + s
