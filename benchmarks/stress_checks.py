"""What the results under stress are compared with: solutions found in another way than the program's."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from actuator.arrays import Floats, Ints
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.equations.assembly import scatter_vector
from actuator.equations.discretisation import Discretisation
from actuator.equations.kernels import residual
from actuator.failure import SolveFailure
from actuator.material.constants import Constants, constants_of
from actuator.material.ersatz import drainage, permeability, sigmoid, stiffness
from actuator.solve.equilibrium import Equilibrium
from actuator.solve.path import Control, Point, begin, follow
from actuator.solve.pressurisation import Pressurisation
from actuator.solve.reduced import ReducedObjective
from benchmarks.stress_trial import Found, Trial, settings
from stages.domains import HalfCylinderSettings

# ------------------------------------------------------------------------------------- a spring that does not give


def held_arm(found: Found) -> Floats:
    """[T1, T3, θ2] of a trial whose spring is replaced by the condition that its end stays where it is.

    Newton's method on the coupled equations with a multiplier for T3 - L_arm sin θ2 = 0, each step by one sparse
    factorisation of the whole matrix: nothing of the program's own solution is used but residual and tangent.
    """
    trial = found.trial
    material, load, limits = trial.case.parameters()
    free = replace(load, spring_stiffness=0.0)
    equilibrium = Equilibrium(found.objective.domain, material, free, limits, threads=1)
    chi, arm = found.at.chi, load.arm_length
    n, n_p = equilibrium.kinematics.size, len(chi)
    x, p, hold = found.at.state.x.copy(), found.at.state.p.copy(), 0.0
    for _ in range(12):
        rx, rp, nodal, _ = equilibrium.residual(chi, x, p)
        direction = np.zeros(n)
        direction[-2:] = 1.0, -arm * np.cos(x[-1])
        gap = x[-2] - arm * np.sin(x[-1])
        equilibrium.tangent.assemble(equilibrium.source, equilibrium.coefficients, chi, x, p, nodal)
        tangent = equilibrium.tangent
        xx, pp = _whole(tangent.xx), _whole(tangent.pp)
        bend = sp.coo_array(([hold * arm * np.sin(x[-1])], ([n - 1], [n - 1])), (n, n))
        column = sp.csc_array(direction[:, None])
        matrix = sp.block_array([[xx + bend, tangent.xp, column], [tangent.px, pp, None], [column.T, None, None]])
        step = splu(sp.csc_array(matrix)).solve(-np.concatenate([rx + hold * direction, rp, [gap]]))
        x, p, hold = x + step[:n], p + step[n : n + n_p], hold + step[-1]
        if np.abs(step[:n]).max() < 1e-12 * np.abs(x).max():
            return x[-3:]
    raise ArithmeticError("the held arm's Newton iteration did not converge")


def _whole(upper: sp.csr_array) -> sp.csr_array:
    return sp.csr_array(upper + upper.T - sp.diags_array(upper.diagonal()))


# ---------------------------------------------------------------------------------------------------- locking

#: A bar of ten radii: m, k, layers.
BAR = HalfCylinder(15.0, 150.0, 2, 1, 12)


def bar_rotation(poisson_ratio: float, refinement: int = 1) -> float:
    """Rotation of a solid bar's end under a small moment on the arm, over Euler and Bernoulli's M L / (E I)."""
    domain = BAR.refined(refinement)
    case = settings(material__poisson_ratio=poisson_ratio, material__hessian_regularisation=0.0, load__spring_ratio=0.0)
    case = case.model_copy(update={"domain": HalfCylinderSettings(radius=15.0, length=150.0)})
    equilibrium = Equilibrium(domain, *case.parameters(), threads=1)
    chi, rest = np.full(domain.mesh.nvertices, 40.0), np.zeros(equilibrium.kinematics.size)
    _, _, nodal, _ = equilibrium.residual(chi, rest, 0.0 * chi)
    tangent = equilibrium.tangent
    tangent.assemble(equilibrium.source, equilibrium.coefficients, chi, rest, 0.0 * chi, nodal)
    moment = np.zeros_like(rest)
    moment[-1] = 1.0
    rotation = splu(sp.csc_array(_whole(tangent.xx))).solve(moment)[-1]
    discretisation = equilibrium.discretisation
    height = discretisation.quadrature_points[..., 2]
    # One layer's integral of X3² over its thickness: the section of the mesh, not of the circle.
    inertia = float((discretisation.geometry.volume * height**2).sum()) * domain.layers / domain.length
    return float(rotation * case.material.youngs_modulus * inertia / domain.length)


# --------------------------------------------------------------------------------------------------- skewed cells


class Skewed(HalfCylinder):
    """A half cylinder whose section is distorted by a smooth map that keeps the wall and the symmetry plane."""

    #: Largest turn of a point about the axis, rad, and largest shift along its radius, over R.
    TURN, SHIFT = 0.45, 0.1

    @cached_property
    def _section(self) -> tuple[Floats, Ints]:
        points, cells = HalfCylinder.__dict__["_section"].func(self)
        radius = np.hypot(*points.T) / self.radius
        angle = np.arctan2(points[:, 1], points[:, 0])
        inside = radius * (1.0 - radius)
        turned = angle + 4.0 * self.TURN * inside * np.cos(angle) ** 2
        shifted = radius + 4.0 * self.SHIFT * inside * np.sin(3.0 * angle)
        moved = self.radius * shifted[:, None] * np.stack([np.cos(turned), np.sin(turned)], axis=1)
        moved[points[:, 0] == 0.0, 0] = 0.0
        return np.where((radius > 1.0 - 1e-12)[:, None], points, moved), cells


def smallest_angle(domain: HalfCylinder) -> float:
    """Of the section's cells, degrees."""
    points, cells = domain.section
    corners = points[cells[:, [0, 1, 1, 0], [0, 0, 1, 1]]]
    ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    cosine = (ahead * back).sum(-1) / np.linalg.norm(ahead, axis=-1) / np.linalg.norm(back, axis=-1)
    return float(np.degrees(np.arccos(np.abs(cosine))).min())


