"""Own meshes: one that equals the half cylinder gives its result, its artifact needs no file, and faults are told."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import pytest
from command_line import TO_PART, Poro
from mesh_files import hexahedra, write

import poro as door
from actuator.arrays import Floats
from actuator.domains.half_cylinder import HalfCylinder
from actuator.domains.prism import Box
from pipeline.exit_codes import ExitCode
from pipeline.store import artifact, contents
from stages.optimize import OF_A_CLASS, least_memory

TUBE = HalfCylinder(15.0, 15.0, 2, 1, 3)
BOX = Box(length=20.0, across=2, up=2, rings=2, layers=3, whole=False, refinement=1, width=16.0, height=20.0, edge=0.0)
REST = "optimizer: {max_updates: 2}\nrefine: {factor: 1}\n"
TO_DESIGN = ("--threads", 1, "--output", ".")


def summary(path: str) -> dict[str, object]:
    return contents.summary(Path(path), "optimize")


@pytest.mark.parametrize("ending", ["msh", "inp", "vtu"])
def test_a_mesh_that_equals_the_half_cylinder_gives_its_result(ending: str, tmp_path: Path, poro: Poro) -> None:
    write(tmp_path / f"tube.{ending}", TUBE)
    Path("own.yaml").write_text(f"domain: {{shape: mesh, file: tube.{ending}, radius: 15.0}}\n{REST}")
    Path("half.yaml").write_text(f"domain: {{core_cells: 2, rings: 1, layers: 3}}\n{REST}")
    for case in ("own.yaml", "half.yaml"):
        assert poro("optimize", case, *TO_DESIGN).code == ExitCode.OK
    own, half = summary("own/own.h5"), summary("half/half.h5")
    assert own["terms"] == pytest.approx(half["terms"], rel=1e-7, abs=1e-9)
    assert own["terms"]["C0"] == pytest.approx(half["terms"]["C0"], abs=1e-9)
    ours, theirs = (artifact.read(Path(f"{name}/{name}.h5"), "optimize", "vertices/chi")[0] for name in ("own", "half"))
    assert np.abs(ours - theirs).max() < 1e-6


@pytest.mark.slow
def test_the_chain_needs_no_file_once_the_design_is_there(tmp_path: Path, poro: Poro) -> None:
    write(tmp_path / "box.inp", BOX)
    Path("own.yaml").write_text(f"domain: {{shape: mesh, file: box.inp}}\n{REST}rig: {{youngs_modulus: 1.0}}\n")
    assert poro("run", "own.yaml", *TO_PART, *TO_DESIGN).code == ExitCode.OK
    domain, _ = contents.design(Path("own/own.h5"), "optimize")
    assert contents.design(Path("own/details/own.refined.h5"), "refine")[0] == domain
    assert "| height H | 20 mm |" in Path("own/own.rig.md").read_text(encoding="utf-8")
    # Known by what it holds, wherever it lies, and part of the result.
    Path("box.inp").rename("other.inp")
    Path("own.yaml").write_text(Path("own.yaml").read_text().replace("box.inp", "other.inp"))
    steps = json.loads(poro("status", "own.yaml", "--json", "--output", ".").out)["steps"]
    assert not any(step["runs"] for step in steps[:5])
    Path("other.inp").unlink()
    assert poro("refine", "own/own.h5", "--set", "refine.factor=2").code == ExitCode.OK
    assert contents.design(Path("own/details/own.refined.h5"), "refine")[0] == domain.refined(2)
    assert "refined by 1, 2, 4 or 8, not by 3" in poro("refine", "own/own.h5", "--set", "refine.factor=3").err
    assert poro("simulate", "own/own.h5", "--max-load", 0.2, "--threads", 1).code == ExitCode.OK
    assert poro("plot", "own/own.h5", "--only", "initial").code == ExitCode.OK
    assert door.load(Path("own/own.h5")).domain == domain
    ended = poro("optimize", "own.yaml", *TO_DESIGN)
    assert (ended.code, "own.yaml:1: domain.file: there is no file" in ended.err) == (ExitCode.USAGE, True)


def test_a_mesh_in_metres_is_scaled_to_its_length_and_may_be_another(tmp_path: Path, poro: Poro) -> None:
    write(tmp_path / "box.vtu", BOX, 1e-3 * BOX.points, inlet=np.flatnonzero(np.hypot(*BOX.points[:, 1:].T) < 3.0))
    write(tmp_path / "tube.vtu", TUBE)
    Path("own.yaml").write_text("domain: {shape: mesh, file: box.vtu, length: 20 mm}\noptimizer: {max_updates: 0}\n")
    case = door.read_case("own.yaml")
    built = case.domain.build()
    assert (case.domain.length, case.domain.size, case.domain.cells, case.domain.halves) == (20.0, 10.0, 72, 1)
    np.testing.assert_allclose(built.points, BOX.points, atol=1e-9)
    assert built.inlet(built.points).max() == 1.0
    assert (built.initial_design(built.points, 3.0)[built.inlet(built.points) > 0.0] < 0.0).all()
    assert poro("optimize", "own.yaml", "--set", "domain.file=tube.vtu", *TO_DESIGN).code == ExitCode.OK
    assert contents.design(Path("own/own.h5"), "optimize")[0].size == pytest.approx(20.0)
    Path("own.yaml").write_text(f"domain: {{shape: mesh, file: box.vtu, sha256: '{'0' * 64}'}}\n")
    assert "is not what domain.sha256 says but " in poro("optimize", "own.yaml", *TO_DESIGN).err


def test_cells_of_their_own_cost_memory() -> None:
    assert least_memory(30_000, 30_000) - least_memory(30_000) == OF_A_CLASS * 30_000
    assert 1.0 < OF_A_CLASS * 30_000 / 2**30 < 1.5


# ------------------------------------------------------------------------------------------------------- refusals


def moved(where: Callable[[Floats], Floats], by: tuple[float, float, float]) -> Floats:
    points = BOX.points.copy()
    points[where(points)] += by
    return points


INSIDE = (np.abs(BOX.points[:, 0] - 20.0 / 3.0) < 1e-6) & (BOX.points[:, 1] == 0.0) & (BOX.points[:, 2] == 0.0)


def of_cells(path: Path, points: Floats, cells: np.ndarray) -> None:
    sets = {"fixed": np.flatnonzero(points[:, 0] < 1e-9), "tip": np.flatnonzero(points[:, 0] > 20.0 - 1e-9)}
    meshio.Mesh(points, [("hexahedron", cells)], point_sets=sets).write(path)


def two_pieces(path: Path) -> None:
    keep = BOX.points[BOX.cells, 0].mean(axis=1)
    cells = hexahedra(BOX)[(keep < 6.0) | (keep > 14.0)]
    of_cells(path, BOX.points, cells)


def hanging(path: Path) -> None:
    """The cells of the first layer divided into eight, those behind them not."""
    fine = BOX.refined(2)
    near, far = fine.points[fine.cells, 0].mean(axis=1) < 6.6, BOX.points[BOX.cells, 0].mean(axis=1) > 6.7
    points = np.concatenate([fine.points, BOX.points])
    cells = np.concatenate([hexahedra(fine)[near], hexahedra(BOX)[far] + len(fine.points)])
    _, first, number = np.unique(points.round(6), axis=0, return_index=True, return_inverse=True)
    of_cells(path, points[first], number.ravel()[cells])


FAULTS: dict[str, tuple[Callable[[Path], None], str]] = {
    "left-handed": (
        lambda path: of_cells(path, BOX.points, hexahedra(BOX)[:, [4, 5, 6, 7, 0, 1, 2, 3]]),
        "72 of 72 cells that are left-handed, twisted or flat, 1, 2, 3, 4, 5, …",
    ),
    "flat": (
        lambda path: write(path, BOX, moved(lambda _: INSIDE, (7.0, 0.0, 0.0))),
        "72 cells that are left-handed",
    ),
    "pieces": (two_pieces, "has 2 pieces that share no facets; join them"),
    "hanging": (hanging, "has a hanging vertex, number "),
    "no tip": (lambda path: write(path, BOX, names=("fixed", "symmetry")), "has no set 'tip' but fixed, symmetry"),
    "tip not flat": (
        lambda path: write(path, BOX, moved(lambda x: (x[:, 0] > 19.9) & (x[:, 2] > 9.9), (-0.5, 0.0, 0.0))),
        "has a vertex of 'tip', number ",
    ),
    "fixed elsewhere": (
        lambda path: write(path, BOX, BOX.points + np.array([1.0, 0.0, 0.0])),
        "1 off the plane X1 = 0; put all of the set there",
    ),
    "symmetry elsewhere": (
        lambda path: write(path, BOX, BOX.points + np.array([0.0, 1.0, 0.0])),
        "1 off the plane X2 = 0; put all of the set there",
    ),
    "empty set": (
        lambda path: write(path, BOX, names=("fixed", "tip"), symmetry=np.array([0])),
        "has no whole facet of its surface in the set 'symmetry'",
    ),
    "inlet outside": (
        lambda path: write(path, BOX, inlet=BOX.outside.vertices[:3]),
        "has an inlet that touches the outside",
    ),
    "tetrahedra": (
        lambda path: meshio.Mesh(np.eye(4, 3), [("tetra", [[0, 1, 2, 3]])]).write(path),
        "has cells of the type tetra; mesh it by 8-node hexahedra alone",
    ),
    "no mesh": (lambda path: path.write_text("*NODE\n1, x, y\n*ELEMENT\n"), "cannot be read as a mesh ("),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_mesh_that_is_no_domain_is_refused_in_a_sentence(fault: str, tmp_path: Path, poro: Poro) -> None:
    make, said = FAULTS[fault]
    make(tmp_path / "bad.inp")
    Path("bad.yaml").write_text("name: bad\ndomain:\n  shape: mesh\n  file: bad.inp\n")
    ended = poro("optimize", "bad.yaml", *TO_DESIGN)
    assert ended.code == (ExitCode.ARTIFACT if fault == "no mesh" else ExitCode.USAGE), ended.err
    assert ended.err.startswith("poro: bad.yaml:4: domain.file: "), ended.err
    assert said in ended.err, ended.err
    assert ended.err.count("\n") == 1


def test_a_mesh_without_a_file_is_refused(tmp_path: Path, poro: Poro) -> None:
    Path("bad.yaml").write_text("domain: {shape: mesh}\n")
    assert "bad.yaml:1: domain: has no mesh; write 'file'" in poro("optimize", "bad.yaml", *TO_DESIGN).err
