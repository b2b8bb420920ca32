"""Stage mirror: a closed 2-manifold for any field, with the right volume, exactly symmetric."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold
from scipy.integrate import quad

from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.failure import EmptySolid, InvalidField
from actuator.geometry.outer_triangles import outer_triangles
from actuator.geometry.solid import is_two_manifold, rounded
from actuator.geometry.zero_set import solid_boundary
from stages import mirror

RADIUS, LENGTH = 15.0, 12.0
DOMAIN = HalfCylinder(RADIUS, LENGTH, 3, 2, 4)


def faceted_volume(domain: HalfCylinder) -> float:
    wedges = 8 * domain.core_cells
    return 0.5 * wedges * domain.radius**2 * np.sin(2.0 * np.pi / wedges) * domain.length


def solid(domain: HalfCylinder, chi: Floats, threshold: float = 0.0) -> trimesh.Trimesh:
    """The stage's surface, after checking everything that must hold for any field."""
    result = mirror.run(domain, chi, mirror.Settings(threshold=threshold))
    assert is_two_manifold(result.triangles)
    # Vertices stay apart, also when an STL file rounds them.
    assert len(rounded(result.vertices, result.triangles).vertices) == len(result.vertices)
    assert np.unique(result.triangles).size == len(result.vertices)
    assert_symmetric(result)
    mesh = trimesh.Trimesh(result.vertices, result.triangles, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert 0.0 < mesh.volume < faceted_volume(domain) * (1.0 + 1e-12)
    return mesh


def assert_symmetric(result: mirror.Result) -> None:
    image = result.vertices * (1.0, -1.0, 1.0) + 0.0
    np.testing.assert_array_equal(np.unique(image, axis=0), np.unique(result.vertices, axis=0))
    x2 = result.vertices[:, 1]
    assert np.count_nonzero(x2 == 0.0) == result.plane_vertices
    assert not (x2[result.triangles] == 0.0).all(axis=1).any()  # no face is left inside, on the plane
    assert np.all(x2[result.triangles[: result.half_triangles]] >= 0.0)


def tube(x: Floats) -> Floats:
    r = np.hypot(x[:, 1], x[:, 2])
    return np.minimum(r - 7.0, 12.0 - r) / 3.0


def test_tetrahedra_fill_the_cells_and_share_their_faces() -> None:
    tets = DOMAIN.tetrahedra().corners
    assert len(tets) == 6 * DOMAIN.mesh.nelements
    corner = DOMAIN.points[tets]
    volume = np.linalg.det(corner[:, 1:] - corner[:, :1]) / 6.0
    assert volume.min() > 0.0
    assert volume.sum() == pytest.approx(0.5 * faceted_volume(DOMAIN), rel=1e-12)
    faces = np.sort(tets[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    unique, count = np.unique(faces, axis=0, return_counts=True)
    assert count.max() == 2
    boundary = unique[count == 1]
    off_plane = boundary[(DOMAIN.points[boundary, 1] != 0.0).any(axis=1)]
    outer = np.unique(np.sort(outer_triangles(DOMAIN, tets), axis=1), axis=0)
    np.testing.assert_array_equal(outer, off_plane)


@pytest.mark.parametrize("sizes", [(1, 1, 1), (3, 2, 4), (2, 5, 1)])
def test_all_solid_is_the_whole_cylinder(sizes: tuple[int, int, int]) -> None:
    domain = HalfCylinder(RADIUS, LENGTH, *sizes)
    mesh = solid(domain, np.ones(domain.mesh.nvertices))
    assert mesh.volume == pytest.approx(faceted_volume(domain), rel=1e-12)
    assert mesh.euler_number == 2


@settings(max_examples=25, deadline=None)
@given(
    sizes=st.tuples(st.integers(1, 3), st.integers(1, 3), st.integers(1, 4)),
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(["noise", "smooth", "steps", "specks", "touching"]),
)
def test_any_field_gives_a_closed_manifold(sizes: tuple[int, int, int], seed: int, kind: str) -> None:
    domain = HalfCylinder(RADIUS, LENGTH, *sizes)
    rng = np.random.default_rng(seed)
    x, n = domain.points, domain.mesh.nvertices
    noise = rng.normal(size=n)
    waves = np.cos(x @ rng.normal(scale=0.3, size=(3, 4)) + rng.uniform(0.0, 6.0, 4)) @ rng.normal(size=4)
    chi = {
        "noise": noise,
        "smooth": waves,
        "steps": np.round(noise),  # many values exactly at the threshold
        "specks": np.where(noise > 1.5, 1e-14, -1.0),
        "touching": np.where(np.abs(waves) < 0.5, 0.0, waves),
    }[kind]
    chi[rng.integers(n)] = 0.5
    solid(domain, chi)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), threshold=st.integers(-500, 500).map(lambda n: n / 1000))
def test_solid_and_void_fill_the_cylinder(seed: int, threshold: float) -> None:
    chi = np.random.default_rng(seed).normal(size=DOMAIN.mesh.nvertices)
    both = solid(DOMAIN, chi, threshold).volume + solid(DOMAIN, -chi, -threshold).volume
    assert both == pytest.approx(faceted_volume(DOMAIN), rel=1e-10)


@pytest.mark.parametrize("where", ["symmetry plane", "wall", "ends", "axis", "everywhere but one", "alternating"])
def test_zeros_at_nodes(where: str) -> None:
    x, n = DOMAIN.points, DOMAIN.mesh.nvertices
    chi = np.random.default_rng(0).normal(size=n)
    chi[DOMAIN.section_points + 5] = 1.0
    layer = np.arange(n) // DOMAIN.section_points
    zero = {
        "symmetry plane": x[:, 1] == 0.0,
        "wall": np.isin(np.arange(n), DOMAIN.outside.vertices),
        "ends": (x[:, 0] == 0.0) | (x[:, 0] == LENGTH),
        "axis": np.hypot(x[:, 1], x[:, 2]) < 1e-9,
        "everywhere but one": np.arange(n) != DOMAIN.section_points + 5,
        "alternating": (np.arange(n) + layer) % 2 == 0,
    }[where]
    chi[zero] = 0.0
    solid(DOMAIN, chi)


@pytest.mark.parametrize("part", ["symmetry plane", "wall", "ends"])
def test_solid_at_nodes_of_the_boundary_only(part: str) -> None:
    x, n = DOMAIN.points, DOMAIN.mesh.nvertices
    where = {
        "symmetry plane": x[:, 1] == 0.0,
        "wall": np.isin(np.arange(n), DOMAIN.outside.vertices),
        "ends": (x[:, 0] == 0.0) | (x[:, 0] == LENGTH),
    }[part]
    bodies = {"symmetry plane": 1, "wall": 1, "ends": 2}[part]
    mesh = solid(DOMAIN, np.where(where, 1.0, -1.0))
    assert mesh.body_count == bodies


@pytest.mark.parametrize(
    ("normal", "offset"), [((1.0, 0.0, 0.0), 5.1), ((0.3, 0.0, 1.0), -2.0), ((-1.0, 0.0, 0.2), -7.7)]
)
def test_planes_cut_the_faceted_cylinder_exactly(normal: tuple[float, float, float], offset: float) -> None:
    """Linear fields are exact in tetrahedra, so manifold3d's own cut of the same prism gives the same volume."""
    wall = DOMAIN.points[DOMAIN.outside.vertices]
    prism = Manifold.hull_points(np.concatenate([wall, wall * (1.0, -1.0, 1.0)]))
    length = np.linalg.norm(normal)
    expected = prism.trim_by_plane(tuple(np.array(normal) / length), offset / length)
    mesh = solid(DOMAIN, DOMAIN.points @ normal - offset)
    assert mesh.volume == pytest.approx(expected.volume(), rel=1e-9)
    assert mesh.area == pytest.approx(expected.surface_area(), rel=1e-6)


def sphere(x: Floats) -> Floats:
    return 5.0 - np.linalg.norm(x - (6.3, 0.0, 1.0), axis=1)


def torus(x: Floats) -> Floats:
    return 3.0 - np.hypot(np.hypot(x[:, 1], x[:, 2]) - 9.0, x[:, 0] - 6.3)


def open_tube(x: Floats) -> Floats:
    r = np.hypot(x[:, 1], x[:, 2])
    return (r - 6.0) * (11.0 - r)


def slanted(x: Floats) -> Floats:
    return height(x[:, 0]) - x[:, 2]


def height(x1: Floats | float) -> Floats | float:
    """Of the plane that cuts both ends."""
    return 4.0 - 0.9 * x1


def below_the_plane() -> tuple[float, float]:
    """Volume and area of the cylinder below the plane: segments of a circle, their arcs and chords along X1."""

    def along(of_section: Callable[[float], float]) -> float:
        return float(quad(lambda x1: of_section(float(height(x1))), 0.0, LENGTH)[0])

    def chord(h: float) -> float:
        return 2.0 * np.sqrt(RADIUS**2 - h**2)

    def arc(h: float) -> float:
        return RADIUS * (np.pi + 2.0 * np.arcsin(h / RADIUS))

    def segment(h: float) -> float:
        return 0.5 * (RADIUS * arc(h) + h * chord(h))

    ends = segment(float(height(0.0))) + segment(float(height(LENGTH)))
    return along(segment), ends + along(arc) + np.hypot(1.0, 0.9) * along(chord)


@pytest.mark.parametrize(
    ("field", "volume", "area", "euler"),
    [
        (sphere, 4.0 / 3.0 * np.pi * 5.0**3, 4.0 * np.pi * 5.0**2, 2),
        (torus, 2.0 * np.pi**2 * 9.0 * 3.0**2, 4.0 * np.pi**2 * 9.0 * 3.0, 0),
        (open_tube, np.pi * (11.0**2 - 6.0**2) * LENGTH, np.pi * (2.0 * 17.0 * LENGTH + 2.0 * (11.0**2 - 6.0**2)), 0),
        (slanted, *below_the_plane(), 2),
    ],
)
def test_volume_and_area_converge_at_second_order(
    field: Callable[[Floats], Floats], volume: float, area: float, euler: int
) -> None:
    errors = []
    for factor in (2, 4, 8):
        domain = HalfCylinder(RADIUS, LENGTH, 2 * factor, factor, 3 * factor)
        mesh = solid(domain, field(domain.points))
        assert mesh.euler_number == euler
        errors.append([abs(mesh.volume / volume - 1.0), abs(mesh.area / area - 1.0)])
    rates = np.log2(np.array(errors[0]) / errors[-1]) / 2.0
    assert np.all(rates > 1.7)
    assert np.all(np.array(errors[-1]) < 0.01)


def test_solid_at_the_wall_ends_on_the_wall() -> None:
    """A shell from r = 11 outwards: its outer side is the mesh's wall, facet by facet."""
    domain = DOMAIN.refined(2)
    r = np.hypot(domain.points[:, 1], domain.points[:, 2])
    mesh = solid(domain, r - 11.0)
    wedges = 8 * domain.core_cells
    apothem = RADIUS * np.cos(np.pi / wedges)
    centre = mesh.triangles_center
    outside = np.hypot(centre[:, 1], centre[:, 2]) > 13.0
    lateral = np.abs(mesh.face_normals[:, 0]) < 0.5
    distance = np.einsum("ij,ij->i", mesh.face_normals, centre)[outside & lateral]
    np.testing.assert_allclose(distance, apothem, rtol=1e-9)
    wall = mesh.area_faces[outside & lateral].sum()
    assert wall == pytest.approx(wedges * 2.0 * RADIUS * np.sin(np.pi / wedges) * LENGTH, rel=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_what_closes_the_solid_lies_on_ends_and_wall(seed: int) -> None:
    chi = np.random.default_rng(seed).normal(size=DOMAIN.mesh.nvertices)
    tets = DOMAIN.tetrahedra().corners
    inside = len(solid_boundary(DOMAIN.points, tets, tets[:0, :3], chi).triangles)
    result = mirror.run(DOMAIN, chi, mirror.Settings())
    faces = result.vertices[result.triangles[inside : result.half_triangles]]
    at_ends = [(faces[:, :, 0] == end).all(axis=1) for end in (0.0, LENGTH)]
    on_wall = faces[~at_ends[0] & ~at_ends[1]]
    assert all(end.any() for end in at_ends)
    wedge = np.pi / (4 * DOMAIN.core_cells)
    middle = on_wall.mean(axis=1)
    facet = (np.floor(np.arctan2(middle[:, 1], middle[:, 2]) / wedge) + 0.5) * wedge
    distance = on_wall[..., 1] * np.sin(facet)[:, None] + on_wall[..., 2] * np.cos(facet)[:, None]
    np.testing.assert_allclose(distance, RADIUS * np.cos(0.5 * wedge), rtol=1e-12)


@pytest.mark.parametrize("level", [0.5, 1e-2, 1e-3, 1e-5, 1e-12])
def test_thin_webs_and_thin_slits(level: float) -> None:
    """Solid, or void, just at the nodes of one layer; what is thinner than the clearance is as thin as that."""
    h = LENGTH / DOMAIN.layers
    middle = np.isclose(DOMAIN.points[:, 0], 0.5 * LENGTH)
    web = solid(DOMAIN, np.where(middle, level, -1.0))
    assert web.body_count == 1
    thickness = 2.0 * h * max(level / (1.0 + level), 1e-4)
    assert web.volume == pytest.approx(faceted_volume(DOMAIN) / LENGTH * thickness, rel=1e-9)
    slit = solid(DOMAIN, np.where(middle, -level, 1.0))
    assert slit.body_count == 2
    assert slit.volume == pytest.approx(faceted_volume(DOMAIN) * (1.0 - thickness / LENGTH), rel=1e-9)


def test_threshold_moves_the_surface() -> None:
    x = DOMAIN.points
    volumes = [solid(DOMAIN, x[:, 2], threshold).volume for threshold in (-5.0, 0.0, 5.0)]
    assert volumes[0] > volumes[1] > volumes[2]
    assert volumes[1] == pytest.approx(0.5 * faceted_volume(DOMAIN), rel=1e-4)
    assert volumes[0] + volumes[2] == pytest.approx(faceted_volume(DOMAIN), rel=1e-9)


def test_separate_bodies_and_cavities_stay_separate() -> None:
    domain = DOMAIN.refined(3)
    beside = 3.0 - np.linalg.norm(domain.points - (6.0, 8.0, 0.0), axis=1)
    assert solid(domain, beside).body_count == 2
    assert solid(domain, -beside).body_count == 3  # the cylinder and two cavities


def test_extreme_values() -> None:
    chi = tube(DOMAIN.points)
    reference = solid(DOMAIN, chi)
    for factor in (1e-250, 1e250):
        np.testing.assert_allclose(solid(DOMAIN, factor * chi).vertices, reference.vertices, atol=1e-9)


def test_values_at_the_threshold_are_void() -> None:
    chi = np.zeros(DOMAIN.mesh.nvertices)
    chi[2 * DOMAIN.section_points + 3] = 1.0
    assert solid(DOMAIN, chi).volume < 0.1 * faceted_volume(DOMAIN)


def test_the_initial_design_is_a_tube() -> None:
    domain = HalfCylinder(RADIUS, LENGTH, 6, 2, 9)
    mesh = solid(domain, domain.initial_design(domain.points, 3.0))
    assert mesh.euler_number == 0  # genus 1
    assert mesh.body_count == 1
    np.testing.assert_array_equal(mesh.bounds[:, 0], [0.0, LENGTH])
    assert np.abs(mesh.bounds[:, 1:]).max() < 0.95 * RADIUS


def test_refuses_nothing_solid() -> None:
    for level in (-1.0, 0.0):
        with pytest.raises(EmptySolid, match="Nothing is solid"):
            mirror.run(DOMAIN, np.full(DOMAIN.mesh.nvertices, level), mirror.Settings())


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_refuses_values_that_are_not_finite(bad: float) -> None:
    chi = tube(DOMAIN.points)
    chi[7] = bad
    with pytest.raises(InvalidField, match="not finite at 1 of"):
        mirror.run(DOMAIN, chi, mirror.Settings())


def test_refuses_a_field_of_another_mesh() -> None:
    with pytest.raises(InvalidField, match="shape"):
        mirror.run(DOMAIN, np.ones(5), mirror.Settings())
