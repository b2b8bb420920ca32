"""Fixed end, symmetry plane and rigid arm: which displacements are free, and how the others follow.

The multiplier q of Eqs. (6) to (8) is eliminated exactly. Its equation makes u on Γ equal to the arm's rigid motion
node by node, because that motion lies in the trace space of u; what remains is the reaction on Γ acting on T: T1, T3
and θ2 in a half, all six coordinates in a whole (:mod:`actuator.equations.arm`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.domains.interface import Domain
from actuator.equations.arm import COORDINATES, OF_HALF, RigidArm
from actuator.equations.scheme import Element
from actuator.parameters import Load


class Kinematics:
    """Reduced coordinates x = [free displacements, T].

    Attributes:
        arm: the rigid arm with the spring at its end.
        of_arm: where T stands in x.
        index: reduced index of each displacement component, (n_nodes, 3); -1 where fixed, by symmetry or by the arm.
        size: length of x.

    With the 8-node element the vertices alone have displacements of their own. Edge midpoints then take the mean of
    their edge's ends, which is where the trilinear field puts them, and no force acts on them.
    """

    def __init__(self, domain: Domain, load: Load, element: Element = "hex20") -> None:
        self.tip: Ints = domain.tip.nodes
        self._plate: Floats = domain.nodes[self.tip]
        names = OF_HALF if domain.mirrored else COORDINATES
        self.load, self._force = load, np.array(load.force)
        self.arm = RigidArm(domain.length, load.arm_length, load.spring_stiffness, names)
        free = np.ones((len(domain.nodes), 3), dtype=bool)
        free[domain.fixed.nodes] = False
        free[self.tip] = False
        free[domain.symmetry.nodes, 1] = False
        self._edges: Ints | None = None
        if element == "hex8":
            self._edges = domain.edges
            free[domain.mesh.nvertices :] = False
        self._free = np.flatnonzero(free.ravel())
        n = len(self._free)
        self.size = n + len(names)
        self.of_arm = slice(n, None)
        self._others = slice(n)
        self.index: Ints = np.full(free.shape, -1, dtype=np.int64)
        self.index.ravel()[self._free] = np.arange(n)

    def displacement(self, x: Floats) -> Floats:
        """u at all nodes, (n_nodes, 3), mm."""
        u = np.zeros(self.index.shape, dtype=x.dtype)
        u.ravel()[self._free] = x[self._others]
        u[self.tip] = self.arm.displacement(x[self.of_arm], self._plate)
        return self._completed(u)

    def _completed(self, u: Floats) -> Floats:
        if self._edges is not None:
            u[len(u) - len(self._edges) :] = 0.5 * (u[self._edges[:, 0]] + u[self._edges[:, 1]])
        return u

    def reduced(self, u: Floats, arm: Floats) -> Floats:
        """x of a displacement field (n_nodes, 3) that satisfies the constraints, and of T (m,)."""
        return np.concatenate([u.ravel()[self._free], arm])

    def motion(self, x: Floats) -> Floats:
        """All six coordinates of the arm, mm and rad, in the order of :data:`actuator.equations.arm.COORDINATES`."""
        return self.arm.full(x[self.of_arm])

    def tip_directions(self, x: Floats) -> Floats:
        """∂u/∂T at the nodes of Γ, (n_tip, 3 components, m of T)."""
        return self.arm.directions(x[self.of_arm], self._plate)

    def variation(self, x: Floats, dx: Floats) -> Floats:
        """Displacement field (n_nodes, 3) of a variation dx of x at x."""
        u = np.zeros(self.index.shape, dtype=np.result_type(x, dx))
        u.ravel()[self._free] = dx[self._others]
        u[self.tip] = self.tip_directions(x) @ dx[self.of_arm]
        return self._completed(u)

    def force(self, x: Floats, nodal: Floats) -> Floats:
        """Transpose of :meth:`variation`: reduced forces of nodal forces (n_nodes, 3)."""
        reduced = np.empty(self.size, dtype=np.result_type(x, nodal))
        reduced[self._others] = nodal.ravel()[self._free]
        directions = self.tip_directions(x)
        reduced[self.of_arm] = directions.reshape(-1, directions.shape[-1]).T @ nodal[self.tip].ravel()
        return reduced

    def second_variation(self, x: Floats, nodal: Floats) -> Floats:
        """Σ nodal · ∂²u/∂T² over Γ, (m, m): what the arm's rotation adds to the tangent."""
        return self.arm.second_variation(x[self.of_arm], self._plate, nodal[self.tip])

    def elongation(self, x: Floats) -> Any:
        """Vertical position of the spring's end, mm; negative is downwards."""
        return self.arm.elongation(x[self.of_arm])

    def spring_force(self, x: Floats) -> Floats:
        """Derivative of the energy of spring and force at the arm's end, Eq. (8), with respect to T, (m,)."""
        T = x[self.of_arm]
        spring = self.arm.spring(T)[1]
        return spring + self.arm.pulled(T, self._force)[0] if self._force.any() else spring

    def spring_tangent(self, x: Floats) -> Floats:
        """Second derivative of the same energy with respect to T, (m, m)."""
        T = x[self.of_arm]
        spring = self.arm.spring(T)[2]
        return spring + self.arm.pulled(T, self._force)[1] if self._force.any() else spring