def patch_error(domain: Domain) -> float:
    """Largest force inside a mesh under a homogeneous deformation, over the largest on its surface."""
    discretisation = Discretisation(domain)
    geometry = discretisation.geometry
    if not geometry.volume.min() > 0.0:
        raise ValueError("a cell of the mesh is turned inside out")
    gradient = np.array([[0.20, 0.10, -0.05], [-0.15, -0.05, 0.20], [0.08, -0.12, -0.02]])
    c = constants_of(*settings().parameters())._replace(hessian_penalty=0.0)
    ones = np.ones(domain.mesh.nvertices)
    Ru, Rp = np.empty((len(geometry.cells), 20, 3)), np.empty((len(geometry.cells), 8))
    residual(
        geometry, 0.0 * geometry.volume, c, 0.3 * ones, domain.nodes @ gradient.T, 0.05 * ones, True, Ru, Rp
    )  # fmt: skip
    forces = scatter_vector(Ru, geometry.node_cells, len(domain.nodes))
    surface = np.zeros(len(domain.nodes), dtype=bool)
    basis = domain._quadratic
    surface[basis.get_dofs(domain.mesh.boundary_facets()).all()] = True
    return float(np.abs(forces[~surface]).max() / np.abs(forces).max())


# ------------------------------------------------------------------------------------------- laws at extreme χ


def law_error(chi: float) -> float:
    """Largest relative error of ρ, stiffness, permeability and drainage with derivatives, against exact fractions.

    What lies below the smallest number of double precision counts as zero.
    """
    c = constants_of(*settings().parameters())
    exact = _exact_laws(chi, c)
    found = (sigmoid(chi), *stiffness(chi, c), *permeability(chi, c), *drainage(chi, c))
    if not np.isfinite(found).all():
        return np.inf
    tiny = Fraction(float(np.finfo(float).tiny))
    errors = [
        abs(Fraction(float(value)) - true) / abs(true)
        for value, true in zip(found, exact, strict=True)
        if abs(true) > tiny
    ]
    return float(max(errors, default=Fraction(0)))


