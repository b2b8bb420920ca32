"""What the physics tests share: small cases, the paper's laws written afresh, and Taylor remainders.

Nothing here calls the element kernels for a reference value: fields are evaluated by scikit-fem and stresses by NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from skfem import Basis, ElementHex1, ElementHexS2

from actuator.arrays import Floats, Ints
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.equations.assembly import scatter_vector
from actuator.equations.discretisation import Discretisation, Geometry
from actuator.equations.kernels import residual
from actuator.equations.quadrature import hexahedron_14
from actuator.equations.tangent_kernels import PACKED, flow_tangent, tangent
from actuator.material.constants import Constants, constants_of
from actuator.parameters import Load, Material, Objective
from stages.domains import HalfCylinderSettings
from stages.settings import LoadSettings, MaterialSettings, ObjectiveSettings, ProblemSettings

RADIUS = LENGTH = 15.0
IDENTITY = np.eye(3)

#: A deformation gradient with stretch, shear and rotation; det F = 1.17.
STRETCH = np.array([[1.20, 0.10, -0.05], [-0.15, 0.95, 0.20], [0.08, -0.12, 0.98]])


def half_cylinder(core_cells: int = 2, rings: int = 1, layers: int = 3) -> HalfCylinder:
    return HalfCylinder(RADIUS, LENGTH, core_cells, rings, layers)


def parameters(
    *, material: dict[str, float] | None = None, load: dict[str, float] | None = None, **objective: Any
) -> tuple[Material, Load, Objective]:
    """The paper's parameters, Eq. (14) as printed, with some of the case file's settings replaced."""
    return ProblemSettings(
        domain=HalfCylinderSettings(radius=RADIUS, length=LENGTH),
        material=MaterialSettings(**(material or {})),
        load=LoadSettings(**(load or {})),
        objective=ObjectiveSettings(**({"strain_energy_shift": "4/L_i"} | objective)),
    ).parameters()


def coefficients(**changes: float) -> Constants:
    """The paper's constants, some of them replaced."""
    return constants_of(*parameters())._replace(**changes)


def random_rotation(seed: int) -> Floats:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


# ------------------------------------------------------------------ the paper's laws, Eqs. (1) to (6), in NumPy


def density(chi: Floats) -> Floats:
    return 1.0 / (1.0 + np.exp(-chi))


def ramp(chi: Floats, c: Constants) -> Floats:
    rho = density(chi)
    return c.stiffness_contrast + (1.0 - c.stiffness_contrast) * rho / (1.0 + c.ramp_penalty * (1.0 - rho))


def permeability(chi: Floats, c: Constants) -> Floats:
    return c.void_permeability + (c.solid_permeability - c.void_permeability) * density(chi + 8.0)


def fitted_permeability(chi: Floats, c: Constants, dx: Floats) -> Floats:
    """Geometric mean over each cell of k (s / sinh s)², s = h/2 sqrt(Q_out / k), for cells of volume h³ = Σ dx.

    χ and dx are (n_cells, n_q), the result (n_cells, 1).
    """
    k, volume = permeability(chi, c), dx.sum(axis=1, keepdims=True)
    s = 0.5 * np.cbrt(volume) * np.sqrt(c.drainage * density(chi) / k)
    return np.exp((dx * np.log(k * (s / np.sinh(s)) ** 2)).sum(axis=1, keepdims=True) / volume)


def strain_energy(F: Floats, factor: Floats, c: Constants) -> Floats:
    """Ψ for F (..., 3, 3): Simo, Taylor & Pister's neo-Hooke with both moduli scaled."""
    J = np.linalg.det(F)
    trace = np.einsum("...ij,...ij->...", F, F)
    return factor * (0.5 * c.bulk * np.log(J) ** 2 + 0.5 * c.shear * (J ** (-2.0 / 3.0) * trace - 3.0))


def first_piola(F: Floats, factor: Floats, pressure: Floats, c: Constants) -> Floats:
    """P = ((K ln J - J p) I + G J^(-2/3) dev(F Fᵀ)) F⁻ᵀ of Eq. (6), for F (..., 3, 3); real or complex."""
    J = np.linalg.det(F)
    b = np.einsum("...ik,...jk->...ij", F, F)
    deviator = b - np.einsum("...kk->...", b)[..., None, None] * IDENTITY / 3.0
    spherical = factor * c.bulk * np.log(J) - J * pressure
    shear = factor * c.shear * J ** (-2.0 / 3.0)
    stress = spherical[..., None, None] * IDENTITY + shear[..., None, None] * deviator
    return np.einsum("...ik,...jk->...ij", stress, np.linalg.inv(F))


# ------------------------------------------------------------------------------------- fields and residuals


def bases(domain: Domain) -> tuple[Basis, Basis]:
    """Trilinear and 20-node bases of scikit-fem on every cell of the mesh, with the 14-point rule."""
    rule = hexahedron_14()
    return (Basis(domain.mesh, element, quadrature=rule) for element in (ElementHex1(), ElementHexS2()))


