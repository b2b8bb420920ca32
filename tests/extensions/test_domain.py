"""A design domain registered from outside the product goes through the whole chain, and is discretised rightly."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml
from command_line import TO_PART, Poro
from jsonschema import Draft202012Validator
from made_up_domain import Box, BoxSettings
from physics import half_cylinder, parameters, wavy

from actuator.arrays import Floats, Ints
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.equations.discretisation import Discretisation
from actuator.solve.equilibrium import Equilibrium
from pipeline.case.model import case_schema, parse_case
from pipeline.exit_codes import ExitCode, Fault
from pipeline.store import contents
from stages import refine
from stages.domains import DOMAINS
from stages.settings import ProblemSettings

HALF = BoxSettings().build()
WHOLE = BoxSettings(whole=True).build()
CASE = """\
domain: {shape: graded-box, whole: WHOLE}
optimizer: {max_updates: 3}
rig: {youngs_modulus: 1.0}
"""


@pytest.fixture
def box() -> Iterator[None]:
    with DOMAINS.registered("graded-box", BoxSettings):
        yield


# ------------------------------------------------------------------------------------------------- the chain


@pytest.mark.parametrize("whole", [pytest.param("false", marks=pytest.mark.slow), "true"])
@pytest.mark.usefixtures("box")
def test_a_domain_of_another_program_goes_through_the_chain(whole: str, tmp_path: Path, poro: Poro) -> None:
    Path("box.yaml").write_text(CASE.replace("WHOLE", whole))
    ended = poro("run", "box.yaml", *TO_PART, "--threads", "1", "--output", ".")
    assert ended.code == ExitCode.OK, ended.err
    part = trimesh.load_mesh("box/box.stl")
    assert part.is_watertight
    assert part.is_winding_consistent
    low, high = part.bounds
    # From end to end, on both sides of X2 = 0, and near the sides of the box but inside it.
    assert (low[0], high[0]) == pytest.approx((0.0, 15.0), abs=1e-5)
    assert high[1] == pytest.approx(-low[1], abs=0.5)
    for depth, side in ((high[1], 12.0), (high[2], 10.0), (-low[2], 10.0)):
        assert 0.75 * side < depth < side
    assert 0.2 < part.volume / (15.0 * 24.0 * 20.0) < 0.8
    steps = json.loads(poro("status", "box.yaml", "--json", "--output", ".").out)["steps"]
    assert [step["runs"] for step in steps] == [*[False] * 5, True]  # all but inflating
    domain, _ = contents.design(Path("box/box.h5"), "optimize")
    assert domain == BoxSettings(whole=whole == "true").build()
    fine, _ = contents.design(Path("box/details/box.refined.h5"), "refine")
    assert fine == domain.refined(2)
    assert "| width W | 24 mm |" in Path("box/box.rig.md").read_text(encoding="utf-8")
    drawn = poro("plot", "box.yaml", "--output", ".")
    assert drawn.code == ExitCode.OK, drawn.err
    assert "not drawn" not in drawn.out


@pytest.mark.usefixtures("box")
def test_the_case_file_says_which_domain() -> None:
    case = parse_case(b"domain: {shape: graded-box, up: 4}", "c.yaml", "c")
    assert case.domain == BoxSettings(up=4)
    assert case.domain.cells == case.domain.build().mesh.nelements == 36
    assert parse_case(b"domain: {radius: 12.0}", "c.yaml", "c").domain.shape == "half-cylinder"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("domain: {shape: boxx}", "domain.shape: 'boxx' is unknown; write one of 'half-cylinder', "),
        ("domain: {shape: graded-box, up: 0}", "domain.up: must be at least 1, not 0"),
        ("domain: {shape: graded-box, heigth: 3.0}", "domain.heigth: unknown key; write 'height' if that was meant"),
        ("domain: {shape: graded-box, rings: 3}", "domain.rings: unknown key"),
        ("domain: {rings: 2.5}", "domain.rings: must be a whole number"),
        ("domain: 3.0", "domain: must be a section of keys (radius, length, core_cells, …), not 3"),
    ],
)
@pytest.mark.usefixtures("box")
def test_mistakes_in_either_domain_are_told_and_refused_by_the_schema(text: str, said: str) -> None:
    with pytest.raises(Fault, match=r"case\.yaml:1: ") as found:
        parse_case(text.encode(), "case.yaml", "case")
    assert said in str(found.value)
    assert list(Draft202012Validator(json.loads(case_schema())).iter_errors(yaml.safe_load(text)))


@pytest.mark.parametrize(
    "text", ["{}", "domain: {radius: 3.0}", "domain: {shape: graded-box}", "domain: {shape: graded-box, up: 1}"]
)
@pytest.mark.usefixtures("box")
def test_the_schema_takes_either_domain(text: str) -> None:
    Draft202012Validator(json.loads(case_schema())).validate(yaml.safe_load(text))


def test_an_artifact_of_a_domain_that_is_not_registered_is_refused(folder: Path, poro: Poro) -> None:
    Path("box.yaml").write_text(CASE.replace("WHOLE", "false"))
    with DOMAINS.registered("graded-box", BoxSettings):
        assert poro("optimize", "box.yaml", "--updates", "0", "--output", ".").code == ExitCode.OK
    ended = poro("refine", "box.h5")
    assert ended.code == ExitCode.ARTIFACT
    assert "box" in ended.err


# ------------------------------------------------------------------------------------------- the discretisation


@pytest.mark.parametrize("domain", [HALF, WHOLE], ids=["half", "whole"])
def test_volume_and_gradients_of_linear_fields(domain: Box) -> None:
    discretisation = Discretisation(domain)
    assert discretisation.volume == pytest.approx(15.0 * 12.0 * 20.0 * (2 if domain.whole else 1), rel=1e-13)
    slope, g = np.array([0.3, -0.7, 1.1]), discretisation.geometry
    at_vertices, at_nodes = domain.points @ slope, domain.nodes @ slope
    gradient = np.einsum("eqai,ea->eqi", g.gradient[g.cell_class], at_vertices[g.cells])
    gradient20 = np.einsum("eqai,ea->eqi", g.gradient20[g.cell_class], at_nodes[g.node_cells])
    assert np.abs(gradient - slope).max() < 1e-12
    assert np.abs(gradient20 - slope).max() < 1e-12
    places = np.einsum("qa,eai->eqi", g.shape, domain.points[g.cells])
    assert np.abs(places - discretisation.quadrature_points[g.cell_class]).max() < 1e-12


@pytest.mark.parametrize("domain", [HALF, WHOLE], ids=["half", "whole"])
def test_boundaries_cover_the_surface_once(domain: Box) -> None:
    parts = (domain.fixed, domain.tip, domain.symmetry, domain.outside)
    np.testing.assert_array_equal(
        np.sort(np.concatenate([part.facets for part in parts])), np.sort(domain.mesh.boundary_facets())
    )
    x1, x2, x3 = domain.nodes.T
    sides = (np.abs(x3) == 10.0) | (np.abs(x2) == 12.0)
    for part, where in zip(parts, (x1 == 0.0, x1 == 15.0, (x2 == 0.0) & domain.mirrored, sides), strict=True):
        np.testing.assert_array_equal(part.nodes, np.flatnonzero(where))
        np.testing.assert_array_equal(part.vertices, part.nodes[part.nodes < domain.mesh.nvertices])
    np.testing.assert_array_equal(
        domain.tip_cells, np.flatnonzero((x1[: domain.mesh.nvertices][domain.cells] == 15.0).any(axis=1))
    )


@pytest.mark.parametrize("domain", [HALF, WHOLE, half_cylinder(2, 2, 2)], ids=["half", "whole", "half cylinder"])
def test_the_outline_goes_once_around_the_fixed_facets(domain: Domain) -> None:
    ring = Domain.outline(domain)
    following = np.roll(ring, -1, axis=0)
    enclosed = 0.5 * float(np.sum(ring[:, 0] * following[:, 1] - following[:, 0] * ring[:, 1]))
    assert enclosed == pytest.approx(Discretisation(domain).volume / domain.length, rel=1e-12)
    assert len(np.unique(ring, axis=0)) == len(ring)


@pytest.mark.parametrize("domain", [HALF, WHOLE, half_cylinder(2, 2, 2)], ids=["half", "whole", "half cylinder"])
def test_tetrahedra_of_any_hexahedra_fill_them_and_share_their_faces(domain: Domain) -> None:
    corners, cells = Domain.tetrahedra(domain)
    sides = domain.points[corners[:, 1:]] - domain.points[corners[:, :1]]
    volumes = np.linalg.det(sides) / 6.0
    assert volumes.min() > 0.0
    if isinstance(domain, Box):
        assert volumes.sum() == pytest.approx(Discretisation(domain).volume, rel=1e-12)
    assert (domain.cells[cells, None] == corners[..., None]).any(axis=2).all()
    faces = np.sort(corners[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    _, count = np.unique(faces, axis=0, return_counts=True)
    assert count.max() == 2
    assert np.count_nonzero(count == 1) == 2 * len(domain.mesh.boundary_facets())


@pytest.mark.parametrize("domain", [HALF, WHOLE], ids=["half", "whole"])
def test_finer_meshes_hold_the_coarse_one(domain: Box) -> None:
    fine, weights = domain.refined(2), domain.prolongation(2)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    # Trilinear in every cell: exact for linear fields, and for the middle of a row of equal cells.
    np.testing.assert_allclose(weights @ domain.points, fine.points, atol=1e-9)
    chi = np.random.default_rng(0).normal(size=domain.mesh.nvertices)
    assert refine.run(domain, chi, refine.Settings(filter_radius=0.0)).chi == pytest.approx(weights @ chi, abs=1e-15)


class EveryCellItsOwn(HalfCylinder):
    """A half cylinder of which nobody said that its layers are alike."""

    @property
    def representatives(self) -> Ints:
        return Domain.representatives.fget(self)

    @property
    def cell_class(self) -> Ints:
        return Domain.cell_class.fget(self)


def test_a_half_cylinder_with_every_cell_its_own_class_has_the_same_equations() -> None:
    swept = half_cylinder(3, 2, 3)
    domains = swept, EveryCellItsOwn(swept.radius, swept.length, swept.core_cells, swept.rings, swept.layers)
    equilibria = [Equilibrium(domain, *parameters(), threads=1) for domain in domains]
    assert [len(each.geometry.volume) for each in equilibria] == [swept.section_cells, 3 * swept.section_cells]
    chi = swept.initial_design(swept.points, 3.0)
    u, p = wavy(swept.nodes, 0.2, 1), 0.03 * np.cos(swept.points[:, 0])
    x = equilibria[0].kinematics.reduced(u, np.array([0.1, -0.2, 0.05]))
    found = []
    for each in equilibria:
        rx, rp, nodal, lowest = each.residual(chi, x, p)
        each.tangent.assemble(each.source, each.coefficients, chi, x, p, nodal)
        blocks = (getattr(each.tangent, name).data for name in ("xx", "xp", "px", "pp"))
        found.append([rx, rp, nodal, np.array(lowest), *blocks])
    for one, other in zip(*found, strict=True):
        assert np.abs(one - other).max() <= 1e-11 * np.abs(one).max()
    assert equilibria[0].discretisation.volume == pytest.approx(equilibria[1].discretisation.volume, rel=1e-13)


@pytest.mark.usefixtures("box")
def test_half_and_whole_of_a_box_move_alike() -> None:
    states = []
    for whole in (False, True):
        settings = ProblemSettings(domain=BoxSettings(whole=whole))
        domain = settings.domain.build()
        equilibrium = Equilibrium(domain, *settings.parameters(), threads=1)
        states.append(equilibrium.solve(domain.initial_design(domain.points, 3.0)))
    half, both = states
    assert np.abs(half.arm).max() > 1e-2
    assert both.arm == pytest.approx(half.arm, rel=1e-6)
    assert_same_pressure(half.p, both.p)


def assert_same_pressure(half: Floats, both: Floats) -> None:
    upper = WHOLE.points[:, 1] >= 0.0
    np.testing.assert_array_equal(WHOLE.points[upper], HALF.points)
    assert both[upper] == pytest.approx(half, abs=1e-7 * half.max())
