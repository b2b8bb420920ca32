"""The small shipped case from end to end, as `make demo` runs it."""

from __future__ import annotations

import json
import random
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import POSIX_SIGNALS, PROGRAM, Poro, environment
from numpy.typing import NDArray

from pipeline.case.shipped import shipped_case
from pipeline.exit_codes import ExitCode
from pipeline.store import artifact

COMMAND = [*PROGRAM, "optimize", "long.yaml", "--output", ".", "--threads", "2"]


def optimised(folder: Path, killed_after: float | None = None) -> dict[str, NDArray[np.float64]]:
    """History and design of the small case with more updates and a stricter end, once killed or undisturbed."""
    folder.mkdir()
    shipped = shipped_case("quick.yaml")
    assert shipped
    text = shipped.read_text()
    limits = "max_updates: 100\n  stationarity: 1.0e-4"
    (folder / "long.yaml").write_text(text.replace("max_updates: 30", limits))
    if killed_after is not None:
        with subprocess.Popen(COMMAND, cwd=folder, env=environment(), stderr=subprocess.PIPE, text=True) as process:
            assert process.stderr
            next(line for line in process.stderr if line.split()[:1] == ["1"])  # the first design update
            time.sleep(killed_after)
            process.kill()
        assert (folder / "long.checkpoint.h5").exists()
        assert not (folder / "long.h5").exists()
    ended = subprocess.run(COMMAND, cwd=folder, env=environment(), capture_output=True, text=True)
    assert ended.returncode == ExitCode.OK, ended.stderr
    updates = [line.split()[0] for line in ended.stderr.splitlines() if line.split()[:1] and line.split()[0].isdigit()]
    assert (updates[0] == "0") == (killed_after is None), "a killed run goes on from its checkpoint"
    found = artifact.read_group(folder / "long.h5", "optimize", "history")
    return found | {"chi": artifact.read_group(folder / "long.h5", "optimize", "vertices")["chi"]}


@pytest.mark.slow
@POSIX_SIGNALS
def test_small_case_converges_superlinearly_and_in_the_same_place_when_killed(tmp_path: Path) -> None:
    whole = optimised(tmp_path / "whole")
    assert (np.diff(whole["C"]) < 0.0).all()
    assert whole["stationarity"][0] > 100.0
    assert whole["stationarity"][-1] < 1e-4
    # Three updates before the end it is hundreds of times as large, and what the last one gains is next to nothing.
    assert whole["stationarity"][-4] > 300.0 * whole["stationarity"][-1]
    assert whole["C"][-2] - whole["C"][-1] < 1e-5 * abs(whole["C"][-1])
    assert whole["C0"][-1] < -0.16

    killed = optimised(tmp_path / "killed", random.Random().uniform(0.0, 30.0))  # it takes minutes
    np.testing.assert_array_equal(killed["chi"], whole["chi"])
    np.testing.assert_array_equal(killed["C"], whole["C"])


@pytest.mark.slow
def test_small_actuator_bends_and_can_be_printed(poro: Poro) -> None:
    ended = poro("run", "quick.yaml", "--json")
    assert ended.code == ExitCode.OK, ended.err
    summary = json.loads(ended.out)
    # Ten times the deflection of the initial design, which is about -0.0042.
    assert summary["terms"]["C0"] <= -0.04
    history = artifact.read_group(Path("quick.h5"), "optimize", "history")
    assert (np.diff(history["C"]) <= 0.0).all()

    part = trimesh.load_mesh("quick.stl")
    assert part.is_watertight
    assert part.volume > 0.0
    low, high = part.bounds
    assert high[0] - low[0] == pytest.approx(1.5 * 15.0, rel=1e-3)
    assert np.hypot(part.vertices[:, 1], part.vertices[:, 2]).max() <= 1.5 * 15.0 * (1.0 + 1e-6)
    mirrored = {tuple(vertex) for vertex in part.vertices * [1.0, -1.0, 1.0] + 0.0}
    assert mirrored == {tuple(vertex) for vertex in part.vertices + 0.0}
