"""What the regression guard measures of fields and shapes whose answer is known in closed form."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.equations.assembly import scatter_vector
from actuator.equations.discretisation import Discretisation
from actuator.equations.helmholtz import helmholtz_filter
from actuator.equations.kernels import residual
from actuator.material.constants import constants_of
from benchmarks.figures import Figure, error
from benchmarks.small_cases import SMALL, problem
from stages import export, mirror

#: Sphere off the ends and tube from end to end, both across the symmetry plane; mm.
SPHERE_CENTRE, SPHERE_RADIUS = np.array([7.3, 0.0, 1.0]), 5.0
TUBE_RADII = (6.0, 11.0)
#: Deformation gradient of the patch test, with stretch, shear and rotation, and its fields χ and p.
STRETCH = np.array([[1.20, 0.10, -0.05], [-0.15, 0.95, 0.20], [0.08, -0.12, 0.98]])
PATCH_DESIGN, PATCH_PRESSURE = 0.3, 0.055
#: Rounding that a sum of some thousand terms may leave.
ROUNDING = 1e-12


def patch_figures() -> Iterator[Figure]:
    """A homogeneous deformation leaves no force inside, on cells that are not affine."""
    settings = problem(SMALL)
    domain = settings.domain.build()
    discretisation, n_cells = Discretisation(domain), domain.mesh.nelements
    Ru, Rp = np.empty((n_cells, 20, 3)), np.empty((n_cells, 8))
    ones, u = np.ones(domain.mesh.nvertices), domain.nodes @ (STRETCH - np.eye(3)).T
    residual(
        discretisation.geometry,
        np.zeros_like(discretisation.geometry.volume),
        constants_of(*settings.parameters()),
        PATCH_DESIGN * ones,
        u,
        PATCH_PRESSURE * ones,
        True,
        Ru,
        Rp,
    )
    forces = scatter_vector(Ru, domain.node_cells, len(domain.nodes))
    x, r = domain.nodes[:, 0], np.hypot(domain.nodes[:, 1], domain.nodes[:, 2])
    # Midpoints of edges on the wall lie on chords; nodes inside are further away from it than those.
    inside = (x > 0.0) & (x < domain.length) & (domain.nodes[:, 1] > 0.0) & (r < 0.9 * domain.size)
    left = float(np.abs(forces[inside]).max() / np.abs(forces).max())
    yield error("patch test: forces inside", left, rounding=ROUNDING)


def filter_figures() -> Iterator[Figure]:
    """cos(π X1 / L) is an eigenfunction of the Helmholtz filter."""
    domain = problem((3, 2, 16)).domain.build()
    wave, radius = np.pi / domain.length, 1.0
    field = np.cos(wave * domain.points[:, 0])
    found = helmholtz_filter(domain.mesh, field, radius)
    exact = field / (1.0 + (radius * wave) ** 2)
    yield error("Helmholtz filter of a wave", float(np.abs(found - exact).max()))


def export_figures() -> Iterator[Figure]:
    """Bodies of known shape, mirrored, written and read back."""
    inner, outer = TUBE_RADII
    domain = HalfCylinder(15.0, 15.0, 6, 3, 9)
    bodies: dict[str, tuple[Callable[[Floats], Floats], float]] = {
        "sphere": (_sphere, 4.0 / 3.0 * np.pi * SPHERE_RADIUS**3),
        "tube": (_tube, np.pi * (outer**2 - inner**2) * domain.length),
    }
    for name, (field, volume) in bodies.items():
        solid = mirror.run(domain, field(domain.points), mirror.Settings())
        part = export.run(solid.vertices, solid.triangles, export.Settings())
        off = np.abs(field(part.vertices))
        if name == "tube":  # the ends are flat
            off = off[(part.vertices[:, 0] > 0.0) & (part.vertices[:, 0] < domain.length)]
        yield error(f"{name} exported: volume", abs(part.volume - volume) / volume)
        yield error(f"{name} exported: distance of its vertices", float(off.max()), "mm")
        yield error(f"{name} exported: Hausdorff distance to the field", solid.distance.maximum, "mm")
        yield error(f"{name} exported: failed checks", float(not part.passed), "checks", rounding=0.5)


def _sphere(x: Floats) -> Floats:
    """Distance to the sphere, positive inside, mm."""
    return SPHERE_RADIUS - np.linalg.norm(x - SPHERE_CENTRE, axis=1)


def _tube(x: Floats) -> Floats:
    """Distance to the nearer wall of the tube, positive inside, mm."""
    r = np.hypot(x[:, 1], x[:, 2])
    return np.minimum(r - TUBE_RADII[0], TUBE_RADII[1] - r)
