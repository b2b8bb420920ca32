"""Regions as bounds on χ: where they are zero, that they can be met, what is refused, and their derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from made_up_domain import BoxSettings
from physics import Floats, half_cylinder, halvings, parameters, rates, remainders
from small_case import INTERFACE_WIDTH

from actuator.arrays import Bools, Ints
from actuator.domains.half_cylinder import HalfCylinder
from actuator.failure import InvalidRegion
from actuator.geometry.transfer import facets_of
from actuator.regions.bounds import GAP, Bounds, Kind, Region, Regions
from actuator.regions.shapes import Box, Cylinder, Shape, Skin, Sphere
from actuator.solve.reduced import ReducedObjective

DOMAIN = half_cylinder(4, 2, 6)
SLOPE = 8.0 / INTERFACE_WIDTH


def box(*corners: float) -> Box:
    return Box(np.array(corners[:3]), np.array(corners[3:]))


def bar(start: tuple[float, ...], end: tuple[float, ...], radius: float) -> Cylinder:
    return Cylinder(np.array(start), np.array(end), radius)


#: A solid plate around the inlet, a hole for a screw through it, and a skin on the wall.
PLATE, INLET = box(0.0, -15.0, -15.0, 3.0, 15.0, 15.0), bar((-1.0, 0.0, 0.0), (16.0, 0.0, 0.0), 5.0)
HOLE = bar((-1.0, 9.0, 0.0), (5.0, 9.0, 0.0), 2.5)
SKIN = Skin(facets_of(DOMAIN, DOMAIN.outside), 2.0)


def regions(*pairs: tuple[Kind, Shape], domain: HalfCylinder = DOMAIN) -> Regions:
    return Regions(domain, [Region(kind, shape) for kind, shape in pairs])


FLANGE = regions(("solid", PLATE), ("free", INLET), ("free", HOLE), ("void", HOLE), ("solid", SKIN))


def places(domain: HalfCylinder = DOMAIN, count: int = 4000) -> Floats:
    rng = np.random.default_rng(5)
    radius, angle = 15.0 * np.sqrt(rng.uniform(0.0, 1.0, count)), rng.uniform(-0.5, 0.5, count) * np.pi
    return np.column_stack([rng.uniform(0.0, 15.0, count), radius * np.cos(angle), radius * np.sin(angle)])


def bounds(found: Regions, points: Floats) -> tuple[Floats, Floats]:
    lower, upper = found.bounds(points, INTERFACE_WIDTH)
    assert lower is not None
    assert upper is not None
    return lower, np.minimum(upper, DOMAIN.passive_bound(points, INTERFACE_WIDTH))


def test_void_and_solid_are_where_the_list_says() -> None:
    points = places()
    lower, upper = bounds(FLANGE, points)
    x1, x2, x3 = points.T
    radii = np.hypot(x2, x3)
    hole = (x1 < 5.0) & (np.hypot(x2 - 9.0, x3) < 2.5)
    core = radii < 4.4
    clear = (np.abs(radii - 5.0) > 0.05) & (np.abs(x1 - 3.0) > 0.05) & (radii < 14.95)
    solid = (((x1 < 3.0) & (radii > 5.0)) | (radii > 13.05)) & ~hole
    rim = np.abs(radii - 13.0) < 0.2  # the skin is measured from the flat facets
    assert (upper[clear & (hole | core)] < 0.0).all()
    asked = clear & ~rim & ~hole
    np.testing.assert_array_equal(lower[asked] > 0.0, solid[asked])
    assert not (hole & (lower > 0.0)).any()


def test_bounds_can_be_met_together() -> None:
    """They never cross, also at the outer wall and at the hole's rim; in the optimisation a gap stays between them."""
    for gap in (0.0, GAP):
        lower, upper = FLANGE.bounds(places(), INTERFACE_WIDTH, gap=gap)
        assert lower is not None
        least = np.minimum(upper, DOMAIN.passive_bound(places(), INTERFACE_WIDTH))
        assert (least - lower >= gap - 1e-12).all()


def test_a_bound_rises_as_steeply_as_an_interface_may() -> None:
    points, step = places(count=500), 1e-6 * np.random.default_rng(2).standard_normal((500, 3))
    for found in (regions(("solid", Sphere(np.array([7.0, 8.0, 0.0]), 4.0))), regions(("void", HOLE))):
        changes = [
            np.abs(after - before)
            for before, after in zip(
                found.bounds(points, INTERFACE_WIDTH), found.bounds(points + step, INTERFACE_WIDTH), strict=True
            )
            if before is not None and after is not None
        ]
        (change,) = changes
        assert (change <= SLOPE * np.linalg.norm(step, axis=1) * (1.0 + 1e-4)).all()


