"""The volume of the air chamber as a function of the nodes on its walls, with first and second derivatives.

By the divergence theorem V = 1/3 ∮ x · n dA. With the origin on the fixed plate, and on the symmetry plane where there
is one, these two add nothing; the arm's plate adds a term in closed form, since it stays plane. The virtual work of
the air p δV is that of a follower pressure on walls and plate, and its second derivative is symmetric.
"""

from __future__ import annotations

from itertools import permutations

import numpy as np

from actuator.arrays import Floats, Ints

#: Rule of degree 4 for triangles of area 1/2 (Dunavant 1985, doi:10.1002/nme.1620210612); the integrand is of degree 4.
_NEAR, _FAR = 0.445948490915965, 0.091576213509771
_POINTS = np.array(
    [(a, a) for a in (_NEAR, _FAR)] + [p for a in (_NEAR, _FAR) for p in ((1 - 2 * a, a), (a, 1 - 2 * a))]
)
_WEIGHTS = 0.5 * np.array([0.223381589678011, 0.109951743655322, *[0.223381589678011] * 2, *[0.109951743655322] * 2])


def _shapes() -> Floats:
    """N, ∂N/∂ξ and ∂N/∂η of the 6-node triangle at the points of the rule, (n_points, 3, 6)."""
    barycentric = np.column_stack([1.0 - _POINTS.sum(axis=1), _POINTS])
    slopes = np.array([(-1.0, -1.0), (1.0, 0.0), (0.0, 1.0)])
    values = np.empty((len(_POINTS), 3, 6))
    for a in range(3):
        values[:, 0, a] = barycentric[:, a] * (2.0 * barycentric[:, a] - 1.0)
        values[:, 1:, a] = (4.0 * barycentric[:, a, None] - 1.0) * slopes[a]
    for k, (a, b) in enumerate(((0, 1), (1, 2), (2, 0)), start=3):
        values[:, 0, k] = 4.0 * barycentric[:, a] * barycentric[:, b]
        values[:, 1:, k] = 4.0 * (barycentric[:, a, None] * slopes[b] + barycentric[:, b, None] * slopes[a])
    return values


_SHAPES = _shapes()
_SIGNS = {order: float(np.linalg.det(np.eye(3)[list(order)])) for order in permutations(range(3))}
#: ε_ikm of the vector product.
_EPSILON = np.array([[[_SIGNS.get((i, k, m), 0.0) for m in range(3)] for k in range(3)] for i in range(3)])


def volume(x: Floats, walls: Ints) -> float:
    """-1/3 ∮ x · n dA over the walls, mm³, normals out of the body and so into the chamber.

    Args:
        x: nodes in their present places, (n_nodes, 3), mm.
        walls: (n, 6), in the order of :data:`actuator.body.mesh.FACES`.
    """
    v = np.einsum("qsa,fai->fqsi", _SHAPES, x[walls])
    return -float(np.einsum("q,fq->", _WEIGHTS, np.linalg.det(v))) / 3.0


def tractions(x: Floats, walls: Ints) -> Floats:
    """-∫ N n dA of the nodes of every wall face, (n, 6, 3), mm²: forces of a unit pressure on the body."""
    v = np.einsum("qsa,fai->fqsi", _SHAPES[:, 1:], x[walls])
    return -np.einsum("q,qa,fqi->fai", _WEIGHTS, _SHAPES[:, 0], np.cross(v[:, :, 0], v[:, :, 1]), optimize=True)


def gradient(x: Floats, walls: Ints) -> Floats:
    """∂V/∂x of the nodes of every wall face, (n, 6, 3), mm²."""
    v = np.einsum("qsa,fai->fqsi", _SHAPES, x[walls])
    products = np.stack([np.cross(v[:, :, 1], v[:, :, 2]), np.cross(v[:, :, 2], v[:, :, 0])], axis=2)
    products = np.concatenate([products, np.cross(v[:, :, 0], v[:, :, 1])[:, :, None]], axis=2)
    return -np.einsum("q,qsa,fqsi->fai", _WEIGHTS, _SHAPES, products, optimize=True) / 3.0


def hessian(x: Floats, walls: Ints) -> Floats:
    """∂²V/∂x² of every wall face, (n, 6, 3, 6, 3), mm."""
    v = np.einsum("qsa,fai->fqsi", _SHAPES, x[walls])
    axial = np.zeros((len(walls), 6, 6, 3))
    for (s, t, rest), sign in _SIGNS.items():
        pairs = sign * _WEIGHTS[:, None, None] * _SHAPES[:, s, :, None] * _SHAPES[:, t, None, :]
        axial += np.tensordot(v[:, :, rest], pairs, axes=(1, 0)).transpose(0, 2, 3, 1)
    return -np.einsum("fabm,ikm->faibk", axial, _EPSILON, optimize=True) / 3.0
