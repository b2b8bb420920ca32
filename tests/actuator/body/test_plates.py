"""Which solids can be glued between plates and meshed, wherever and however they lie, and why others cannot."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from manifold3d import Manifold
from shapes import block, rod, tube

from actuator.body.meshing import mesh_of
from actuator.body.plates import Glued, glued
from actuator.failure import InvalidSettings, NotInflatable
from actuator.geometry.printing.directions import Axis
from actuator.geometry.solid import surface_of
from actuator.geometry.zero_set import Surface

REFUSED = {
    "two bodies": (tube() + block(4.0, 4.0, 4.0, 0.0, 30.0, 0.0), "There are 2 separate bodies"),
    "no flat end": (
        Manifold.sphere(10.0, 32).rotate([0.0, 30.0, 20.0]) - block(4.0, 4.0, 4.0),
        "no flat face at its lower",
    ),
    "one flat end": (
        (tube() + Manifold.sphere(10.0, 64).rotate([0, 30, 0]).translate([15.0, 0.0, 0.0])) - rod(5.0, 40.0),
        "no flat face at its upper end along x",
    ),
    "hole in the side": (tube() - block(3.0, 3.0, 30.0), "does not hold air"),
    "no chamber": (rod(10.0, 30.0), "does not hold air"),
    "cavity off the plates": (rod(10.0, 30.0) - block(5.0, 5.0, 5.0), "does not hold air"),
    "groove in the outside": (rod(10.0, 30.0) - block(40.0, 2.0, 2.0, 0.0, 0.0, 10.0), "does not hold air"),
}


def of(solid: Manifold, axis: Axis = "x") -> Glued:
    surface = surface_of(solid)
    return glued(surface.vertices, surface.triangles, axis)


def test_machine_without_the_mesher_is_told_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mmgpy", None)
    with pytest.raises(InvalidSettings, match="--no-inflate"):
        mesh_of(of(tube()), 4.0)


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_inflated_is_refused(name: str) -> None:
    solid, sentence = REFUSED[name]
    with pytest.raises(NotInflatable, match=sentence):
        of(solid)


def test_an_open_surface_is_refused() -> None:
    surface = surface_of(tube())
    with pytest.raises(NotInflatable, match="The triangles bound no solid"):
        glued(surface.vertices, surface.triangles[1:], "x")


def test_a_wall_that_the_mesh_cannot_show_is_refused() -> None:
    """Crumbs are left of it."""
    thin = rod(10.0, 10.0) - rod(9.9, 20.0)
    with pytest.raises(NotInflatable, match="choose a smaller size"):
        mesh_of(of(thin), 4.0)


def test_a_tube_is_glued_at_both_ends_and_pressed_inside() -> None:
    found = of(tube())
    corners = found.surface.vertices[found.surface.triangles]
    radius = np.linalg.norm(corners[..., 1:], axis=2).max(axis=1)
    assert found.length == pytest.approx(30.0, rel=1e-6)
    assert found.symmetric
    np.testing.assert_array_equal(found.at_fixed, (corners[..., 0] < 1e-5).all(axis=1))
    np.testing.assert_array_equal(found.at_arm, (corners[..., 0] > 30.0 - 1e-5).all(axis=1))
    np.testing.assert_array_equal(found.wall, ~(found.at_fixed | found.at_arm) & (radius < 5.1))


def test_a_chamber_that_ends_in_the_solid_is_one() -> None:
    """It reaches from the fixed plate over the middle; the arm's plate closes nothing."""
    blind = rod(10.0, 30.0) - rod(5.0, 25.0).translate([-5.0, 0.0, 0.0])
    mesh = mesh_of(of(blind), 6.0)
    assert mesh.opening == 0.0
    assert len(mesh.walls)


def test_an_uneven_solid_has_no_symmetry_plane() -> None:
    assert not of(tube() + block(4.0, 4.0, 4.0, 0.0, 10.0, 0.0)).symmetric
    assert of(tube() + block(4.0, 4.0, 4.0, 0.0, 0.0, 10.0)).symmetric


def same(one: Glued, other: Glued) -> None:
    def sorted_centres(solid: Glued, which) -> np.ndarray:
        centres = solid.surface.vertices[solid.surface.triangles[which]].mean(axis=1).round(3) + 0.0
        return centres[np.lexsort(centres.T)]

    assert one.length == pytest.approx(other.length, rel=1e-6)
    assert one.symmetric == other.symmetric
    for name in ("at_fixed", "at_arm", "wall"):
        a, b = (sorted_centres(solid, getattr(solid, name)) for solid in (one, other))
        np.testing.assert_allclose(a, b, atol=2e-3)


UNEVEN = tube() + block(4.0, 4.0, 4.0, 3.0, 0.0, 10.0)


@pytest.mark.parametrize(("axis", "turns"), [("y", 1), ("z", 2)])
def test_the_axis_may_be_another(axis: Axis, turns: int) -> None:
    surface = surface_of(UNEVEN)
    moved = Surface(np.roll(surface.vertices, turns, axis=1), surface.triangles)
    same(glued(moved.vertices, moved.triangles, axis), of(UNEVEN))
    with pytest.raises(NotInflatable):
        glued(moved.vertices, moved.triangles, "x")


def test_the_place_does_not_count() -> None:
    moved = of(UNEVEN.translate([100.0, 0.0, 0.0]))
    same(moved, of(UNEVEN))
    # The axis of a solid far off it is that of the box.
    assert of(tube().translate([-3.0, 50.0, -70.0])).symmetric
    same(of(tube().translate([-3.0, 50.0, -70.0])), of(tube()))