def test_a_region_counts_with_its_mirror_image() -> None:
    left, right = (regions(("void", Sphere(np.array([7.0, side * 9.0, 2.0]), 3.0))) for side in (-1.0, 1.0))
    points = places()
    np.testing.assert_allclose(left.bounds(points, 3.0).upper, right.bounds(points, 3.0).upper, rtol=1e-13)


def test_of_a_whole_domain_a_region_counts_alone() -> None:
    domain = BoxSettings(whole=True).build()
    ball = Sphere(np.array([7.0, -6.0, 4.0]), 3.0)
    points = np.array([[7.0, -6.0, 4.0], [7.0, 6.0, 4.0]])
    _, upper = Regions(domain, [Region("void", ball)]).bounds(points, INTERFACE_WIDTH)
    assert upper is not None
    assert upper[0] < 0.0 < upper[1]


def test_the_first_design_lies_within_the_bounds(reduced: ReducedObjective) -> None:
    """At the vertices and so between them, in cells as wide as the hole; farther away it is that of the domain."""
    chi = DOMAIN.initial_design(DOMAIN.points, INTERFACE_WIDTH)
    lower, upper = FLANGE.all_bounds(INTERFACE_WIDTH)
    assert lower is not None
    assert upper is not None
    assert ((chi < lower) | (chi > upper)).any()
    clipped = FLANGE.clipped(chi, INTERFACE_WIDTH)
    np.testing.assert_array_equal(clipped, np.clip(chi, lower, upper))
    fitted = FLANGE.fitted(chi, INTERFACE_WIDTH)
    for found in (clipped, fitted):
        assert reduced.design.passive.room(found).min() > -1e-12
        assert reduced.design(found).terms["C_chi"].value < 1e-12
    far = (lower < chi - 2.0 * SLOPE) & (upper > chi + 2.0 * SLOPE)
    assert far.any()
    assert np.abs(fitted - chi)[far].max() < 0.03
    for change in (regions(("free", HOLE)).fitted, regions(("free", HOLE)).clipped):
        assert change(chi, INTERFACE_WIDTH) is chi


def test_bounds_for_the_part() -> None:
    """At the level of its surface; the upper one counts where they cross, and what lies beyond goes no farther."""
    low, high, chi = np.array([-1.0, 2.0, 0.0]), np.array([1.0, 3.0, -1.0]), np.array([4.0, 0.0, 0.0])
    held = Bounds(low, high)
    np.testing.assert_array_equal(held.kept(chi), [1.0, 2.0, -1.0])
    np.testing.assert_array_equal(held.kept(chi, -0.5), [0.5, 1.5, -1.5])
    np.testing.assert_array_equal(Bounds(low, None).also(Bounds(None, high)).kept(chi), held.kept(chi))
    np.testing.assert_array_equal(held.also(Bounds(None, np.zeros(3))).kept(chi), [0.0, 0.0, -1.0])
    for moved in (chi, chi + 1.0, chi - 1.0):
        inside = held.around(chi).kept(moved)
        assert (inside <= np.maximum(high, chi)).all()
        assert (inside >= np.minimum(low, chi)).all()
    assert Bounds(None, None).kept(chi) is chi


@pytest.mark.parametrize(
    ("pairs", "number", "sentence"),
    [
        ([("solid", Sphere(np.array([7.0, 9.0, 0.3]), 0.1))], 0, "contains no vertex of the mesh"),
        ([("free", Sphere(np.array([70.0, 9.0, 0.0]), 1.0))], 0, "contains no vertex of the mesh"),
        ([("void", HOLE), ("solid", SKIN), ("solid", box(0, 5, -5, 4, 12, 5))], 2, "overlaps regions.0, which is void"),
        ([("solid", box(0, 5, -5, 4, 12, 5)), ("void", HOLE)], 1, "is void and overlaps regions.0, which is solid"),
        ([("solid", PLATE)], 0, "covers the inlet"),
        ([("solid", box(0, 3.9, -2, 9, 12, 2))], 0, "that the domain keeps void around its inlet"),
    ],
)
def test_what_cannot_be_kept_is_refused(pairs: list[tuple[Kind, Shape]], number: int, sentence: str) -> None:
    with pytest.raises(InvalidRegion, match=sentence) as found:
        regions(*pairs).check(INTERFACE_WIDTH)
    assert found.value.number == number
    assert str(found.value).startswith(f"regions.{number}: ")


