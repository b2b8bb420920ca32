"""`poro optimize`: what it prints and stores, and how it is interrupted and continued."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from command_line import POSIX_SIGNALS, TINY, Poro

from pipeline.exit_codes import ExitCode
from pipeline.runs import checkpoint
from pipeline.store import artifact

TERMS = {"C0", "C_chi", "C_A", "C_i", "C_p", "C_psi"}


def test_json_summary_has_what_is_promised(folder: Path, poro: Poro) -> None:
    ended = poro("optimize", "tiny.yaml", "--output", ".", "--json")
    assert ended.code == ExitCode.OK
    summary = json.loads(ended.out)
    assert {"C", "T1", "T3", "theta2", "p_min", "p_max", "evaluations", "seconds"} <= set(summary)
    assert set(summary["terms"]) == TERMS
    assert sum(summary["terms"].values()) == pytest.approx(summary["C"])
    assert summary["updates"] == 1


def test_artifact_holds_history_and_case(folder: Path) -> None:
    header = artifact.read_header(folder / "tiny/tiny.h5")
    assert header.case_text == TINY
    assert header.case_resolved["objective"]["strain_limit"] == 0.14
    history = artifact.read_group(folder / "tiny/tiny.h5", "optimize", "history")
    assert set(history) > TERMS
    np.testing.assert_array_equal(history["update"], [0, 1])
    assert history["C"][1] <= history["C"][0]
    with h5py.File(folder / "tiny/tiny.h5") as file:
        assert file["nodes/displacement"].attrs["units"] == "mm"


def test_zero_updates_evaluate_the_initial_design_only(folder: Path, poro: Poro) -> None:
    ended = poro("optimize", "tiny.yaml", "--output", "initial", "--updates", 0, "--json", "--threads", 1)
    summary = json.loads(ended.out)
    history = artifact.read_group(folder / "tiny/tiny.h5", "optimize", "history")
    assert summary["updates"] == 0
    assert summary["evaluations"] == 1
    assert summary["C"] == pytest.approx(history["C"][0], rel=1e-9)


def test_elements_of_the_pressure_are_those_of_the_case(folder: Path, tmp_path: Path, poro: Poro) -> None:
    """Others find another p; a kind that there is not is refused."""
    pressures = []
    for kind in ("fitted", "plain"):
        change = ("--updates", "0", "--set", f"elements.pressure={kind}", "--output", tmp_path / kind)
        assert poro("run", folder / "tiny.yaml", "--until", "optimize", *change).code == ExitCode.OK
        with h5py.File(tmp_path / kind / "tiny/tiny.h5") as file:
            pressures.append(file["nodes/pressure"][:])
    assert np.abs(pressures[0] - pressures[1]).max() > 1e-6 * pressures[0].max()
    refused = poro("run", folder / "tiny.yaml", "--set", "elements.pressure=cubic")
    assert refused.code == ExitCode.USAGE
    assert "elements.pressure" in refused.err


def test_more_updates_continue_from_the_finished_design(folder: Path, poro: Poro) -> None:
    first = artifact.read_group(folder / "tiny/tiny.h5", "optimize", "history")["C"]
    ended = poro("optimize", "tiny.yaml", "--output", ".", "--updates", 2, "--threads", 1)
    assert ended.code == ExitCode.OK
    longer = artifact.read_group(folder / "tiny/tiny.h5", "optimize", "history")["C"]
    assert len(longer) == 3
    np.testing.assert_array_equal(longer[:2], first)
    assert "after design update 1" in ended.err


def test_stricter_end_continues_from_the_finished_design(folder: Path, poro: Poro) -> None:
    """Where a run ends does not change its path, so that nothing is computed again."""
    for name, measure, gain in (("loose", "1.0e+9", "0.1"), ("strict", "0.001", "0.0")):
        (folder / "ends.yaml").write_text(TINY + f"  stationarity: {measure}\n  least_gain: {gain}\n")
        ended = poro("optimize", "ends.yaml", "--output", "ends", "--threads", 1)
        assert ended.code == ExitCode.OK
        assert ("Continuing after design update 0" in ended.err) == (name == "strict")
    assert len(artifact.read_group(folder / "ends/ends/ends.h5", "optimize", "history")["C"]) == 2


def test_fewer_updates_do_not_replace_a_longer_run(folder: Path, poro: Poro) -> None:
    before = (folder / "tiny/tiny.h5").read_bytes()
    fewer = ("optimize", "tiny.yaml", "--output", ".", "--updates", 0, "--threads", 1)
    ended = poro(*fewer)
    assert ended.code == ExitCode.USAGE
    assert "tiny.h5: holds 1 design updates of this case, more than the 0 asked for" in ended.err
    assert (folder / "tiny/tiny.h5").read_bytes() == before
    assert poro(*fewer, "--fresh").code == ExitCode.OK
    assert len(artifact.read_group(folder / "tiny/tiny.h5", "optimize", "history")["C"]) == 1


@pytest.mark.parametrize("limit", [0.11, 0.02])
def test_initial_design_beyond_the_strain_limit_gets_through(folder: Path, poro: Poro, limit: float) -> None:
    """C_Ψ outweighs all else there by far, up to the last digits of the adjoint."""
    text = TINY.replace("max_updates: 1", "max_updates: 4\n  max_inner_steps: 10")
    text = text.replace("strain_energy_shift: 4/L_i", f"strain_limit: {limit}\n  strain_energy_shift: 4.0")
    (folder / "beyond.yaml").write_text(text)
    ended = poro("optimize", "beyond.yaml", "--output", "beyond", "--threads", 1)
    assert ended.code == ExitCode.OK, ended.err
    history = artifact.read_group(folder / "beyond/beyond/beyond.h5", "optimize", "history")
    assert history["energy_ratio"][0] > 4.0
    assert history["C_psi"][0] > 0.9 * history["C"][0]
    assert (np.diff(history["C"]) < 0.0).all()
    assert history["energy_ratio"][-1] < 0.7 * history["energy_ratio"][0]


def test_case_without_a_state_ends_with_code_3(folder: Path, poro: Poro) -> None:
    (folder / "wild.yaml").write_text(TINY + "load: {pressure_ratio: 1.0e+6}\n")
    ended = poro("optimize", "wild.yaml", "--output", "wild", "--updates", 0, "--threads", 1)
    assert ended.code == ExitCode.NOT_CONVERGED
    assert ended.err.splitlines()[-1].startswith("poro: optimize: ")
    assert not (folder / "wild" / "wild.h5").exists()


def test_folder_that_cannot_be_made_is_refused(folder: Path, poro: Poro) -> None:
    ended = poro("optimize", "tiny.yaml", "--output", folder / "tiny.yaml" / "x")
    assert ended.code == ExitCode.USAGE
    assert "--output" in ended.err


def _started(folder: Path, updates: int, output: str = ".") -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "poro", "optimize", "tiny.yaml", "--threads", "1"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        [*command, "--output", output, "--updates", str(updates)],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell's background job, which these tests may be, hands on that SIGINT is ignored; a terminal does not.
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.default_int_handler) if os.name == "posix" else None,
    )


@POSIX_SIGNALS
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGUSR1"])
def test_interruption_whose_exception_is_lost_still_ends_the_run(
    name: str, poro: Poro, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    number = getattr(signal, name)
    before = signal.signal(number, signal.SIG_DFL)  # nohup has hang-ups ignored
    observe = checkpoint.Keeper.observe

    def lost(keeper: checkpoint.Keeper, event: Any) -> None:
        observe(keeper, event)
        if getattr(event, "record", {}).get("update") == 1:
            with suppress(KeyboardInterrupt):  # as in a destructor
                signal.raise_signal(number)

    monkeypatch.setattr(checkpoint.Keeper, "observe", lost)
    ended = poro("optimize", "tiny.yaml", "--output", "stopped", "--threads", 1, "--updates", 3)
    assert ended.code == ExitCode.INTERRUPTED
    assert "after design update 1, which is stored" in ended.err
    monkeypatch.undo()
    assert signal.getsignal(number) is signal.SIG_DFL
    signal.signal(number, before)


@POSIX_SIGNALS
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
def test_interrupted_optimisation_continues_to_the_same_place(number: signal.Signals, tmp_path: Path) -> None:
    # Every run is a process of its own, as a user's are: what else this process has loaded must not matter.
    (tmp_path / "tiny.yaml").write_text(TINY)
    process = _started(tmp_path, updates=500)
    stopped = tmp_path / "tiny/details/tiny.checkpoint.h5"
    deadline = time.monotonic() + 120.0
    second = tmp_path / "tiny/details/tiny.updates" / "000002.h5"  # written after the checkpoint of the first update
    while not second.exists() and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(number)
    try:
        _, said = process.communicate(timeout=120)
    finally:
        process.kill()
    assert process.returncode == ExitCode.INTERRUPTED, said
    assert "run the same command to continue" in said.splitlines()[-1]
    stored = _stored(stopped)
    assert 1 <= stored < 500
    assert not (tmp_path / "tiny/tiny.h5").exists()

    # So many more as show that it goes on, and as many in one go.
    updates = stored + 2
    continuing = _started(tmp_path, updates)
    _, said = continuing.communicate(timeout=300)
    assert continuing.returncode == ExitCode.OK
    assert f"after design update {stored}" in said
    assert not stopped.exists()
    undisturbed = _started(tmp_path, updates, "whole")
    undisturbed.communicate(timeout=300)
    assert undisturbed.returncode == ExitCode.OK
    whole, continued = (
        artifact.read(tmp_path / path, "optimize", "vertices/chi")[0] for path in ("whole/tiny/tiny.h5", "tiny/tiny.h5")
    )
    np.testing.assert_allclose(continued, whole, rtol=1e-12, atol=1e-12)


def _stored(checkpoint: Path) -> int:
    """Design updates in a checkpoint; 0 if there is none."""
    return int(artifact.read(checkpoint, "checkpoint", "progress/updates")[0]) if checkpoint.exists() else 0


def test_fresh_ignores_and_other_settings_do_not_use_a_checkpoint(folder: Path, poro: Poro) -> None:
    options = ("--output", ".", "--threads", 1, "--updates", 2)
    assert "after design update 1" not in poro("optimize", "tiny.yaml", *options, "--fresh").err
    (folder / "tiny.yaml").write_text(TINY + "objective: {area_weight: 0.002}\n")
    assert "after design update" not in poro("optimize", "tiny.yaml", *options).err