def _exact_laws(chi: float, c: Constants) -> tuple[Fraction, ...]:
    rho, low = _density(Fraction(chi)), _density(Fraction(chi) + 8)
    penalty, contrast = Fraction(c.ramp_penalty), Fraction(c.stiffness_contrast)
    span, divisor = Fraction(c.solid_permeability) - Fraction(c.void_permeability), 1 + penalty * (1 - rho)
    return (
        rho,
        contrast + (1 - contrast) * rho / divisor,
        (1 - contrast) * (1 + penalty) * rho * (1 - rho) / divisor**2,
        Fraction(c.void_permeability) + span * low,
        span * low * (1 - low),
        Fraction(c.drainage) * rho,
        Fraction(c.drainage) * rho * (1 - rho),
    )


def _density(chi: Fraction) -> Fraction:
    """1 / (1 + exp(-χ)) to 60 digits."""
    power = _exponential(-abs(chi))
    return power / (1 + power) if chi < 0 else 1 / (1 + power)


def _exponential(x: Fraction) -> Fraction:
    """exp(x) to 60 digits, by its series on a small part and squaring."""
    digits, halvings = 10**500, 12
    part = x / 2**halvings
    term = total = Fraction(1)
    for k in range(1, 60):
        term = Fraction(int(term * part / k * digits), digits)
        total += term
    for _ in range(halvings):
        total = Fraction(int(total * total * digits), digits)
    return total


def material_is_finite(objective: ReducedObjective, chi: Floats) -> bool:
    """Whether residual, tangent and design terms are finite at rest under full pressure."""
    equilibrium = objective.equilibrium
    x, p = np.zeros(equilibrium.kinematics.size), np.full(len(chi), objective.load.pressure)
    rx, rp, nodal, _ = equilibrium.residual(chi, x, p)
    tangent = equilibrium.tangent
    tangent.assemble(equilibrium.source, equilibrium.coefficients, chi, x, p, nodal)
    terms = objective.design(chi)
    arrays = (rx, rp, tangent.xx.data, tangent.xp.data, tangent.px.data, tangent.pp.data, terms.gradient, terms.hessian)
    return bool(all(np.isfinite(array).all() for array in arrays)) and bool(np.isfinite(terms.value))


def skewed_trial() -> Trial:
    """The default on a distorted mesh of its own cells."""
    mesh = settings().domain.build()
    assert isinstance(mesh, HalfCylinder)
    domain = Skewed(mesh.radius, mesh.length, mesh.core_cells, mesh.rings, mesh.layers)
    return Trial("skewed cells", f"least angle {smallest_angle(domain):.0f}°", domain=domain)


# --------------------------------------------------------------------------------------------- the path from rest

#: Bounds the time of a path; without limit points five points lead to the full pressure.
MOST_POINTS = 25


@dataclass(frozen=True)
class Followed:
    """A path from zero pressure: points, limit points, the load factor it came to, T at 1, and why it ended early."""

    points: int
    limits: int
    load: float
    arm: Floats | None
    reason: str


def path_from_rest(found: Found) -> Followed:
    """Follow the trial's first design from zero to the full pressure by arc length."""
    objective = found.trial.objective()
    problem = Pressurisation(objective.equilibrium, found.trial.chi(objective.domain))
    control = Control(most_points=MOST_POINTS)
    points: list[Point] = []
    reason = ""
    try:
        first = begin(problem, problem.rest, 0.0, control)
        for point in follow(problem, first, 1.0, control):
            points.append(point)
    except SolveFailure as failure:
        reason = str(failure)
    limits, load = sum(point.limit for point in points), points[-1].load if points else 0.0
    arm = points[-1].z[problem.size - 3 : problem.size] if load == 1.0 else None
    return Followed(len(points) - limits, limits, load, arm, reason)
