"""Checks of the element loops with a law, compiled or, as ``python -m law_loops`` without a compiler, in plain Python.

The loops are the same text in both. To compile them for a law takes more than a minute; some cells in Python do not.
"""

from __future__ import annotations

import dataclasses
import sys

import numpy as np
import pytest
from physics import (
    Floats,
    assembled,
    displacement_dofs,
    element_tangents,
    half_cylinder,
    nodal_residuals,
    parameters,
    wavy,
)

from actuator.domains.interface import Domain
from actuator.equations.assembly import scatter_vector
from actuator.equations.discretisation import Discretisation
from actuator.material.constants import Constants, constants_of
from actuator.material.laws.mooney_rivlin import MooneyRivlin
from actuator.material.laws.ogden import Ogden
from actuator.material.laws.yeoh import Yeoh
from actuator.parameters import Law
from actuator.terms.lagrangian import lagrangian_gradient
from actuator.terms.strain_energy import strain_energy_excess

LAWS: dict[str, Law] = {
    "ogden": Ogden.of([0.7, 0.2, 0.1], [1.3, 5.0, -2.0]),
    "mooney-rivlin": MooneyRivlin(0.13),
    "yeoh": Yeoh(-0.02, 0.4),
}
TINY = 1e-40


def coefficients(law: Law, **changes: float) -> Constants:
    material, load, objective = parameters()
    return constants_of(dataclasses.replace(material, law=law), load, objective)._replace(**changes)


def fields(domain: Domain) -> tuple[Floats, Floats, Floats]:
    rng, n = np.random.default_rng(1), domain.mesh.nvertices
    return 3.0 * rng.normal(size=n), wavy(domain.nodes, 0.5, 3), 0.05 * rng.uniform(size=n)


def check_tangent(law: Law, domain: Domain) -> None:
    """It is the derivative of the residual."""
    discretisation = Discretisation(domain)
    geometry, c = discretisation.geometry, coefficients(law)
    chi, u, p = fields(domain)
    source = discretisation.source(c.drainage)
    blocks = element_tangents(geometry, source, c, chi, u, p)[0]
    assert np.abs(blocks - blocks.transpose(0, 2, 1)).max() < 1e-13 * np.abs(blocks).max()
    dofs, d = displacement_dofs(geometry), wavy(domain.nodes, 1.0, 5)
    forces, _ = nodal_residuals(geometry, source, c, chi, u + 1j * TINY * d, p)
    found = assembled(blocks, dofs, dofs, (u.size, u.size)) @ d.ravel()
    assert np.abs(found - forces.imag.ravel() / TINY).max() < 1e-13 * np.abs(found).max()


def check_lagrangian_gradient(law: Law, domain: Domain) -> None:
    """First derivatives against values of Λ·R + C_Ψ, and second, by complex step, against first."""
    discretisation = Discretisation(domain)
    geometry, c = discretisation.geometry, coefficients(law, energy_limit=1e-3, strain_energy_weight=1e-6)
    source = discretisation.source(c.drainage)
    chi, u, p = fields(domain)
    adjoint, flow = wavy(domain.nodes, 1.0, 8), np.random.default_rng(4).normal(size=p.shape)
    d_chi, d_u = np.random.default_rng(5).normal(size=chi.shape), wavy(domain.nodes, 0.7, 6)

    def value(h: float) -> float:
        forces, flows = nodal_residuals(geometry, source, c, chi + h * d_chi, u + h * d_u, p)
        excess, ratio = strain_energy_excess(geometry, c, chi + h * d_chi, u + h * d_u)
        assert ratio > 1.0
        return float(np.sum(adjoint * forces) + flow @ flows + excess)

    def gradient(h: complex) -> tuple[Floats, Floats]:
        kind = np.result_type(h, float)
        n = len(geometry.cells)
        out = np.empty((n, 8), kind), np.empty((n, 20, 3), kind), np.empty((n, 8), kind)
        at = (chi + h * d_chi, u + h * d_u, p.astype(kind), adjoint.astype(kind), flow.astype(kind))
        lagrangian_gradient(geometry, source, c, *at, 1.0, True, *out)
        return scatter_vector(out[0], geometry.cells, len(chi)), scatter_vector(out[1], geometry.node_cells, len(u))

    h = 1e-5
    of_chi, of_u = gradient(0.0)
    central = (value(h) - value(-h)) / (2.0 * h)
    assert np.sum(of_chi * d_chi) + np.sum(of_u * d_u) == pytest.approx(central, rel=1e-7)
    for exact, ahead, behind in zip(gradient(1j * TINY), gradient(h), gradient(-h), strict=True):
        second = (ahead - behind) / (2.0 * h)
        assert np.abs(exact.imag / TINY - second).max() < 1e-7 * np.abs(second).max()


if __name__ == "__main__":
    for name, each in LAWS.items():
        check_tangent(each, half_cylinder(1, 1, 1))
        check_lagrangian_gradient(each, half_cylinder(1, 1, 1))
        sys.stdout.write(f"{name}\n")