def test_what_can_be_kept_is_not_refused() -> None:
    FLANGE.check(INTERFACE_WIDTH)
    regions().check(INTERFACE_WIDTH)
    # Regions that only touch do not overlap.
    regions(("void", box(0, 6, -3, 5, 12, 3)), ("solid", box(5, 6, -3, 9, 12, 3))).check(INTERFACE_WIDTH)


# ------------------------------------------------------------------------------------------------- as a term


@pytest.fixture(scope="module")
def reduced() -> ReducedObjective:
    return ReducedObjective(DOMAIN, *parameters(), threads=1, regions=FLANGE)


def beyond(reduced: ReducedObjective, chi: Floats) -> Bools | Ints:
    passive = reduced.design.passive
    return passive.beyond(reduced.design.points.at(chi), *passive.rooms(0.0 * chi))


def off_the_kinks(reduced: ReducedObjective, chi: Floats, d: Floats, most: float) -> bool:
    """Whether no quadrature point crosses a bound on the way: the square of an excess has a kink in its slope."""
    return np.array_equal(beyond(reduced, chi), beyond(reduced, chi + most * d))


def test_value_of_the_bounds(reduced: ReducedObjective) -> None:
    """c_χ / 2 ∫ ⟨χ - upper⟩² + ⟨lower - χ⟩² over a uniform design, by its quadrature points."""
    passive, points = reduced.design.passive, reduced.design.points
    for chi in (-2.0, 0.3, 1.5):
        over = np.maximum(chi - passive.upper, 0.0) ** 2 + np.maximum(passive.lower - chi, 0.0) ** 2
        expected = 0.5 * passive.weight * float(np.sum(points.volumes * over))
        field = np.full(len(DOMAIN.points), chi)
        assert reduced.design(field).terms["C_chi"].value == pytest.approx(expected, rel=1e-12)
        assert reduced.design.value(field) == reduced.design(field).value


def test_gradient_and_hessian_of_the_bounds(reduced: ReducedObjective) -> None:
    rng = np.random.default_rng(11)
    chi = FLANGE.fitted(DOMAIN.initial_design(DOMAIN.points, INTERFACE_WIDTH), INTERFACE_WIDTH)
    chi = chi + rng.standard_normal(len(chi))
    d, steps = rng.standard_normal(len(chi)), halvings(0.2, 6)
    passive = reduced.design.passive

    def value(h: float) -> float:
        return passive.penalty(-passive.room(chi + h * d))

    def gradient(h: float) -> Floats:
        return reduced.design(chi + h * d).gradient - reduced.design.smooth(chi + h * d).gradient

    assert set(np.unique(beyond(reduced, chi))) == {-1, 0, 1}, "both bounds must act"
    first = remainders(value, lambda h: value(0.0) + h * gradient(0.0) @ d, steps)
    assert rates(first).min() > 1.9
    smooth, whole = reduced.design.smooth(chi), reduced.design(chi)
    upper = reduced.design.gather.matrix(whole.hessian - smooth.hessian)
    bent = upper @ d + upper.T @ d - upper.diagonal() * d
    small = 1e-4
    assert off_the_kinks(reduced, chi, d, small)
    assert np.linalg.norm(gradient(small) - gradient(0.0) - small * bent) < 1e-8 * small * np.linalg.norm(bent)


def test_shares(reduced: ReducedObjective) -> None:
    ones = np.ones(len(DOMAIN.points))
    passive, volumes = reduced.design.passive, reduced.design.points.volumes
    assert passive.missing(-ones) == 1.0
    assert passive.missing(30.0 * ones) == 0.0
    assert passive.share(ones) == pytest.approx(volumes[passive.upper < 0.0].sum() / volumes.sum(), rel=1e-12)


def test_without_regions_nothing_is_bounded_from_below() -> None:
    plain, empty = (ReducedObjective(DOMAIN, *parameters(), threads=1, regions=r) for r in (None, regions()))
    chi = DOMAIN.initial_design(DOMAIN.points, INTERFACE_WIDTH)
    assert empty.design.passive.lower is None
    one, other = plain.design(chi), empty.design(chi)
    assert one.value == other.value
    np.testing.assert_array_equal(one.gradient, other.gradient)
    np.testing.assert_array_equal(one.hessian, other.hessian)
