"""``poro sweep``: cases in processes of their own, continued where they were left, and the tables they end in."""

from __future__ import annotations

import csv
import json
import os
import platform
import shutil
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import POSIX_SIGNALS, PROGRAM, TINY, Poro, environment
from PIL import Image

from actuator import compilation
from actuator.material.laws.yeoh import Yeoh
from actuator.parameters import Law
from pipeline.exit_codes import ExitCode
from pipeline.figures.saving import save
from pipeline.figures.sweep import sweep
from pipeline.runs.claim import claimed, holder
from pipeline.store import artifact
from pipeline.study.study import read_study
from pipeline.study.sweep import Sweep

#: The second of three cases has no state.
STUDY = """\
case: tiny.yaml
vary:
  load.pressure_ratio: [0.01, 1.0e+6, 0.02]
until: optimize
"""
NAMES = [f"tiny.pressure_ratio-{value}" for value in ("0.01", "1.0e6", "0.02")]
TINIEST = TINY.replace("max_updates: 1", "max_updates: 0")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def written(folder: Path, study: str = STUDY, case: str = TINIEST) -> Path:
    (folder / "tiny.yaml").write_text(case)
    (folder / "study.yaml").write_text(study)
    return folder


def test_failures_stop_nothing_and_a_second_run_does_what_is_missing(poro: Poro, tmp_path: Path) -> None:
    written(tmp_path)
    ended = poro("sweep", "study.yaml", "--jobs", 2, "--json")
    assert ended.code == ExitCode.NOT_CONVERGED
    assert f"1 of 3 cases failed, the first of them {NAMES[1]}: optimize: " in ended.err.splitlines()[-1]
    assert "3 of 3 cases to run, 2 at once with 1 thread each" in ended.err
    found = json.loads(ended.out)
    assert [case["name"] for case in found["cases"]] == NAMES
    assert [case["values"] for case in found["cases"]] == [{"load.pressure_ratio": p} for p in (0.01, 1e6, 0.02)]
    assert [case["exit_code"] for case in found["cases"]] == [0, 3, 0]
    table = rows(Path("study.sweep.csv"))
    assert [row["C0"] == "" for row in table] == [False, True, False]
    for row, case in zip(table, found["cases"], strict=True):
        assert row["sentence"] == case["sentence"]
        if row["exit_code"] == "0":
            terms, angle = case["C0"], case["theta2"]
            history = artifact.read_group(
                Path("study.sweep") / row["name"] / f"{row['name']}.h5", "optimize", "history"
            )
            assert float(row["C0"]) == terms == history["C0"][-1]
            assert angle == pytest.approx(np.degrees(history["theta2"][-1]))
    markdown = Path("study.sweep.md").read_text(encoding="utf-8")
    assert "| theta2 [degrees] |" in markdown
    assert f"- {NAMES[1]}: optimize: " in markdown
    with Image.open("study.sweep.png") as picture:
        assert 0.005 < (np.asarray(picture.convert("L")) < 200).mean() < 0.5
    log = Path("study.sweep/tiny.pressure_ratio-0.02/details/tiny.pressure_ratio-0.02.log").read_text(encoding="utf-8")
    assert "optimize" in log

    (tmp_path / "study.yaml").write_text(STUDY.replace("1.0e+6", "0.015"))
    again = poro("sweep", "study.yaml", "--jobs", 1)
    assert again.code == ExitCode.OK, again.err
    assert "1 of 3 cases to run" in again.err
    assert [row["exit_code"] for row in rows(Path("study.sweep.csv"))] == ["0", "0", "0"]
    assert "0 of 3 cases to run" in poro("sweep", "study.yaml").err

    stale = poro("sweep", "study.yaml", "--dry-run")
    assert stale.out.count("up to date") == 3
    (tmp_path / "tiny.yaml").write_text(TINIEST + "  first_step: 50.0\n")
    assert poro("sweep", "study.yaml", "--dry-run").out.count("up to date") == 0
    collected = poro("sweep", "study.yaml", "--collect")
    assert collected.code == ExitCode.ARTIFACT
    assert "3 of 3 cases are not run to an end" in collected.err
    assert [row["C0"] for row in rows(Path("study.sweep.csv"))] == ["", "", ""]


