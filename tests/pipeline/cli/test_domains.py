"""Every design domain through the real command line: from a case file to a part, its figures and its rig sheet."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import trimesh
from command_line import TO_PART, Poro

from pipeline.exit_codes import ExitCode
from pipeline.store import contents

CYLINDER = "shape: cylinder, core_cells: 2, rings: 1, layers: 3"
BOX = "shape: box, length: 20.0, width: 16.0, height: 20.0, across: 2, up: 2, rings: 2, layers: 3"
PRISM = (
    "shape: prism, length: 16.0, across: 2, up: 2, rings: 2, layers: 3, whole: true, "
    "profile: [[0.0, -8.0], [14.0, -8.0], [8.0, 9.0], [0.0, 9.0]]"
)
REST = "optimizer: {max_updates: 1}\nrig: {youngs_modulus: 1.0}\nrefine: {factor: 1}\n"


@pytest.mark.parametrize(
    ("domain", "size", "sheet"),
    [
        pytest.param(CYLINDER, (15.0, 30.0, 30.0), "| radius R | 15 mm |", marks=pytest.mark.slow),
        pytest.param(BOX, (20.0, 16.0, 20.0), "| edge r_e | 2 mm |", marks=pytest.mark.slow),
        (PRISM, (16.0, 28.0, 17.0), "| length L | 16 mm |"),
    ],
    ids=["cylinder", "box", "prism"],
)
def test_a_domain_goes_through_the_chain(
    domain: str, size: tuple[float, float, float], sheet: str, tmp_path: Path, poro: Poro
) -> None:
    Path("a.yaml").write_text(f"domain: {{{domain}}}\n{REST}")
    ended = poro("run", "a.yaml", *TO_PART, "--threads", "1", "--output", ".")
    assert ended.code == ExitCode.OK, ended.err
    part = trimesh.load_mesh("a/a.stl")
    assert part.is_watertight
    low, high = part.bounds
    assert (low[0], high[0]) == pytest.approx((0.0, size[0]), abs=1e-4)
    assert all(0.6 * side < extent <= side for extent, side in zip((high - low)[1:], size[1:], strict=True))
    assert high[1] == pytest.approx(-low[1], abs=0.1)
    assert sheet in Path("a/a.rig.md").read_text(encoding="utf-8")
    # Opened again without the case.
    built, _ = contents.design(Path("a/a.h5"), "optimize")
    steps = json.loads(poro("status", "a.yaml", "--json", "--output", ".").out)["steps"]
    assert [step["runs"] for step in steps] == [*[False] * 5, True]  # all but inflating
    assert poro("refine", "a/a.h5").code == ExitCode.OK
    assert contents.design(Path("a/details/a.refined.h5"), "refine")[0] == built
    # All figures of a whole of any section; of the others that which shows where the domain is.
    drawn = poro("plot", "a.yaml", "--output", ".", *([] if "prism" in domain else ["--only", "initial"]))
    assert drawn.code == ExitCode.OK, drawn.err
    assert "not drawn" not in drawn.out
    if "box" in domain:
        reported = poro("report", "a.yaml", "--output", ".")
        assert reported.code == ExitCode.OK, reported.err
        assert "R = 10 mm" in Path("a/a.report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("domain", "said"),
    [
        ("{shape: box, edge: 9.5}", "domain: has edges of 9.5 mm, more than 45 % of width or height"),
        ("{shape: prism, profile: [[0, -1], [1, 0, 2], [0, 1]]}", "domain: has a profile with points that are not two"),
        ("{shape: prism, profile: [[1, -9], [9, -9], [0, 9]]}", "domain: has a profile that must begin and end on the"),
        ("{shape: prism, inlet_height: 11.0}", "must go from below the axis at X3 = 11 to above it"),
        (
            "{shape: prism, profile: [[0, -9], [9, -9], [9, -2], [1, -2], [1, 9], [0, 9]], inlet_height: 3.0}",
            "domain: has a profile that must be seen whole from the axis at X3 = 3, and its piece 3 is hidden",
        ),
        (
            "{shape: prism, profile: [[0, -9], [4, -9], [5, -3], [9, 0], [4, 2], [0, 9]], across: 1, up: 1}",
            "domain: has 4 corners and 4 cells along the wall; raise across or up",
        ),
    ],
)
def test_a_section_that_cannot_be_meshed_is_refused(domain: str, said: str, tmp_path: Path, poro: Poro) -> None:
    Path("bad.yaml").write_text(f"name: bad\ndomain: {domain}\n")
    ended = poro("optimize", "bad.yaml", "--output", ".")
    assert ended.code == ExitCode.USAGE
    assert ended.err.startswith("poro: bad.yaml:2: ")
    assert said in ended.err
    assert ended.err.count("\n") == 1
