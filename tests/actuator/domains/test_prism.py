"""Prisms and boxes: right-handed cells fill their sections without gaps, whatever the wall."""

from __future__ import annotations

import numpy as np
import pytest

from actuator.domains import outline
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.domains.prism import Box, Prism
from actuator.equations.discretisation import Discretisation
from actuator.solve.equilibrium import Equilibrium
from stages.domains import BoxSettings, DomainSettings, PrismSettings
from stages.settings import ProblemSettings

MESH = {"length": 20.0, "across": 3, "up": 4, "rings": 2, "layers": 2, "refinement": 1}
TRAPEZIUM = [[0.0, -8.0], [14.0, -8.0], [8.0, 9.0], [0.0, 9.0]]
TRIANGLE = [[0.0, -8.0], [14.0, -8.0], [0.0, 14.0]]
STAR = [[0.0, -12.0], [5.0, -8.0], [12.0, -6.0], [9.0, 0.0], [12.0, 6.0], [5.0, 8.0], [0.0, 12.0]]
SLENDER = Box(**MESH, whole=True, width=10.0, height=40.0, edge=2.0)
DOMAINS = {
    "sharp box": Box(**MESH, whole=False, width=16.0, height=20.0, edge=0.0),
    "slender box": SLENDER,
    "trapezium": Prism(**MESH, whole=True, profile=TRAPEZIUM, inlet_height=0.0),
    "triangle": Prism(**MESH, whole=False, profile=TRIANGLE, inlet_height=-2.0),
    "star": Prism(**MESH, whole=False, profile=STAR, inlet_height=0.0),
}


def enclosed(ring: np.ndarray) -> float:
    following = np.roll(ring, -1, axis=0)
    return 0.5 * float(np.sum(ring[:, 0] * following[:, 1] - following[:, 0] * ring[:, 1]))


@pytest.mark.parametrize("domain", DOMAINS.values(), ids=DOMAINS)
def test_cells_fill_the_wall_and_boundaries_lie_where_they_should(domain: Box | Prism) -> None:
    volume = Discretisation(domain).volume
    # Corners are vertices: where nothing is round the section is met to rounding.
    assert volume == pytest.approx(20.0 * enclosed(domain.outline()), rel=2e-2 if domain is SLENDER else 1e-12)
    assert domain.mesh.mapping().detDF(np.array([[0.0, 1.0]] * 3)).min() > 0.0
    off = outline.distance(domain.wall, domain.points[domain.outside.vertices, 1:])
    assert off.max() < 1e-12 * domain.size
    halves = 2 if domain.whole else 1
    assert len(domain.outside.facets) == halves * 2 * (3 + 4) * 2
    assert len(domain.symmetry.facets) == (0 if domain.whole else (2 * 4 + 2 * 2) * 2)
    assert domain.mesh.nelements == halves * 2 * (3 * 4 + 7 * 2) * 2


@pytest.mark.parametrize("domain", DOMAINS.values(), ids=DOMAINS)
def test_finer_meshes_hold_the_coarse_one(domain: Box | Prism) -> None:
    fine, weights = domain.refined(2), domain.prolongation(2)
    finest = fine.refined(2)
    for coarse, finer in ((domain, fine), (fine, finest)):
        there = {tuple(place) for place in finer.points.round(9).tolist()}
        assert all(tuple(place) in there for place in coarse.points.round(9).tolist())
    assert finest == domain.refined(4)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(weights @ domain.points[:, 0], fine.points[:, 0], atol=1e-12)


def test_a_many_sided_profile_is_the_cylinder() -> None:
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 721)
    circle = 15.0 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    circle[[0, -1], 0] = 0.0
    prism = Prism(**(MESH | {"length": 15.0}), whole=False, profile=circle, inlet_height=0.0)
    cylinder = HalfCylinder(15.0, 15.0, 3, 2, 2)
    places = prism.nodes
    for name in ("passive_bound", "initial_design"):
        ours, theirs = (getattr(domain, name)(places, 3.0) for domain in (prism, cylinder))
        assert np.abs(ours - theirs).max() < 2e-3
    assert prism.inlet(places) == pytest.approx(cylinder.inlet(places), abs=1e-4)


@pytest.mark.parametrize(
    ("domain", "sizes"),
    [
        (BoxSettings(length=24.0, width=16.0, across=2, up=2, rings=2, layers=3), (2.0, 10.0)),
        (PrismSettings(length=20.0, profile=TRAPEZIUM, across=2, up=2, rings=2, layers=3), (2.0, 8.5)),
    ],
    ids=["box", "prism"],
)
def test_half_whole_and_similar_ones_move_alike(domain: DomainSettings, sizes: tuple[float, float]) -> None:
    scale, size = sizes
    whole = domain.model_copy(update={"whole": True})
    assert (domain.size, whole.cells) == (size, 2 * domain.cells)
    moves = []
    for each in (domain, whole, domain.in_units(scale, 1.0)):
        built = each.build()
        assert built.size == each.size
        assert built.mesh.nelements == each.cells
        moves.append(moved(built, each, 3.0 * each.size / size))
    assert moves[0].max() > 1e-2
    assert moves[1] == pytest.approx(moves[0], rel=1e-6)
    assert scale * moves[2] == pytest.approx(moves[0], rel=1e-6)


def moved(domain: Domain, settings: DomainSettings, width: float) -> np.ndarray:
    """How far the tip's face moves at most along X1 and X3, (2,), mm, in the initial design."""
    problem = ProblemSettings(domain=settings)
    limits = problem.objective.model_copy(update={"interface_width": width, "length_unit": width / 3.0})
    problem = problem.model_copy(update={"objective": limits})
    equilibrium = Equilibrium(domain, *problem.parameters(), threads=1)
    state = equilibrium.solve(domain.initial_design(domain.points, width, width / 3.0))
    return np.abs(state.displacement[domain.tip.vertices]).max(axis=0)[[0, 2]]
