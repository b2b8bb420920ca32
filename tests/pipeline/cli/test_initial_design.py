"""The section ``initial``: what a case begins with, how a file is known, and what is said of one that is no use."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import TINY, Poro
from shapes import rod, surface

import poro as door
from actuator.domains.half_cylinder import HalfCylinder
from pipeline.exit_codes import ExitCode
from pipeline.store import artifact
from stages.formats import FORMATS

BEGIN = ("--output", ".", "--threads", 1, "--updates", 0)
FINER = "domain: {core_cells: 3, rings: 1, layers: 3}\n"


def chi_of(path: Path) -> np.ndarray:
    return np.asarray(artifact.read(path, "optimize", "vertices/chi")[0])


def reasons(poro: Poro, case: str) -> list[str]:
    ended = poro("run", case, "--until", "optimize", "--output", ".", "--dry-run", "--json")
    assert ended.code == ExitCode.OK, ended.err
    found: list[str] = json.loads(ended.out)["steps"][0]["reasons"]
    return found


def write_tube(path: Path, inner: float) -> None:
    part = surface(rod(14.0, 15.0) - rod(inner, 30.0))
    path.write_bytes(FORMATS["stl"].write(part, "tube"))


def test_a_wall_of_given_thickness(poro: Poro, tmp_path: Path) -> None:
    (tmp_path / "wall.yaml").write_text(FINER + "initial: {wall: 6.0}\n")
    ended = poro("optimize", "wall.yaml", *BEGIN)
    assert ended.code == ExitCode.OK, ended.err
    domain = HalfCylinder(15.0, 15.0, 3, 1, 3)
    chi, radii = chi_of(tmp_path / "wall/wall.h5"), np.hypot(*domain.points[:, 1:].T)
    assert (chi[radii < 8.5] < 0.0).all()
    assert (chi[(radii > 9.5) & (radii < 14.0)] > 0.0).all()
    assert np.abs(chi[radii > 14.9]).max() < 1e-9  # the surface of the part
    # The figure of Appendix C's design is not of this case.
    drawn = poro("plot", "wall.yaml", "--output", ".", "--only", "initial")
    assert "begins with a wall" in drawn.out


def test_the_result_of_another_case_on_another_mesh(folder: Path, poro: Poro) -> None:
    (folder / "next.yaml").write_text(FINER + "initial: {file: tiny.h5}\n")
    assert poro("optimize", "next.yaml", *BEGIN).code == ExitCode.OK
    mine, source = chi_of(folder / "next/next.h5"), chi_of(folder / "tiny/tiny.h5")
    assert source.min() <= mine.min() < mine.max() <= source.max()
    axis = HalfCylinder(15.0, 15.0, 3, 1, 3).points[:, 1:] == 0.0
    coarse = HalfCylinder(15.0, 15.0, 2, 1, 3).points[:, 1:] == 0.0
    np.testing.assert_allclose(mine[axis.all(axis=1)], source[coarse.all(axis=1)], atol=1e-12)


def test_a_file_is_known_by_what_it_holds(folder: Path, poro: Poro) -> None:
    (folder / "cases").mkdir()
    (folder / "cases" / "next.yaml").write_text(FINER + "initial: {file: tube.stl}\noptimizer: {max_updates: 0}\n")
    write_tube(folder / "cases" / "tube.stl", 8.0)
    case = "cases/next.yaml"
    assert poro("optimize", case, *BEGIN[:-2]).code == ExitCode.OK
    assert chi_of(folder / "next/next.h5").max() > 0.0
    assert not reasons(poro, case)
    shutil.move(folder / "cases" / "tube.stl", folder / "cases" / "other.stl")
    (folder / "cases" / "next.yaml").write_text(FINER + "initial: {file: other.stl}\noptimizer: {max_updates: 0}\n")
    assert not reasons(poro, case)  # the same content elsewhere
    write_tube(folder / "cases" / "other.stl", 9.0)
    (reason,) = reasons(poro, case)
    assert reason.startswith("settings changed: initial.sha256 ")
    # One that the case insists on is another.
    (folder / "cases" / "next.yaml").write_text(f"initial: {{file: other.stl, sha256: '{'0' * 64}'}}\n")
    ended = poro("optimize", case, *BEGIN)
    assert ended.code == ExitCode.USAGE
    assert "cases/next.yaml:1: initial.file: what " in ended.err


def test_a_case_that_says_nothing_of_it_stays_up_to_date(folder: Path, poro: Poro) -> None:
    (folder / "tiny.yaml").write_text(TINY + "initial: {wall: null}\n")
    assert not reasons(poro, "tiny.yaml")
    (folder / "tiny.yaml").write_text(TINY + "initial: {wall: 5.0}\n")
    assert reasons(poro, "tiny.yaml") == ["settings changed: initial.wall unset → 5.0"]


@pytest.mark.parametrize(
    ("section", "code", "sentence"),
    [
        ("{file: none.h5}", ExitCode.ARTIFACT, "bad.yaml:2: initial.file: "),
        ("{file: bad.yaml}", ExitCode.ARTIFACT, "holds no design; give a result, NAME.h5, or a part as STL or 3MF"),
        ("{file: tiny.stl.h5}", ExitCode.ARTIFACT, "this is the result of 'export'; give that of optimize or refine"),
        ("{file: bad/bad.h5}", ExitCode.USAGE, "is where the case's own result goes; give the case another name"),
        ("{file: tiny.h5, wall: 3.0}", ExitCode.USAGE, "bad.yaml:2: initial: has both 'wall' and 'file'"),
        ("{scale: 2.0}", ExitCode.USAGE, "bad.yaml:2: initial: has 'scale' but no 'file'"),
        ("{wall: -1.0}", ExitCode.USAGE, "bad.yaml:2: initial.wall: must be greater than 0"),
        ("{wall: 15.0}", ExitCode.USAGE, "a wall of 15 mm leaves no chamber in a domain of 15 mm"),
        ("{file: tiny.stl, scale: 0.01}", ExitCode.USAGE, "no vertex of the mesh lies in the solid"),
    ],
)
def test_what_is_no_use_is_said(folder: Path, poro: Poro, section: str, code: ExitCode, sentence: str) -> None:
    (folder / "bad.yaml").write_text(f"{FINER}initial: {section}\n")
    ended = poro("optimize", "bad.yaml", *BEGIN)
    assert ended.code == code, ended.err
    assert sentence in ended.err
    assert not (folder / "bad/bad.h5").exists()


def test_open_triangles_are_refused_as_poro_check_does(folder: Path, poro: Poro) -> None:
    part = trimesh.load_mesh(folder / "tiny/tiny.stl")
    part.faces = part.faces[1:]
    part.export(folder / "open.stl")
    (folder / "next.yaml").write_text(FINER + "initial: {file: open.stl}\n")
    ended = poro("optimize", "next.yaml", *BEGIN)
    assert ended.code == ExitCode.BAD_SOLID
    assert "The surface bounds no solid: 3 open edges" in ended.err


def test_the_command_line_names_the_file(folder: Path, poro: Poro) -> None:
    (folder / "next.yaml").write_text("domain: {core_cells: 2, rings: 1, layers: 3}\n")
    for name in ("tiny.h5", "tiny/tiny.h5"):  # the same content, and so the same case
        ended = poro("optimize", "next.yaml", *BEGIN, "--set", f"initial.file={name}")
        assert ended.code == ExitCode.OK, ended.err
    assert "optimize: up to date" in ended.err
    np.testing.assert_array_equal(chi_of(folder / "next/next.h5"), chi_of(folder / "tiny/tiny.h5"))
    assert "initial.file" in poro("optimize", "next.yaml", *BEGIN, "--set", "initial.file=none.h5").err


def test_from_python(folder: Path) -> None:
    case = door.with_changes(door.read_case(folder / "tiny.yaml"), {"optimizer.max_updates": 0, "compute.threads": 1})
    design = door.load(folder / "tiny/tiny.h5")
    np.testing.assert_array_equal(door.optimize(case, initial=design).chi, design.chi)
    named = door.with_changes(case, {"initial.file": str(folder / "tiny/tiny.h5")})
    np.testing.assert_array_equal(door.optimize(named).chi, design.chi)
    part = door.optimize(case, initial=door.load(folder / "tiny/tiny.stl"))
    assert not np.array_equal(part.chi, design.chi)
