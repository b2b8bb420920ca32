"""Own meshes: what is known of one that equals another domain, its finer meshes, and where its inlet and walls are."""

from __future__ import annotations

import numpy as np
import pytest

from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.interface import Domain
from actuator.domains.own_mesh import OwnMesh
from actuator.domains.own_mesh_checks import checked
from actuator.domains.prism import Box
from actuator.equations.discretisation import Discretisation

TUBE = HalfCylinder(15.0, 15.0, 3, 2, 4)
SIZES = {"length": 20.0, "across": 2, "up": 2, "rings": 2, "layers": 3, "refinement": 1, "width": 16.0, "height": 20.0}
HALF, WHOLE = (Box(**SIZES, whole=whole, edge=0.0) for whole in (False, True))
NAMES = ("fixed", "tip", "symmetry", "outside")


def own(domain: Domain, **keys: float) -> OwnMesh:
    names = NAMES[:3] if domain.mirrored else NAMES[:2]
    sets = {name: domain.mesh.facets[:, getattr(domain, name).facets].T for name in names}
    return checked(domain.points, domain.cells, sets, **keys)


def test_a_round_mesh_is_the_half_cylinder() -> None:
    mesh = own(TUBE, radius=15.0)
    assert (mesh.length, mesh.size, mesh.mirrored) == (15.0, 15.0, True)
    for name in NAMES:
        np.testing.assert_array_equal(getattr(mesh, name).nodes, getattr(TUBE, name).nodes)
    np.testing.assert_array_equal(mesh.nodes, TUBE.nodes)
    for function in ("passive_bound", "initial_design"):
        ours, theirs = (getattr(domain, function)(TUBE.nodes, 3.0, 0.5) for domain in (mesh, TUBE))
        np.testing.assert_allclose(ours, theirs, atol=1e-13)
    np.testing.assert_array_equal(mesh.inlet(TUBE.nodes), TUBE.inlet(TUBE.nodes))
    assert len(mesh.representatives) == mesh.mesh.nelements


@pytest.mark.parametrize("box", [HALF, WHOLE], ids=["half", "whole"])
def test_distances_of_a_box_are_those_of_its_wall(box: Box) -> None:
    mesh = own(box)
    for function in ("passive_bound", "initial_design"):
        ours, theirs = (getattr(domain, function)(box.nodes, 3.0) for domain in (mesh, box))
        np.testing.assert_allclose(ours, theirs, atol=1e-9)


@pytest.mark.parametrize("box", [HALF, WHOLE], ids=["half", "whole"])
def test_finer_meshes_divide_each_cell_into_eight(box: Box) -> None:
    mesh = own(box)
    for factor in (1, 2, 4):
        fine, weights = mesh.refined(factor), mesh.prolongation(factor)
        assert fine.mesh.nelements == factor**3 * mesh.mesh.nelements
        assert fine.mesh.mapping().detDF(np.array([[0.0, 1.0]] * 3)).min() > 0.0
        np.testing.assert_allclose(weights @ mesh.points, fine.points, atol=1e-12)
        assert Discretisation(fine).volume == pytest.approx(Discretisation(box).volume, rel=1e-12)
        for name in NAMES:
            assert len(getattr(fine, name).facets) == factor**2 * len(getattr(box, name).facets)
        np.testing.assert_array_equal(fine.points[fine.symmetry.vertices, 1], 0.0)
    assert mesh.refined(2) == mesh.refined(2)
    assert mesh.refined(2) != mesh
    assert mesh.scaled(2.0).refined(2) == mesh.refined(2).scaled(2.0)


def test_facets_by_name_are_those_of_the_surface_once() -> None:
    sets = {name: HALF.mesh.facets[:, getattr(HALF, name).facets].T for name in NAMES}
    with pytest.raises(ValueError, match="in two of the sets"):
        checked(HALF.points, HALF.cells, sets | {"tip": np.concatenate([sets["tip"], sets["outside"][:1]])})
    with pytest.raises(ValueError, match="not of the cells' surface"):
        checked(HALF.points, HALF.cells, sets | {"outside": np.array([[0, 1, 2, 3]])})
    # Walls where air may go, as the inside of a hole, are no part of the outside if that is named.
    fewer = checked(HALF.points, HALF.cells, sets | {"outside": sets["outside"][:20]})
    assert len(fewer.outside.facets) == 20
