"""The small shipped case from end to end, as `make demo` runs it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from command_line import Poro

from pipeline import artifact
from pipeline.exit_codes import ExitCode


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
