"""Shells and tubes at large strain against the closed forms of the incompressible neo-Hookean material.

A wall that keeps its volume moves with one unknown, the stretch a of its inner surface, and equilibrium in its
thickness is an integral over the stretch: Green & Zerna, Theoretical Elasticity, sections 3.9 and 3.10 (1968).
"""

from __future__ import annotations

import numpy as np
import pytest
from bodies import PRECISE, inflated, inflation, material, mirrored, octant, sector
from scipy.optimize import minimize_scalar

from actuator.arrays import Floats
from actuator.solve.path import begin, follow

#: Inner and outer radius, mm; stretch of the inner surface; a nearly incompressible material.
RADII, STRETCH, STUFF = (1.0, 2.0), 1.5, material(0.4999)


def pressure_in_sphere(a: float) -> float:
    """Over G."""
    b = (1.0 + (RADII[0] / RADII[1]) ** 3 * (a**3 - 1.0)) ** (1.0 / 3.0)
    return 2.0 * (1.0 / b + 0.25 / b**4) - 2.0 * (1.0 / a + 0.25 / a**4)


def pressure_in_tube(a: float) -> float:
    """Over G, with the ends of the tube held apart."""
    b = (1.0 + (RADII[0] / RADII[1]) ** 2 * (a**2 - 1.0)) ** 0.5
    return float(np.log(a / b) + 0.5 / b**2 - 0.5 / a**2)


def sphere(cells: int):
    return mirrored(*octant(np.linspace(*RADII, cells + 1), cells), [(0, 0.0), (1, 0.0), (2, 0.0)], slice(0, 3))


def tube(cells: int):
    quarter = sector(0.5 * np.pi, np.linspace(*RADII, cells + 1), 0.5, 2 * cells, 1)
    return mirrored(*quarter, [(0, 0.0), (0, 0.5), (1, 0.0), (2, 0.0)], slice(1, 3))


def errors_of(mesh, pressure: float, components: slice) -> tuple[Floats, float]:
    """Relative errors of the inner vertices' stretch, and of that which the volume of the chamber tells."""
    problem = inflation(mesh, STUFF, pressure=pressure * STUFF.shear)
    assert problem.mixed
    point = inflated(problem)
    state = problem.state(point.z, point.load)
    inner = np.unique(mesh.walls[:, :3])
    inner = inner[np.abs(np.linalg.norm(mesh.nodes[inner, components], axis=1) - RADII[0]) < 1e-12]
    moved = mesh.nodes[inner] + state.displacement[inner]
    grown = state.volume / problem.state(problem.rest, 0.0).volume
    power = 1.0 / len(moved[0, components])
    return np.linalg.norm(moved[:, components], axis=1) / STRETCH - 1.0, grown**power / STRETCH - 1.0


@pytest.mark.parametrize(
    ("mesh", "pressure", "components", "bounds"),
    [
        (sphere, pressure_in_sphere, slice(0, 3), {3: (0.01, 0.003), 6: (0.0025, 3e-4)}),
        (tube, pressure_in_tube, slice(1, 3), {2: (0.003, 6e-4), 4: (6e-4, 6e-5)}),
    ],
    ids=["sphere", "tube"],
)
def test_the_inner_surface_moves_as_the_closed_form_says(mesh, pressure, components, bounds) -> None:
    """The error falls with the square of the cells' size at least."""
    found = {cells: errors_of(mesh(cells), pressure(STRETCH), components) for cells in bounds}
    for cells, (most, most_of_volume) in bounds.items():
        stretch, volume = found[cells]
        assert np.abs(stretch).max() < most
        assert abs(volume) < most_of_volume
    coarse, fine = (np.abs(stretch).max() for stretch, _ in found.values())
    assert coarse / fine > 4.0


def test_the_sphere_snaps_at_the_largest_pressure_of_the_closed_form() -> None:
    """Past a stretch of about 2 the pressure falls; the path finds the limit point."""
    top = minimize_scalar(lambda a: -pressure_in_sphere(a), bounds=(1.2, 4.0), method="bounded")
    problem = inflation(sphere(4), STUFF, pressure=STUFF.shear)
    here = begin(problem, problem.rest, 0.0, PRECISE)
    point = next(p for p in follow(problem, here, 1.0, PRECISE) if p.limit)
    volume = problem.state(point.z, point.load).volume / problem.state(problem.rest, 0.0).volume
    assert point.load == pytest.approx(-top.fun, rel=0.01)
    assert volume ** (1.0 / 3.0) == pytest.approx(top.x, rel=0.02)
