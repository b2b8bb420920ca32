"""What is said of results that are there but may mislead: states that are not stable, springs that hold or are none."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import pytest
from command_line import TINY, Poro

from actuator.linear import available
from pipeline.exit_codes import ExitCode
from pipeline.store import contents
from stages import refine

ONE = ("--output", ".", "--threads", 1)
#: Void folds at this pressure, and Newton's method from rest does not find the state.
SOFT = "domain: {core_cells: 3, rings: 1, layers: 3}\nload: {pressure_ratio: 0.11}\noptimizer: {max_updates: 0}\n"


@pytest.mark.skipif(available()[0] != "pardiso", reason="SuperLU does not count negative eigenvalues")
def test_a_state_that_is_not_stable_has_a_code_of_its_own(poro: Poro, tmp_path: Path) -> None:
    (tmp_path / "soft.yaml").write_text(SOFT)
    ended = poro("run", "soft.yaml", "--until", "refine", *ONE[:2])
    assert ended.code == ExitCode.UNSTABLE == 7
    assert "the pressure is raised from zero in steps" in ended.err
    assert "state at 100% of p_in" in ended.err
    last = ended.err.splitlines()[-1]
    assert last.startswith("poro: soft/soft.h5: the design is stored, but its state is not stable")
    assert "material.hessian_regularisation" in last
    assert "C0" in ended.out  # the summary is there as ever
    assert contents.summary(tmp_path / "soft/soft.h5", "optimize")["negative_eigenvalues"] > 0
    assert (tmp_path / "soft/details/soft.refined.h5").exists()
    again = poro("optimize", "soft.yaml", *ONE)
    assert "up to date" in again.err
    assert again.code == ExitCode.UNSTABLE
    assert poro("refine", "soft.yaml", *ONE[:2]).code == ExitCode.OK  # about another result


def test_without_a_spring_nothing_is_said_of_one(poro: Poro, tmp_path: Path) -> None:
    (tmp_path / "free.yaml").write_text(TINY + "load: {spring_ratio: 0.0}\nrig: {youngs_modulus: 1.0}\n")
    ended = poro("optimize", "free.yaml", *ONE, "--updates", 0)
    assert ended.code == ExitCode.OK
    assert "spring" not in ended.out + ended.err
    travel = contents.summary(tmp_path / "free/free.h5", "optimize")["spring_elongation"]
    assert f"  travel of the arm   {travel:.3f} mm" in ended.out.splitlines()


def test_a_held_end_is_told_with_its_force(poro: Poro, tmp_path: Path) -> None:
    found = {}
    for name, ratio in (("held", "1.0e+6"), ("stiff", "1.0e+4")):
        (tmp_path / f"{name}.yaml").write_text(TINY + f"load: {{spring_ratio: {ratio}}}\n")
        ended = poro("optimize", f"{name}.yaml", *ONE, "--updates", 0)
        assert ended.code == ExitCode.OK
        found[name] = contents.summary(tmp_path / f"{name}/{name}.h5", "optimize")
        assert "holds the arm's end: C0, which is the travel of that end over L_arm, stays 0" in ended.err
        assert "Lower load.spring_ratio" in ended.err
        line = next(line for line in ended.out.splitlines() if line.startswith("  blocked force"))
        assert f"{abs(found[name]['spring_force']):.4g} N at the arm's end" in line
        assert "spring elongation" not in ended.out
    # The force is that of the held end, whatever holds it; of the whole actuator: twice that of the half.
    assert found["held"]["spring_force"] == pytest.approx(found["stiff"]["spring_force"], rel=1e-3)
    stiffness = 1e6 * 2.736 * 15.0**3 / 60.0**2
    assert found["held"]["spring_force"] == pytest.approx(
        2.0 * stiffness * found["held"]["spring_elongation"], rel=1e-9
    )


@pytest.mark.filterwarnings("default")
def test_warnings_of_libraries_go_to_the_log(folder: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch) -> None:
    run = refine.run

    def warning(*arguments: Any) -> refine.Result:
        warnings.warn("a matrix is ill-conditioned", RuntimeWarning, stacklevel=2)
        return run(*arguments)

    monkeypatch.setattr(refine, "run", warning)
    ended = poro("refine", "tiny.yaml", "--output", ".", "--force", "--json")
    assert ended.code == ExitCode.OK
    assert json.loads(ended.out)["name"] == "tiny"
    assert "ill-conditioned" not in ended.err + ended.out
    assert "a matrix is ill-conditioned" in (folder / "tiny/details/tiny.log").read_text()
