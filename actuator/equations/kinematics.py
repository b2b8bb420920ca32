"""Fixed end, symmetry plane and rigid arm: which displacements are free, and how the others follow.

The multiplier q of Eqs. (6) to (8) is eliminated exactly. Its equation makes u on Γ equal to the arm's rigid motion
node by node, because that motion lies in the trace space of u; what remains is the reaction on Γ acting on
T = [T1, T3, θ2].
"""

from __future__ import annotations

import numpy as np

from actuator.arrays import Floats, Ints
from actuator.domains.interface import Domain
from actuator.equations.end_force import end_force, end_tangent
from actuator.equations.scheme import Element
from actuator.parameters import Load

#: Where the arm's rigid motion T = [T1, T3, θ2] stands in the reduced coordinates: behind the free displacements.
T1, T3, THETA2 = -3, -2, -1
ARM = slice(T1, None)


class Kinematics:
    """Reduced coordinates x = [free displacements, T1, T3, θ2].

    Attributes:
        index: reduced index of each displacement component, (n_nodes, 3); -1 where fixed, by symmetry or by the arm.
        size: length of x.

    With the 8-node element the vertices alone have displacements of their own. Edge midpoints then take the mean of
    their edge's ends, which is where the trilinear field puts them, and no force acts on them.
    """

    def __init__(self, domain: Domain, load: Load, element: Element = "hex20") -> None:
        self.tip: Ints = domain.tip.nodes
        self.tip_height: Floats = domain.nodes[self.tip, 2]
        self.load = load
        free = np.ones((len(domain.nodes), 3), dtype=bool)
        free[domain.fixed.nodes] = False
        free[self.tip] = False
        free[domain.symmetry.nodes, 1] = False
        self._edges: Ints | None = None
        if element == "hex8":
            self._edges = domain.edges
            free[domain.mesh.nvertices :] = False
        self._free = np.flatnonzero(free.ravel())
        self.size = len(self._free) + 3
        self.index: Ints = np.full(free.shape, -1, dtype=np.int64)
        self.index.ravel()[self._free] = np.arange(len(self._free))

    def displacement(self, x: Floats) -> Floats:
        """u at all nodes, (n_nodes, 3), mm."""
        u = np.zeros(self.index.shape, dtype=x.dtype)
        u.ravel()[self._free] = x[:T1]
        height, angle = self.tip_height, x[THETA2]
        u[self.tip, 0] = x[T1] + height * np.sin(angle)
        u[self.tip, 2] = x[T3] - height * (1.0 - np.cos(angle))
        return self._completed(u)

    def _completed(self, u: Floats) -> Floats:
        if self._edges is not None:
            u[len(u) - len(self._edges) :] = 0.5 * (u[self._edges[:, 0]] + u[self._edges[:, 1]])
        return u

    def reduced(self, u: Floats, arm: Floats) -> Floats:
        """x of a displacement field (n_nodes, 3) that satisfies the constraints, and of T (3,)."""
        return np.concatenate([u.ravel()[self._free], arm])

    def tip_directions(self, angle: Floats | float) -> Floats:
        """∂u/∂T at the nodes of Γ, (n_tip, 3 components, 3 of T)."""
        directions = np.zeros((len(self.tip), 3, 3), dtype=np.asarray(angle).dtype)
        directions[:, 0, 0] = 1.0
        directions[:, 2, 1] = 1.0
        directions[:, 0, 2] = self.tip_height * np.cos(angle)
        directions[:, 2, 2] = -self.tip_height * np.sin(angle)
        return directions

    def variation(self, x: Floats, dx: Floats) -> Floats:
        """Displacement field (n_nodes, 3) of a variation dx of x at x."""
        u = np.zeros(self.index.shape, dtype=np.result_type(x, dx))
        u.ravel()[self._free] = dx[:T1]
        u[self.tip] = self.tip_directions(x[THETA2]) @ dx[ARM]
        return self._completed(u)

    def force(self, x: Floats, nodal: Floats) -> Floats:
        """Transpose of :meth:`variation`: reduced forces of nodal forces (n_nodes, 3)."""
        reduced = np.empty(self.size, dtype=np.result_type(x, nodal))
        reduced[:T1] = nodal.ravel()[self._free]
        reduced[ARM] = self.tip_directions(x[THETA2]).reshape(-1, 3).T @ nodal[self.tip].ravel()
        return reduced

    def second_variation(self, x: Floats, nodal: Floats) -> Floats:
        """Σ nodal · ∂²u/∂θ2² over Γ, in N mm: what the arm's rotation adds to the tangent."""
        angle = x[THETA2]
        force = nodal[self.tip]
        return -np.sum(self.tip_height * (np.sin(angle) * force[:, 0] + np.cos(angle) * force[:, 2]))

    # ------------------------------------------------------- spring, Eq. (8)

    def elongation(self, x: Floats) -> Floats:
        """Vertical position T3 - L_arm sin θ2 of the spring's end, mm; negative is downwards."""
        return x[T3] - self.load.arm_length * np.sin(x[THETA2])

    def spring_force(self, x: Floats) -> Floats:
        """Derivative of the energy of spring and force at the arm's end with respect to T, (3,)."""
        rate = self.load.spring_stiffness * self.elongation(x)
        spring = rate * np.array([0.0 * x[THETA2], 1.0 + 0.0 * x[THETA2], -self.load.arm_length * np.cos(x[THETA2])])
        return spring + end_force(x[ARM], self.load) if any(self.load.force) else spring

    def spring_tangent(self, x: Floats) -> Floats:
        """Second derivative of the same energy with respect to T, (3, 3)."""
        arm, cosine = self.load.arm_length, np.cos(x[THETA2])
        direction = np.array([0.0, 1.0, -arm * cosine])
        tangent = np.outer(direction, direction).astype(np.result_type(x))
        tangent[2, 2] += self.elongation(x) * arm * np.sin(x[THETA2])
        spring = self.load.spring_stiffness * tangent
        return spring + end_tangent(x[ARM], self.load) if any(self.load.force) else spring