def displacement_gradients(basis: Basis, u: Floats) -> Floats:
    """∇u at the points of a scikit-fem basis, (n_cells, n_q, 3, 3), for u (n_nodes, 3); real or complex."""
    if np.iscomplexobj(u):
        return displacement_gradients(basis, u.real) + 1j * displacement_gradients(basis, u.imag)
    return np.stack([basis.interpolate(u[:, i]).grad for i in range(3)]).transpose(2, 3, 0, 1)


def deformation_gradients(basis: Basis, u: Floats) -> Floats:
    """F = I + ∇u at the points of a scikit-fem basis, (n_cells, n_q, 3, 3)."""
    return IDENTITY + displacement_gradients(basis, u)


def nodal_residuals(
    geometry: Geometry, source: Floats, c: Constants, chi: Floats, u: Floats, p: Floats
) -> tuple[Floats, Floats]:
    """Assembled element residuals without any boundary condition: forces (n_nodes, 3) and flows (n_vertices,)."""
    n_cells = len(geometry.cells)
    kind = np.result_type(chi, u, p)
    Ru, Rp = np.empty((n_cells, 20, 3), kind), np.empty((n_cells, 8), kind)
    residual(geometry, source, c, chi.astype(kind), u.astype(kind), p.astype(kind), True, Ru, Rp)
    return scatter_vector(Ru, geometry.node_cells, len(u)), scatter_vector(Rp, geometry.cells, len(p))


def element_tangents(
    geometry: Geometry, source: Floats, c: Constants, chi: Floats, u: Floats, p: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Blocks uu, up, pu, pp of every element, as matrices of 60 displacements (node by node) and 8 pressures."""
    n = len(geometry.cells)
    packed, up, pu, pp = (np.empty((n, *shape)) for shape in ((PACKED,), (20, 3, 8), (8, 20, 3), (8, 8)))
    tangent(geometry, source, c, chi, u, p, packed, up, pp)
    flow_tangent(geometry, c, chi, u, p, pu, np.empty((n, 8, 8)))
    uu = np.empty((n, 20, 3, 20, 3))
    for k, (a, b) in enumerate(zip(*np.triu_indices(20), strict=True)):
        block = packed[:, 9 * k : 9 * k + 9].reshape(n, 3, 3)
        uu[:, a, :, b], uu[:, b, :, a] = block, block.transpose(0, 2, 1)
    return uu.reshape(n, 60, 60), up.reshape(n, 60, 8), pu.reshape(n, 8, 60), pp


def displacement_dofs(geometry: Geometry) -> NDArray[np.int64]:
    """Numbers of the 60 displacements of each element, (n_cells, 60): three for each node."""
    return (3 * geometry.node_cells[..., None] + np.arange(3)).reshape(-1, 60)


def assembled(blocks: Floats, rows: Ints, columns: Ints, shape: tuple[int, int]) -> sp.csr_array:
    """Sum of element matrices (n_cells, n_rows, n_columns) by SciPy."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return sp.coo_array((blocks.ravel(), (i.ravel(), j.ravel())), shape).tocsr()


def no_source(discretisation: Discretisation) -> Floats:
    return np.zeros_like(discretisation.geometry.volume)


def boundary_nodes(domain: Domain) -> NDArray[np.bool_]:
    """Which of the 20-node element's nodes lie on the surface of the half cylinder."""
    basis = Basis(domain.mesh, ElementHexS2(), intorder=1)
    on_boundary = np.zeros(basis.N, dtype=bool)
    on_boundary[basis.get_dofs(domain.mesh.boundary_facets()).all()] = True
    return on_boundary


def wavy(points: Floats, amplitude: float, seed: int) -> Floats:
    """A smooth vector field (n, 3) with wavelengths of the size of the domain."""
    rng = np.random.default_rng(seed)
    waves, phases = rng.normal(size=(3, 3)) * np.pi / LENGTH, rng.uniform(0.0, 2.0 * np.pi, 3)
    return amplitude * np.sin(points @ waves.T + phases)


# --------------------------------------------------------------------------------------- Taylor remainders


def rates(remainders: Sequence[float]) -> Floats:
    """log2 of successive ratios, for steps that are halved each time."""
    remainder = np.abs(np.asarray(remainders))
    return np.log2(remainder[:-1] / remainder[1:])


def remainders(
    value: Callable[[float], Floats | float], model: Callable[[float], Floats | float], steps: Floats
) -> list[float]:
    """‖value(h) - model(h)‖ for each step h."""
    return [float(np.linalg.norm(np.atleast_1d(value(h) - model(h)))) for h in steps]


def halvings(first: float, count: int = 5) -> Floats:
    return first * 0.5 ** np.arange(count)