def test_kernels_are_compiled_for_the_laws_of_the_cases(
    poro: Poro, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: list[Law] = []
    monkeypatch.setattr(compilation, "compile_kernels", compiled.append)
    monkeypatch.setattr(Sweep, "run", lambda *arguments: None)
    study = "case: tiny.yaml\nvary: {material.law.c2: [0.1, 0.2]}\n"
    written(tmp_path, study, TINIEST + "material: {law: {name: yeoh, c2: 0.0, c3: 0.5}}\n")
    poro("sweep", "study.yaml")
    assert compiled == [Yeoh(0.2, 0.5)]  # one of the type will do


def _asking_to_stop() -> list[Any]:
    """Signals by which people, terminals and batch systems end a sweep; one of them is tried at every run of tests."""
    names = ("SIGHUP", "SIGINT", "SIGTERM", "SIGUSR1", "SIGUSR2", "SIGXCPU", "SIGKILL")
    found = [getattr(signal, name, signal.SIGTERM) for name in names]  # on Windows they are not tried at all
    return [pytest.param(number, marks=[pytest.mark.slow][: number != found[0]], id=number.name) for number in found]


@POSIX_SIGNALS
@pytest.mark.parametrize("number", _asking_to_stop())
def test_interrupted_sweep_ends_its_cases_and_continues(
    number: signal.Signals, tmp_path: Path, poro: Poro, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = "case: tiny.yaml\nvary: {load.pressure_ratio: [0.01, 0.02]}\nuntil: optimize\n"
    written(tmp_path, study, TINY.replace("max_updates: 1", "max_updates: 200"))

    def as_in_a_terminal() -> None:
        """A background job, or one of nohup, hands on that these are ignored."""
        signal.signal(signal.SIGINT, signal.default_int_handler)
        signal.signal(signal.SIGHUP, signal.SIG_DFL)

    process = subprocess.Popen(
        [*PROGRAM, "sweep", "study.yaml", "--jobs", "1"],
        env=environment(),
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        preexec_fn=as_in_a_terminal,
    )
    first = tmp_path / "study.sweep" / "tiny.pressure_ratio-0.01/details/tiny.pressure_ratio-0.01.checkpoint.h5"
    limit = time.monotonic() + 120
    while not first.exists() and process.poll() is None and time.monotonic() < limit:
        time.sleep(0.05)
    process.send_signal(number)
    said = process.communicate(timeout=120)[1]
    sweep = Sweep(read_study(tmp_path / "study.yaml"), tmp_path)
    files = sweep.job(sweep.study.variants[0]).files
    if number == signal.SIGKILL:  # nobody is left to wait for the case
        while holder(files) and time.monotonic() < limit:
            time.sleep(0.05)
    else:
        assert process.returncode == ExitCode.INTERRUPTED, said
        assert "Interrupted with 2 of 2 cases left; run the same command to continue." in said
    assert holder(files) is None
    assert not sweep.outcome_file(sweep.study.variants[0]).exists()
    assert "which is stored" in files.log.read_text(encoding="utf-8")
    stored = int(artifact.read(first, "checkpoint", "progress/updates")[0])
    # The rest of it takes too long here; that the case goes on is what matters.
    case = first.parents[1] / "tiny.pressure_ratio-0.01.yaml"
    ended = poro("optimize", case, "--output", case.parents[1], "--updates", stored + 1, "--threads", 1)
    assert ended.code == ExitCode.OK
    assert f"Continuing after design update {stored}." in ended.err


def test_sweep_says_who_works_on_a_case_and_leaves_it_alone(
    poro: Poro, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pipeline.study.sweep.PATIENCE", 0.0)
    written(tmp_path, "case: tiny.yaml\nvary: {load.pressure_ratio: [0.01]}\nuntil: optimize\n")
    sweep = Sweep(read_study(Path("study.yaml")), Path())
    (variant,) = sweep.study.variants
    sweep.prepare([variant])
    with claimed(sweep.job(variant).files):
        ended = poro("sweep", "study.yaml")
        assert ended.code == ExitCode.BUSY
        who = f"process {os.getpid()} on {platform.node()} is working on it"
        assert f"{variant.case.name}: not run: {who}\n" in ended.err
        last = ended.err.splitlines()[-1]
        assert last == f"poro: 1 of 1 cases are not run, the first of them {variant.case.name}: {who}; " + (
            "run the same command again once that has ended."
        )
        assert who in Path("study.sweep.md").read_text(encoding="utf-8")
    assert not sweep.outcome_file(variant).exists()


@pytest.mark.parametrize(("keys", "images"), [((3,), 0), ((3, 2), 0), ((12, 9), 4), ((3, 2, 2), 0)])
def test_plots_show_curves_or_a_map(keys: tuple[int, ...], images: int, tmp_path: Path) -> None:
    names = ("load.pressure_ratio", "objective.strain_limit", "export.format")[: len(keys)]
    lists = [[round(0.01 * (i + 1), 3) for i in range(count)] for count in keys]
    if len(keys) == 3:
        lists[2] = ["stl", "3mf"]
    vary = "".join(f"  {name}: {found}\n".replace("'", "") for name, found in zip(names, lists, strict=True))
    written(tmp_path, f"case: tiny.yaml\nvary:\n{vary}")
    study = read_study(tmp_path / "study.yaml")
    table = [
        dict(variant.values) | {"C0": -0.1 * i, "T3": 1.0 + i, "theta2": 2.0, "spring_elongation": None}
        for i, variant in enumerate(study.variants)
    ]
    figure = sweep(table, study.keys, grid=study.grid, logarithmic=study.logarithmic)
    assert sum(len(axes.images) for axes in figure.axes) == images
    save(figure, tmp_path / "x.png")
    with Image.open(tmp_path / "x.png") as pixels:
        assert pixels.size == (1100, 770)
    if not images:
        assert len(figure.axes[0].lines) == len(study.variants) // max(keys)


@pytest.mark.skipif(find_spec("snakemake") is None, reason="Snakemake is not installed (extra 'cluster')")
def test_snakemake_runs_the_study_two_jobs_at_once(poro: Poro, tmp_path: Path) -> None:
    written(tmp_path, STUDY.replace(", 0.02]", "]"))
    workflow = poro("sweep", "--workflow-path").out.strip()
    command = [sys.executable, "-m", "snakemake", "--snakefile", workflow, "--config", "study=study.yaml"]
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    called = [*command, "output=there", "--jobs", "2"]
    ended = subprocess.run(called, env=environment, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr[-3000:]
    assert "Execute 2 jobs..." in ended.stderr
    found = {row["name"]: row["exit_code"] for row in rows(Path("there/study.sweep.csv"))}
    assert found == dict(zip(NAMES[:2], ["0", "3"], strict=True))
    # The program and Snakemake agree on what is done.
    assert poro("sweep", "study.yaml", "--output", "there", "--dry-run").out.count("up to date") == 1
    again = subprocess.run([*called, "--dry-run"], env=environment, capture_output=True, text=True, check=False)
    assert "Nothing to be done" in again.stdout + again.stderr
    shutil.rmtree(tmp_path / ".snakemake")
