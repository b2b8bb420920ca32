"""Other laws than neo-Hooke's in the element loops, the state and the gradient; compiled, they are slow."""

from __future__ import annotations

import dataclasses
import subprocess
import sys

import law_loops
import numpy as np
import pytest
from command_line import environment
from exact_product import hessian_product
from physics import IDENTITY, Floats, boundary_nodes, half_cylinder, no_source, nodal_residuals, parameters
from scipy.optimize import brentq

from actuator.compilation import compile_kernels
from actuator.equations.discretisation import Discretisation
from actuator.material.constants import constants_of
from actuator.material.laws import neo_hooke
from actuator.material.laws.mooney_rivlin import MooneyRivlin
from actuator.material.laws.ogden import Ogden
from actuator.material.laws.yeoh import Yeoh
from actuator.parameters import Law
from actuator.solve.reduced import ReducedObjective

#: Members of each family that are neo-Hooke's law.
REDUCED: dict[str, Law] = {"ogden": Ogden.of([1.0], [2.0]), "mooney-rivlin": MooneyRivlin(0.0), "yeoh": Yeoh(0.0, 0.0)}
DOMAIN = half_cylinder(2, 1, 3)


def compiled(laws: dict[str, Law]) -> pytest.MarkDecorator:
    """For each law, with its kernels compiled: more than a minute for every one."""
    params = [pytest.param(law, id=name, marks=pytest.mark.slow) for name, law in laws.items()]
    return pytest.mark.parametrize("law", params, indirect=True)


@pytest.fixture
def law(request: pytest.FixtureRequest) -> Law:
    """The law, after its kernels have been compiled as a user's run does."""
    compile_kernels(request.param)
    found: Law = request.param
    return found


def test_loops_of_every_law_in_plain_python() -> None:
    """What is compiled is the same text; test_laws has the laws themselves compiled."""
    plain = environment() | {"NUMBA_DISABLE_JIT": "1"}
    ended = subprocess.run(
        [sys.executable, "-m", law_loops.__name__], env=plain, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.split() == list(law_loops.LAWS)


def objective_of(law: Law, tolerance: float = 1e-8, **changes: float) -> ReducedObjective:
    """The small problem with another law."""
    material, load, objective = parameters(**changes)
    return ReducedObjective(
        DOMAIN,
        dataclasses.replace(material, law=law),
        load,
        objective,
        state_tolerance=tolerance,
        adjoint_tolerance=10.0 * tolerance,
        threads=1,
    )


@compiled(law_loops.LAWS)
def test_tangent_is_the_derivative_of_the_residual(law: Law) -> None:
    law_loops.check_tangent(law, DOMAIN)


@compiled(law_loops.LAWS)
def test_lagrangian_gradient_and_its_complex_step(law: Law) -> None:
    law_loops.check_lagrangian_gradient(law, DOMAIN)


@compiled(REDUCED)
def test_state_of_an_actuator_reduces_to_neo_hooke(law: Law) -> None:
    chi = DOMAIN.initial_design(DOMAIN.points, 3.0)
    found, due = (objective_of(each, 1e-11).evaluate(chi) for each in (law, neo_hooke.EXAMPLE))
    assert np.abs(due.state.displacement).max() > 0.05
    assert found.state.displacement == pytest.approx(due.state.displacement, rel=1e-9, abs=1e-10)
    assert found.value == pytest.approx(due.value, rel=1e-9)


@compiled(law_loops.LAWS)
def test_patch_in_uniaxial_tension(law: Law) -> None:
    """A solid, nearly incompressible body under a homogeneous stretch: no force inside, the closed form at its end."""
    material, load, objective = parameters(material={"poisson_ratio": 0.499999})
    c = constants_of(dataclasses.replace(material, law=law), load, objective)._replace(hessian_penalty=0.0)
    discretisation = Discretisation(DOMAIN)
    geometry, stretch = discretisation.geometry, 1.6
    solid, empty = np.full(DOMAIN.mesh.nvertices, 800.0), np.zeros(DOMAIN.mesh.nvertices)
    inside = ~boundary_nodes(DOMAIN)
    end = DOMAIN.nodes[:, 0] > DOMAIN.nodes[:, 0].max() - 1e-9

    def forces(lateral: float) -> Floats:
        F = np.diag([stretch, lateral, lateral])
        u = DOMAIN.nodes @ (F - IDENTITY)
        return nodal_residuals(geometry, no_source(discretisation), c, solid, u, empty)[0]

    def side(lateral: float) -> float:
        """Lateral stress through the virial of all forces."""
        return float(np.sum(forces(lateral)[:, 2] * DOMAIN.nodes[:, 2]))

    lateral = brentq(side, 0.95 * stretch**-0.5, 1.05 * stretch**-0.5, xtol=1e-15)
    found = forces(lateral)
    area = discretisation.volume / DOMAIN.length
    assert np.abs(found[inside]).max() < 1e-8 * np.abs(found).max()  # rounding of a bulk modulus of 5e5 G
    x = stretch**2 + 2.0 / stretch - 3.0
    slope = stretch - stretch**-2
    if isinstance(law, Ogden):
        closed = sum(2.0 * mu / a * (stretch ** (a - 1.0) - stretch ** (-a / 2.0 - 1.0)) for mu, a in law.terms)
    elif isinstance(law, Yeoh):
        closed = 2.0 * slope * (0.5 + 2.0 * law.c2 * x + 3.0 * law.c3 * x**2)
    else:
        closed = 2.0 * slope * (0.5 - law.c01 + law.c01 / stretch)
    assert found[end, 0].sum() / area == pytest.approx(c.shear * closed, rel=2e-5)


@compiled(law_loops.LAWS)
def test_gradient_and_hessian_of_the_converged_objective(law: Law) -> None:
    """Against central differences of states solved anew, with every term of the objective at work."""
    objective = objective_of(law, 1e-12, strain_limit=0.04)
    chi = DOMAIN.initial_design(DOMAIN.points, 3.0)
    d = np.cos(DOMAIN.points @ [0.25, -0.4, 0.3])
    start = objective.evaluate(chi)
    assert start.measures["energy_ratio"] > 1.0
    gradient = objective.gradient(start)
    product = hessian_product(objective, start, gradient, d, 1e-11).hessian
    h = 1e-4
    ahead, behind = (objective.evaluate(chi + s * d, (start.state.x, start.state.p)) for s in (h, -h))
    assert (ahead.value - behind.value) / (2.0 * h) == pytest.approx(gradient.total @ d, rel=1e-6)
    change = (objective.gradient(ahead).total - objective.gradient(behind).total) / (2.0 * h)
    # C_χ has kinks in its second derivative where a vertex enters the passive core.
    assert np.abs(change - product).max() < 1e-5 * np.abs(product).max()
