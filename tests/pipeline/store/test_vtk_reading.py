"""What other programs find in an artifact: VTK's own reader, and meshio's formats."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista
from command_line import Poro

import stages.mirror
import stages.optimize
import stages.refine
from actuator.domains.half_cylinder import HalfCylinder
from pipeline.case.model import case_type
from pipeline.exit_codes import ExitCode
from pipeline.runs.keys import plain
from pipeline.store import artifact, contents, vtkhdf
from pipeline.store.artifact import Header
from stages.datasets import Packed

DOMAIN = HalfCylinder(15.0, 12.0, 2, 1, 3)
#: A stretch and a shear: linear, so that edge midpoints take exactly the mean.
GRADIENT = np.array([[0.2, 0.0, 0.1], [0.0, -0.05, 0.0], [0.03, 0.0, 0.1]])


def _write(path: Path, stage: str, packed: Packed) -> Path:
    header = Header(stage, 1, "key", "run", (), "", "", plain(case_type()(name=path.name.partition(".")[0])))
    artifact.write(path, header, packed.datasets, packed.grid)
    vtkhdf.write_sidecar(path)
    return path


@pytest.fixture
def design(tmp_path: Path) -> Path:
    """The artifact of a design whose state is known."""
    result = stages.optimize.Result(
        domain=DOMAIN,
        chi=DOMAIN.points @ [0.1, 0.2, 0.3],
        displacement=DOMAIN.nodes @ GRADIENT.T,
        pressure=DOMAIN.points[:, 0] / DOMAIN.length,
        arm=np.array([0.1, -0.2, 0.3]),
        history={"update": np.arange(2.0), "C": np.array([0.0, -1.0])},
        summary={},
        checkpoint={},
        converged=False,
        reason="",
        others={},
    )
    return _write(tmp_path / "x.h5", "optimize", stages.optimize.pack(result))


def test_vtk_reads_mesh_and_fields_from_the_sidecar(design: Path) -> None:
    grid = pyvista.read(design.with_suffix(".vtkhdf"))
    points = np.asarray(grid.points)
    assert set(grid.celltypes) == {pyvista.CellType.QUADRATIC_HEXAHEDRON}
    assert set(grid.point_data.keys()) == {"chi", "density", "pressure", "displacement"}
    np.testing.assert_allclose(points, DOMAIN.nodes, rtol=0, atol=0)
    np.testing.assert_allclose(grid["displacement"], points @ GRADIENT.T, atol=1e-12)
    np.testing.assert_allclose(grid["pressure"], points[:, 0] / DOMAIN.length, atol=1e-12)
    np.testing.assert_allclose(grid["chi"], points @ [0.1, 0.2, 0.3], atol=1e-12)
    np.testing.assert_allclose(grid["density"], 1.0 / (1.0 + np.exp(-grid["chi"])), atol=1e-12)


def test_cells_are_right_handed_and_fill_the_domain(design: Path) -> None:
    grid = pyvista.read(design.with_suffix(".vtkhdf"))
    volumes = grid.compute_cell_sizes()["Volume"]
    # The section is a polygon of 2 (4 m) / 2 = 8 equal triangles on the half disc.
    section = 8 * 0.5 * 15.0**2 * np.sin(np.pi / 8)
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(section * 12.0, rel=1e-12)


def test_every_edge_node_lies_between_its_corners(design: Path) -> None:
    """The order of vtkQuadraticHexahedron: bottom edges, top edges, upright edges."""
    grid = artifact.read_grid(design)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    corners = grid.points[grid.cells]
    for node, (a, b) in enumerate(edges, start=8):
        np.testing.assert_allclose(corners[:, node], 0.5 * (corners[:, a] + corners[:, b]), atol=1e-12)


def test_finer_mesh_and_surface_are_read_too(tmp_path: Path) -> None:
    chi = DOMAIN.initial_design(DOMAIN.points, 3.0)
    finer = stages.refine.run(DOMAIN, chi, stages.refine.Settings())
    solid = stages.mirror.run(finer.domain, finer.chi, stages.mirror.Settings())
    refined = _write(tmp_path / "x.refined.h5", "refine", stages.refine.pack(finer))
    surface = _write(tmp_path / "x.solid.h5", "mirror", stages.mirror.pack(solid))
    grid = pyvista.read(refined.with_suffix(".vtkhdf"))
    assert grid.compute_cell_sizes()["Volume"].min() > 0.0
    np.testing.assert_array_equal(grid["chi"], finer.chi)
    skin = pyvista.read(surface.with_suffix(".vtkhdf")).extract_surface(algorithm=None)
    assert skin.n_open_edges == 0
    assert skin.volume > 0.0
    np.testing.assert_array_equal(contents.surface(surface)[1], solid.triangles)
    domain, field = contents.design(refined, "refine")
    assert domain == finer.domain
    np.testing.assert_array_equal(field, finer.chi)


@pytest.mark.parametrize("ending", ["vtu", "vtk", "msh", "xdmf"])
def test_conversion_keeps_mesh_and_fields(ending: str, design: Path, poro: Poro) -> None:
    before = design.read_bytes()
    target = design.with_suffix(f".{ending}")
    ended = poro("convert", design, target)
    assert ended.code == ExitCode.OK, ended.err
    mesh = meshio.read(target)
    np.testing.assert_allclose(mesh.points, DOMAIN.nodes, atol=1e-12)
    assert mesh.cells_dict["hexahedron20"].shape == DOMAIN.node_cells.shape
    np.testing.assert_allclose(mesh.point_data["displacement"], DOMAIN.nodes @ GRADIENT.T, atol=1e-12)
    assert design.read_bytes() == before
    assert {path.suffix for path in design.parent.iterdir()} == {".h5", ".vtkhdf", f".{ending}"}


@pytest.mark.parametrize(
    ("target", "part"),
    [("x.foo", "names no format"), ("x", "names no format"), ("x.stl", "cannot hold"), ("no/x.vtu", "no folder")],
)
def test_impossible_conversions_give_one_sentence(target: str, part: str, design: Path, poro: Poro) -> None:
    ended = poro("convert", design, target)
    assert ended.code == ExitCode.USAGE
    assert part in ended.err
    assert ended.err.count("\n") == 1
    assert not Path(target).exists()
